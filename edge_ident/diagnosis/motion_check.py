"""The error in simulated motion: how far a model's axes are from the measured ones.

A residual in effort does not say how far the motion is off. So the model is simulated through the
recorded motion, all axes together. Its actuators get the measured efforts. A soft feedback from the
measured positions keeps it near, because an open-loop drive drifts away from any recording. The rms
difference of position is the error.

Recordings do not say which controller made them, so the feedback is a convention: both poles of an
axis lie at a fifth of the bandwidth of the comparison (Gautier's rule, a filter five times above
the dynamics, read backwards), for the inertia of the extended model. A slow residual r shows as
r/(inertia·pole²).

The recording is cut into overlapping segments that are simulated side by side, as in multiple
shooting (Bock 1981). Each starts with the measured motion. The memory of effects decays in a
lead-in, which does not count.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.result import Diagnosis
from edge_ident.errors import ModelError
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion
from edge_ident.model.model import AxisModel, base_axis
from edge_ident.signals.filters import differentiate
from edge_ident.signals.recording import Recording, driven_in
from edge_ident.signals.time_stamps import EvenGrid
from edge_ident.simulation.machine import Machine

Array = NDArray[np.float64]

_POLE_SHARE: Final = 0.2
"""Poles of the feedback, of the bandwidth."""
_LEAD_IN: Final = 5.0
"""Lead-in, in time constants of the slowest pole: 4 % of a wrong start remain."""
_STEPS_PER_PERIOD: Final = 20.0
"""Steps per period of the widest bandwidth; the effort is constant over a step."""
_MOST_STEPS: Final = 1500
"""Integration steps, about a second; a model that needs more is not simulated."""
_CORRECTIONS: Final = 3
"""Fixed-point steps that remove a record's delay from its effort."""


def with_motion_errors(diagnosis: Diagnosis, recordings: Sequence[Recording]) -> Diagnosis:
    """Add the errors in simulated motion of both models to a diagnosis.

    They stay None where a model cannot be simulated: its parameters are not physical, the
    simulation runs away, its effects are so fast that it takes long, or no recording has all axes.

    Parameters
    ----------
    recordings : sequence of Recording
        Those of the diagnosis; only those with all its axes tell.
    """
    recordings = driven_in(recordings, diagnosis.axes)
    if not recordings:
        return diagnosis
    base = {
        name: base_axis(axis.base.estimate, *axis.model.units)
        for name, axis in diagnosis.axes.items()
    }
    extended = {name: axis.model for name, axis in diagnosis.axes.items()}
    bandwidth_hz = np.array([[axis.cutoff_hz] for axis in diagnosis.axes.values()])
    inertia = np.array([[axis.extended.estimate.parameters[0]] for axis in diagnosis.axes.values()])
    course = _course(recordings, tuple(extended), bandwidth_hz)
    before, after = (course.errors(axes, inertia) for axes in (base, extended))
    return replace(
        diagnosis,
        axes={
            name: replace(
                axis,
                base=replace(axis.base, motion_error=before.get(name)),
                extended=replace(axis.extended, motion_error=after.get(name)),
            )
            for name, axis in diagnosis.axes.items()
        },
    )


@dataclass(frozen=True)
class _Course:
    """Measured motion in D segments, of K steps each, on A axes.

    Attributes
    ----------
    recordings : tuple of Recording
        Evenly sampled, time from the first sample.
    instants_s : tuple of (K + 1, d) arrays
        Ends of the steps in the d segments of each recording; all d add up to D.
    position, velocity : (K + 1, A, D) arrays
        Smooth.
    poles : (A, 1) array
        Of the feedback, in rad/s.
    """

    recordings: tuple[Recording, ...]
    instants_s: tuple[Array, ...]
    position: Array
    velocity: Array
    poles: Array
    step_s: float

    def errors(self, axes: Mapping[str, AxisModel], inertia: Array) -> Mapping[str, float]:
        """Rms position error of each axis; empty where the model cannot be simulated."""
        try:
            machine = Machine(
                axes,
                self.position[0],
                np.max(np.abs(self.velocity), axis=(0, 2)),
                self.step_s,
                delay_s=0.0,
                velocity=self.velocity[0],
            )
        except ModelError:
            return {}
        steps = len(self.position) - 1
        if steps * math.ceil(self.step_s / machine.longest_step_s) > _MOST_STEPS:
            return {}
        with np.errstate(all="ignore"):  # a simulation that runs away shows in its error
            error = self._simulated(machine, self._efforts(axes), inertia)[steps // 2 :]
            rms = np.sqrt(np.mean(error**2, axis=(0, 2)))
        stays = rms < np.ptp(self.position, axis=(0, 2))
        return {name: float(rms[i]) for i, name in enumerate(axes) if stays[i]}

    def _simulated(self, machine: Machine, efforts: Array, inertia: Array) -> Array:
        """Simulate under efforts (K, A, D) and the feedback; position errors (K, A, D)."""
        stiffness, damping = inertia * self.poles**2, 2.0 * inertia * self.poles
        machine.set_time(np.concatenate([instants[0] for instants in self.instants_s]))
        errors = np.empty_like(efforts)
        for k, effort in enumerate(efforts):
            behind = self.position[k] - machine.reading
            command = effort + stiffness * behind + damping * (self.velocity[k] - machine.velocity)
            machine.advance(command, command)
            errors[k] = machine.reading - self.position[k + 1]
        return errors

    def _efforts(self, axes: Mapping[str, AxisModel]) -> Array:
        """Mean commanded efforts (K, A, D) over the steps."""
        segments = []
        for recording, instants in zip(self.recordings, self.instants_s, strict=True):
            period_s = recording.time_s[1] - recording.time_s[0]
            first_s = recording.effort_shift_s - 0.5 * period_s
            edges_s = first_s + period_s * np.arange(len(recording.time_s) + 1)
            held = []
            for name, axis in axes.items():
                effort = _commanded(axis, recording.axes[name].effort, recording.time_s)
                integral = np.concatenate([[0.0], np.cumsum(effort)]) * period_s
                held.append(np.diff(np.interp(instants, edges_s, integral), axis=0) / self.step_s)
            segments.append(np.stack(held, axis=1))
        return np.concatenate(segments, axis=2)


def _course(
    recordings: Sequence[Recording], names: tuple[str, ...], bandwidth_hz: Array
) -> _Course:
    """Cut the recordings into segments of two lead-ins, each a lead-in after the last."""
    even = tuple(_even(recording, names) for recording in recordings)
    poles = 2.0 * np.pi * _POLE_SHARE * bandwidth_hz
    shortest_s = min(float(recording.time_s[-1]) for recording in even)
    lead_in_s = min(_LEAD_IN / float(np.min(poles)), 0.5 * shortest_s)
    lead_in = math.ceil(lead_in_s * _STEPS_PER_PERIOD * float(np.max(bandwidth_hz)))
    step_s = lead_in_s / lead_in
    instants_s, motions = [], []
    for recording in even:
        last_s = float(recording.time_s[-1]) - 2.0 * lead_in_s
        starts = np.linspace(0.0, last_s, math.ceil(last_s / lead_in_s) + 1)
        instants_s.append(starts + step_s * np.arange(2 * lead_in + 1)[:, None])
        motions.append(_motion(recording, instants_s[-1], bandwidth_hz))
    position, velocity = np.concatenate(motions, axis=-1)
    return _Course(even, tuple(instants_s), position, velocity, poles, step_s)


def _even(recording: Recording, names: tuple[str, ...]) -> Recording:
    """The recording on an even grid from time zero, with the axes of these names."""
    grid = EvenGrid.of(recording.time_s)
    axes = {name: grid.axis(recording.axes[name]) for name in names}
    return replace(recording, time_s=grid.time_s - grid.time_s[0], axes=axes)


def _motion(recording: Recording, instants_s: Array, bandwidth_hz: Array) -> Array:
    """Smooth position and velocity (2, K + 1, A, d) at the instants (K + 1, d)."""
    period_s = float(recording.time_s[1])
    columns = []
    for axis, (cutoff_hz,) in zip(recording.axes.values(), bandwidth_hz, strict=True):
        motion = differentiate(axis.position, float(cutoff_hz), period_s, orders=(0, 1))
        columns.append([np.interp(instants_s, recording.time_s, signal) for signal in motion])
    return np.moveaxis(np.array(columns), 0, 2)


def _commanded(axis: AxisModel, effort: Array, time_s: Array) -> Array:
    """The effort column (N,) before the axis's effects on the record, such as its delay.

    Fixed-point steps undo what recording does to a command. Each subtracts the error of the
    recorded last estimate. They converge for delays short against the effort's periods.
    """
    command = effort
    for _ in range(_CORRECTIONS):
        recorded = command
        for term in axis.terms:
            recorded = named(term.effect).recorded(recorded, time_s, along_motion(term))
        command = command + (effort - recorded.reshape(effort.shape))
    return command

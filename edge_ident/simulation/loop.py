"""Closed loop of sampled control and a continuous machine."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final, Protocol

import numpy as np

from edge_ident.drive import description, motions
from edge_ident.errors import DataError
from edge_ident.signals import conditioning, filters, time_stamps
from edge_ident.signals.recording import Array, Recording
from firmware_interface.control_law import NOTHING, deadband_nm, feedforward_nm
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Reference, Trajectory, reference

# The references that simulated drives follow: a named motion, or that of a recording.

_LEAD_IN_S: Final = 2.0  # time in which an axis gets from rest into the motion of a recording


@dataclass(frozen=True)
class References:
    """Where all axes should be, sample by sample; time zero is the first recorded sample.

    Attributes
    ----------
    time_s : (N,) array
        Even; negative in the lead-in, which begins at rest.
    position, velocity, acceleration : (A, N) arrays
    """

    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array

    @property
    def period_s(self) -> float:
        """Sampling period."""
        return float(self.time_s[-1] - self.time_s[0]) / (len(self.time_s) - 1)

    @property
    def recorded(self) -> Array:
        """Positions (A, M) from time zero on."""
        return self.position[:, self.time_s > -0.5 * self.period_s]

    @property
    def samples(self) -> Array:
        """Position, velocity and acceleration of all axes, sample by sample, (N, 3, A)."""
        return np.stack([self.position.T, self.velocity.T, self.acceleration.T], axis=1)

    def motion(self, axis: int) -> Array:
        """Position, velocity and acceleration of one axis, (3, N)."""
        return np.stack([self.position[axis], self.velocity[axis], self.acceleration[axis]])


def named_references(
    axes: Mapping[str, str], name: motions.MotionName, cycles: int | None = None
) -> References:
    """A motion of the built-in drive for any axes.

    The axes are a quarter period apart, as the paper's are. An axis in m moves by the
    built-in screw's lead.

    Parameters
    ----------
    axes : mapping of axis name to position unit, "rad" or "m"
    name : {"sinusoid", "multisine", "staircase"}
    cycles : int, optional
        Periods of a sinusoid or multisine.
    """
    drive = description.load_drive()
    model = next(iter(drive.axes.values()))
    drive = replace(
        drive,
        axes={axis: replace(model, phase_rad=0.5 * math.pi * i) for i, axis in enumerate(axes)},
    )
    return designed_references(axes, motions.named_trajectory(drive, name, cycles))


def designed_references(axes: Mapping[str, str], trajectory: Trajectory) -> References:
    """A motion in angles for the axes of a model; an axis in m moves by the built-in screw's lead.

    Parameters
    ----------
    axes : mapping of axis name to position unit, "rad" or "m"
    trajectory : Trajectory

    Raises
    ------
    DataError
        The motion lacks an axis.
    """
    missing = [name for name in axes if name not in trajectory.axes]
    if missing:
        raise DataError(
            f"the motion has axes {', '.join(trajectory.axes)}, the model has {', '.join(axes)}",
            "give a motion, or a model, of the same axes",
        )
    drive = description.load_drive()
    model = next(iter(drive.axes.values()))
    period_s = drive.sampling_period_s
    first, last = (round(t / period_s) for t in (-trajectory.lead_in_s, trajectory.duration_s))
    time_s = period_s * np.arange(first, last, dtype=np.float64)
    angles = [reference(trajectory.axes[a], time_s, trajectory.lead_in_s, 0.0) for a in axes]
    scale = np.array(
        [1.0 if unit == "rad" else model.screw_lead_m_per_rad for unit in axes.values()]
    )
    position, velocity, acceleration = (
        scale[:, None] * np.stack([getattr(angle, of) for angle in angles])
        for of in ("position_rad", "velocity_rad_s", "acceleration_rad_s2")
    )
    return References(time_s, position, velocity, acceleration)


def recorded_references(recording: Recording, axes: Mapping[str, str]) -> References:
    """The motion of a recording: its reference column, else its position, filtered alike.

    The lead-in leads smoothly from rest to the position, velocity and acceleration in which the
    recording begins.

    Parameters
    ----------
    recording : Recording
    axes : mapping of axis name to position unit
        Those wanted.

    Raises
    ------
    DataError
        The recording lacks an axis, or has it in another unit.
    """
    grid = time_stamps.EvenGrid.of(recording.time_s - recording.time_s[0])
    period_s = grid.period_s
    lead_in = period_s * np.arange(-round(_LEAD_IN_S / period_s), 0, dtype=np.float64)
    rows = []
    for name, unit in axes.items():
        axis = recording.axes.get(name)
        if axis is None or axis.position_unit != unit:
            found = ", ".join(f"{n} ({a.position_unit})" for n, a in recording.axes.items())
            raise DataError(
                f"{recording.source}: it has axes {found}, the model has axis {name} ({unit})",
                "give a recording of the modelled drive, or rename columns, such as "
                f"--column {next(iter(recording.axes))}_position_{unit}={name}_position_{unit}",
            )
        wanted = axis.position if axis.reference is None else axis.reference
        cutoff_hz = conditioning.choose_cutoff(grid.resampled(axis.position), period_s)
        motion = np.stack(filters.differentiate(grid.resampled(wanted), cutoff_hz, period_s))
        rows.append(np.hstack([_from_rest(lead_in, motion[:, 0]), motion]))
    position, velocity, acceleration = np.stack(rows, axis=1)
    return References(np.concatenate([lead_in, grid.time_s]), position, velocity, acceleration)


def _from_rest(time_s: Array, end: Array) -> Array:
    """Position, velocity and acceleration (3, N) that lead from rest to their values at zero.

    The velocity is a cubic in time; the axis sets out where it must to arrive in place.
    """
    duration = -float(time_s[0])
    _, velocity, acceleration = end
    # share s of the lead-in: v = velocity·(3s² - 2s³) + acceleration·duration·(s³ - s²)
    v = np.polynomial.Polynomial([0, 0, 3 * velocity - acceleration * duration,
                                  acceleration * duration - 2 * velocity])  # fmt: skip
    share = 1.0 + time_s / duration
    travel = duration * v.integ()
    return np.stack([end[0] + travel(share) - travel(1.0), v(share), v.deriv()(share) / duration])


_PROGRESS_SAMPLES: Final = 200


class Plant(Protocol):
    """What is controlled: A axes of D drives."""

    @property
    def position(self) -> Array:
        """True positions (A, D)."""

    @property
    def velocity(self) -> Array:
        """True velocities (A, D)."""

    @property
    def reading(self) -> Array:
        """What the encoders read (A, D), before they count."""

    def set_time(self, time_s: float) -> None:
        """Set the clock."""

    def advance(self, before: Array, command: Array) -> None:
        """Let a sample pass: first under the command (A, D) before, then under the new one."""

    def recorded(self, command: Array, time_s: Array) -> Array:
        """Effort columns (A, D, N) of the commands."""


@dataclass(frozen=True)
class Sampling:
    """What lies between machine and record.

    Attributes
    ----------
    encoder_resolution : (A,) array
        Position of one count, 0 for an exact encoder.
    effort_resolution : (A,) array
        Effort of one count, 0 for an exact one.
    noise : float
        White noise of the effort column over its rms value.
    """

    encoder_resolution: Array
    effort_resolution: Array
    noise: float = 0.0


@dataclass(frozen=True)
class Simulation:
    """What was recorded, and what truly happened; time zero is the first sample.

    Attributes
    ----------
    time_s : (N,) array
    position, effort : (A, D, N) arrays
        Columns as a board records them. The effort is the command, which acts from the control
        delay after its sample to that after the next, and its noise.
    true_position, true_velocity : (A, D, N) arrays
    """

    time_s: Array
    position: Array
    effort: Array
    true_position: Array
    true_velocity: Array


def closed_loop(
    plant: Plant,
    references: References,
    gains: Mapping[str, Sequence[AxisGains]],
    sampling: Sampling,
    *,
    seed: int = 0,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Simulation:
    """Let drives follow a motion.

    Parameters
    ----------
    plant : Plant
        Standing where the references begin.
    references : References
    gains : mapping of axis name to sequence of AxisGains
        One for all drives, or one for each.
    sampling : Sampling
    seed : int
        Of the noise.
    on_progress : callable
        Called with samples done and samples in all.
    """
    columns = _followed(plant, references, gains, sampling, on_progress)
    recorded = references.time_s > -0.5 * references.period_s
    effort = plant.recorded(columns[3], references.time_s)[..., recorded]
    with np.errstate(over="ignore"):  # the caller says so where a drive runs away
        rms = np.sqrt(np.mean(effort**2, axis=-1, keepdims=True))
    noise = np.random.default_rng(seed).normal(size=effort.shape)
    read, position, velocity = columns[:3, ..., recorded]
    return Simulation(
        time_s=references.time_s[recorded],
        position=read,
        effort=effort + sampling.noise * rms * noise,
        true_position=position,
        true_velocity=velocity,
    )


def _followed(
    plant: Plant,
    references: References,
    gains: Mapping[str, Sequence[AxisGains]],
    sampling: Sampling,
    on_progress: Callable[[int, int], None],
) -> Array:
    """What is read, true positions and velocities, and commands: (4, A, D, N)."""
    period_s, total = references.period_s, len(references.time_s)
    encoder, converter = (
        Counting(r[:, None]) for r in (sampling.encoder_resolution, sampling.effort_resolution)
    )
    controllers = Controllers(gains, period_s, encoder.counted(plant.reading))
    samples = np.empty((total, 4, *plant.position.shape))
    command = np.zeros(plant.position.shape)
    plant.set_time(float(references.time_s[0]))
    for k, followed in enumerate(references.samples):
        read = encoder.counted(plant.reading)
        before, wanted = command, controllers.effort(followed, read)
        command = converter.counted(wanted)
        samples[k] = read, plant.position, plant.velocity, command
        plant.advance(before, command)
        if k % _PROGRESS_SAMPLES == 0:
            on_progress(k, total)
    on_progress(total, total)
    return np.ascontiguousarray(np.moveaxis(samples, 0, -1))


class Counting:
    """Rounding to whole counts.

    Parameters
    ----------
    resolution : array
        One count; a resolution of zero leaves a value as it is.
    """

    def __init__(self, resolution: Array) -> None:
        self._counts = resolution > 0.0
        self._all, self._none = bool(self._counts.all()), not self._counts.any()
        self._step = np.where(self._counts, resolution, 1.0)

    def counted(self, values: Array) -> Array:
        """Round values that broadcast with the resolution."""
        if self._none:
            return values
        rounded = np.rint(values / self._step) * self._step
        return np.asarray(rounded if self._all else np.where(self._counts, rounded, values))


# The control law of the board (`firmware_interface.control_law`), many drives at once.

_COUPLED: Final = 2  # axes among which each has one other


class Controllers:
    """What the laws remember: last position and reference, filtered velocity, and states.

    Parameters
    ----------
    gains : mapping of axis name to sequence of AxisGains
        One for all drives, or one for each.
    period_s : float
    position : (A, D) array
        Where the axes stand.
    """

    def __init__(
        self, gains: Mapping[str, Sequence[AxisGains]], period_s: float, position: Array
    ) -> None:
        stacked: dict[str, Any] = {
            field.name: _stacked(field.name, gains.values(), position.shape[1])
            for field in fields(AxisGains)
        }
        self._gains = AxisGains(**stacked)
        self._period_s = period_s
        self._last = position.copy()
        self._velocity = np.zeros(position.shape)
        self._integral = np.zeros(position.shape)
        self._memory = NOTHING
        self._reference: Array | None = None

    def effort(self, reference: Array, position: Array) -> Array:
        """Efforts (A, D) for the positions just read.

        Parameters
        ----------
        reference : (3, A) array
            Position, velocity and acceleration wanted now.
        position : (A, D) array
        """
        gains, period_s = self._gains, self._period_s
        setpoint, other = Reference(*reference[:, :, None]), None
        if "cross" in gains.terms and len(position) == _COUPLED:
            other = Reference(*reference[:, ::-1, None])
        difference = (position - self._last) / period_s
        self._last = position.copy()
        share = period_s / (gains.velocity_filter_s + period_s)
        self._velocity += share * (difference - self._velocity)
        error = self._followed(setpoint.position_rad) - position
        self._integral += gains.integral * error * period_s
        feedback = (
            gains.proportional * error
            + gains.derivative * (setpoint.velocity_rad_s - self._velocity)
            + self._integral
        )
        effort = feedforward_nm(gains, setpoint, np, other, self._memory, feedback)
        return np.asarray(deadband_nm(gains, effort, np))

    def _followed(self, reference: Array) -> Array:
        """The reference with the way across the backlash."""
        if not self._gains.terms & {"presliding", "backlash"}:
            return reference
        before = reference if self._reference is None else self._reference
        self._memory = self._memory.after(self._gains, reference - before, np)
        self._reference = reference
        return np.asarray(reference + self._memory.backlash_rad)


def _stacked(name: str, gains: Iterable[Sequence[AxisGains]], drives: int) -> Array:
    """One number of the law (A, D), or one table (K, A, D)."""
    rows = [np.array([getattr(g, name) for g in of_axis]).T for of_axis in gains]
    return np.stack([np.broadcast_to(r, (*r.shape[:-1], drives)) for r in rows], axis=-2)

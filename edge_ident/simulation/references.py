"""The references that simulated drives follow: a named motion, or that of a recording."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.drive.description import load_drive
from edge_ident.drive.motions import MotionName, named_trajectory
from edge_ident.errors import DataError
from edge_ident.signals.conditioning import choose_cutoff
from edge_ident.signals.filters import differentiate
from edge_ident.signals.recording import Recording
from edge_ident.signals.resampling import EvenGrid
from firmware_interface.motion import Trajectory, reference

Array = NDArray[np.float64]

_LEAD_IN_S: Final = 2.0
"""Time in which an axis gets from rest into the motion of a recording."""


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
    axes: Mapping[str, str], name: MotionName, cycles: int | None = None
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
    drive = load_drive()
    model = next(iter(drive.axes.values()))
    drive = replace(
        drive,
        axes={axis: replace(model, phase_rad=0.5 * math.pi * i) for i, axis in enumerate(axes)},
    )
    return designed_references(axes, named_trajectory(drive, name, cycles))


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
    drive = load_drive()
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
    grid = EvenGrid.of(recording.time_s - recording.time_s[0])
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
        cutoff_hz = choose_cutoff(grid.resampled(axis.position), period_s)
        motion = np.stack(differentiate(grid.resampled(wanted), cutoff_hz, period_s))
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

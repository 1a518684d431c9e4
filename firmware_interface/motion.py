"""Reference motions: what the board is told to follow, and where that is at any time.

Time zero is the first captured sample. Before it, over the lead-in, a quintic envelope blends
from the rest position into the motion, so that capture starts in full swing. After the last
captured sample, and at a quick stop, the reference decelerates to rest.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

MAXIMUM_COMPONENTS: Final = 8
MAXIMUM_LEVELS: Final = 12
STOP_TIME_S: Final = 0.25
"""Shortest time from full speed to rest."""
STOP_ACCELERATION_RAD_S2: Final = 12.0
"""Largest deceleration at a stop; a stop from high speed takes longer for it."""


@dataclass(frozen=True)
class SineComponent:
    """amplitude * sin(angular_frequency * t + phase)."""

    amplitude_rad: float
    angular_frequency_rad_s: float
    phase_rad: float


@dataclass(frozen=True)
class Multisine:
    """Sum of at most eight sines in position; one is the paper's sinusoid."""

    components: tuple[SineComponent, ...]


@dataclass(frozen=True)
class Staircase:
    """Constant speeds one after the other, starting at the rest position, then standstill.

    Attributes
    ----------
    speeds_rad_s : tuple of float
        At most twelve levels, signed.
    dwell_s : float
        Time at each level.
    acceleration_rad_s2 : float
        Acceleration between levels.
    """

    speeds_rad_s: tuple[float, ...]
    dwell_s: float
    acceleration_rad_s2: float


@dataclass(frozen=True)
class Trajectory:
    """Motion of all axes.

    Attributes
    ----------
    axes : mapping
        Motion by axis name, all of one kind.
    duration_s : float
        Captured time.
    lead_in_s : float
        Time between start and capture.

    Examples
    --------
    >>> import edge_ident
    >>> trajectory = edge_ident.load_drive().trajectory(cycles=2)
    >>> round(trajectory.duration_s, 1), trajectory.lead_in_s
    (43.7, 5.0)
    """

    axes: Mapping[str, Multisine] | Mapping[str, Staircase]
    duration_s: float
    lead_in_s: float = 5.0


@dataclass(frozen=True)
class Reference:
    """Where an axis should be: position (rad), velocity (rad/s), acceleration (rad/s^2)."""

    position_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array


def reference(
    motion: Multisine | Staircase, times_s: ArrayLike, lead_in_s: float, rest_rad: float
) -> Reference:
    """Reference of one axis.

    Parameters
    ----------
    motion : Multisine or Staircase
    times_s : (N,) array_like
        Time since the first captured sample; negative in the lead-in, not before it.
    lead_in_s : float
    rest_rad : float
        Position in which the axis stood before.
    """
    times = np.asarray(times_s, dtype=np.float64)
    if isinstance(motion, Multisine):
        full = _multisine(motion, times)
    else:
        full = _staircase(motion, times, rest_rad)
    share = np.clip(1.0 + times / lead_in_s, 0.0, 1.0)
    blend = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    blend_rate = 30.0 * (share * (1.0 - share)) ** 2 / lead_in_s
    blend_curvature = 60.0 * share * (1.0 - share) * (1.0 - 2.0 * share) / lead_in_s**2
    distance = full.position_rad - rest_rad
    return Reference(
        rest_rad + blend * distance,
        blend * full.velocity_rad_s + blend_rate * distance,
        blend * full.acceleration_rad_s2
        + 2.0 * blend_rate * full.velocity_rad_s
        + blend_curvature * distance,
    )


def stop_duration_s(speed_rad_s: float) -> float:
    """Time in which a stop brings the reference to rest."""
    return max(STOP_TIME_S, 1.5 * abs(speed_rad_s) / STOP_ACCELERATION_RAD_S2)


def stop_acceleration_rad_s2(
    velocity_rad_s: float, acceleration_rad_s2: float, duration_s: float
) -> float:
    """As much of an acceleration as a stop can begin with: it brakes, and does not turn round."""
    if velocity_rad_s * acceleration_rad_s2 >= 0.0:
        return 0.0
    most = 3.0 * abs(velocity_rad_s) / duration_s
    return math.copysign(min(abs(acceleration_rad_s2), most), acceleration_rad_s2)


def stopping_reference(
    position_rad: float,
    velocity_rad_s: float,
    times_s: ArrayLike,
    duration_s: float,
    acceleration_rad_s2: float = 0.0,
) -> Reference:
    """Reference of a stop: the velocity falls along a cubic with a level end.

    Parameters
    ----------
    position_rad, velocity_rad_s, acceleration_rad_s2 : float
        Reference at the beginning of the stop.
    times_s : (N,) array_like
        Time since then.
    duration_s : float
        From `stop_duration_s`, the longest of all axes.
    """
    share = np.clip(np.asarray(times_s, dtype=np.float64) / duration_s, 0.0, 1.0)
    gain_rad_s = acceleration_rad_s2 * duration_s
    way = velocity_rad_s * (share - share**3 + 0.5 * share**4)
    way = way + gain_rad_s * share**2 * (0.5 - share / 1.5 + 0.25 * share**2)
    return Reference(
        position_rad + duration_s * way,
        velocity_rad_s * (1.0 - 3.0 * share**2 + 2.0 * share**3)
        + gain_rad_s * share * (1.0 - share) ** 2,
        velocity_rad_s / duration_s * 6.0 * share * (share - 1.0)
        + acceleration_rad_s2 * (1.0 - share) * (1.0 - 3.0 * share),
    )


def _multisine(motion: Multisine, times: Array) -> Reference:
    position, velocity, acceleration = (np.zeros_like(times) for _ in range(3))
    for component in motion.components:
        rate = component.angular_frequency_rad_s
        angle = rate * times + component.phase_rad
        sine, cosine = (
            component.amplitude_rad * np.sin(angle),
            component.amplitude_rad * np.cos(angle),
        )
        position += sine
        velocity += rate * cosine
        acceleration -= rate**2 * sine
    return Reference(position, velocity, acceleration)


def _staircase(motion: Staircase, times: Array, rest_rad: float) -> Reference:
    """Integrate piecewise constant accelerations; before time zero the first speed holds."""
    speeds = np.array([*motion.speeds_rad_s, 0.0])
    ramps = np.abs(np.diff(speeds)) / motion.acceleration_rad_s2
    durations = np.ravel(np.column_stack([np.full(len(ramps), motion.dwell_s), ramps]))
    starts = np.concatenate([[0.0], np.cumsum(durations)])
    velocities = np.append(np.repeat(speeds[:-1], 2), 0.0)
    accelerations = np.zeros(len(starts))
    accelerations[1:-1:2] = np.sign(np.diff(speeds)) * motion.acceleration_rad_s2
    steps = (velocities[:-1] + 0.5 * accelerations[:-1] * durations) * durations
    positions = rest_rad + np.concatenate([[0.0], np.cumsum(steps)])
    segment = np.maximum(np.searchsorted(starts, times, side="right") - 1, 0)
    since = times - starts[segment]
    return Reference(
        positions[segment] + velocities[segment] * since + 0.5 * accelerations[segment] * since**2,
        velocities[segment] + accelerations[segment] * since,
        accelerations[segment],
    )

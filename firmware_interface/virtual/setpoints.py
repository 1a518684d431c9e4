"""Where the axes should be: holding, following the trajectory, or coming to rest."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, replace
from itertools import pairwise
from typing import Final

import numpy as np

from firmware_interface import board_types, codec, control_law, registers
from firmware_interface.gains import AxisGains, Bank
from firmware_interface.motion import (
    Array,
    Multisine,
    Reference,
    Staircase,
    Trajectory,
    reference,
    stop_duration_s,
    stopping_reference,
)
from firmware_interface.virtual.controller import Setpoint, Transfer
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S, Drive

_CHUNK: Final = 2048


class SetpointGenerator:
    """Gives the setpoints of all axes, sample by sample.

    Attributes
    ----------
    current : sequence of Setpoint
        The last ones given, by axis; always numbers.
    moving : bool
        The reference is not constant.
    finite : bool
        None was asked for that is no number; such a one holds the axes instead.
    """

    def __init__(self, positions_rad: Sequence[float]) -> None:
        self.hold(positions_rad)

    def hold(self, positions_rad: Sequence[float]) -> None:
        """Stay at these positions."""
        self.finite = True
        self.current: Sequence[Setpoint] = [Setpoint(p, 0.0, 0.0) for p in positions_rad]
        self._ahead: Iterator[Sequence[Setpoint]] = iter(())
        self.moving = False

    def follow(self, trajectory: Trajectory) -> None:
        """Start a trajectory from the present position, then come to rest."""
        rest = [setpoint.position_rad for setpoint in self.current]
        self._ahead = (row for stretch in _stretches(trajectory, rest) for row in _rows(stretch))
        self.moving = True

    def stop(self) -> None:
        """Decelerate to rest from the present reference."""
        self._ahead = _rows(_stop([s._replace(acceleration_rad_s2=0.0) for s in self.current]))

    def take_up(self, setpoints: Sequence[Setpoint], *, moving: bool) -> None:
        """Be here now, and come to rest from there or, unless moving, stay."""
        if not moving:
            self.hold([setpoint.position_rad for setpoint in setpoints])
            return
        self.current, self.moving = setpoints, True
        self._ahead = _rows(_stop(setpoints))

    def advance(self) -> Sequence[Setpoint]:
        """The setpoints of the next sample."""
        if self.moving:
            following = next(self._ahead, None)
            finite = following is None or all(setpoint.finite for setpoint in following)
            if following is None or not finite:
                self.hold([setpoint.position_rad for setpoint in self.current])
                self.finite = finite
            else:
                self.current = following
        return self.current


def rest_from(setpoints: Sequence[Setpoint]) -> list[float]:
    """Where a stop from these setpoints ends, by axis."""
    return [float(axis.position_rad[-1]) for axis in _stop(setpoints)]


def _stop(setpoints: Sequence[Setpoint]) -> list[Reference]:
    """The stop of all axes, from the sample that follows."""
    duration = max(stop_duration_s(setpoint.velocity_rad_s) for setpoint in setpoints)
    times = np.arange(1, round(duration / SAMPLE_PERIOD_S) + 1) * SAMPLE_PERIOD_S
    return [
        stopping_reference(
            s.position_rad, s.velocity_rad_s, times, float(times[-1]), s.acceleration_rad_s2
        )
        for s in setpoints
    ]


def _stretches(trajectory: Trajectory, rest_rad: Sequence[float]) -> Iterator[list[Reference]]:
    """The references of all axes, a stretch of time after the other."""
    first = -round(trajectory.lead_in_s / SAMPLE_PERIOD_S)
    last = round(trajectory.duration_s / SAMPLE_PERIOD_S)
    for start in range(first, last, _CHUNK):
        yield chunk(trajectory, rest_rad, start, min(_CHUNK, last - start))


def _rows(axes: Sequence[Reference]) -> Iterator[Sequence[Setpoint]]:
    """Sample by sample, from the references of all axes."""
    columns = [
        map(
            Setpoint,
            axis.position_rad.tolist(),
            axis.velocity_rad_s.tolist(),
            axis.acceleration_rad_s2.tolist(),
        )
        for axis in axes
    ]
    return iter(zip(*columns, strict=True))


# What ARM makes sure of before a trajectory may move anything.
#
# Every comparison is made so that a value which is not a number fails it.

TRAJECTORY_ADDRESS: Final = registers.REGISTERS["trajectory.kind"].address
_LAST: Final = registers.REGISTERS[f"trajectory.{registers.AXES[-1]}.acceleration"]
TRAJECTORY_WORDS: Final = _LAST.address + _LAST.words - TRAJECTORY_ADDRESS
"""All of the trajectory's registers; ARM's argument is their CRC."""
SAMPLES_AT_ONCE: Final = 1024
JUMP_MARGIN: Final = 0.01
"""Share by which two setpoints may be further apart than the speed limit allows: rounding."""
_FASTEST_RAD_S: Final = math.pi / SAMPLE_PERIOD_S


def read_trajectory(words: Sequence[int]) -> Trajectory | None:
    """A copy of what the registers hold; None where it is incomplete or cannot be followed."""
    try:
        trajectory = codec.decode_trajectory(words, TRAJECTORY_ADDRESS, SAMPLE_PERIOD_S)
    except ValueError:
        return None
    sound = (
        trajectory.lead_in_s > 0.0
        and trajectory.duration_s > 0.0
        and all(_sound(motion) for motion in trajectory.axes.values())
    )
    return replace(trajectory, axes=_reduced(trajectory.axes)) if sound else None


def _sound(motion: Multisine | Staircase) -> bool:
    """Whether an axis has a motion, of finite numbers, that its samples can show."""
    if isinstance(motion, Multisine):
        return bool(motion.components) and all(
            all(map(math.isfinite, astuple(sine)))
            and abs(sine.angular_frequency_rad_s) < _FASTEST_RAD_S
            for sine in motion.components
        )
    values = [*motion.speeds_rad_s, motion.dwell_s, motion.acceleration_rad_s2]
    return (
        bool(motion.speeds_rad_s)
        and all(map(math.isfinite, values))
        and motion.dwell_s >= 0.0
        and motion.acceleration_rad_s2 > 0.0
    )


def _reduced(
    axes: Mapping[str, Multisine] | Mapping[str, Staircase],
) -> Mapping[str, Multisine] | Mapping[str, Staircase]:
    """Phases within one turn: time would drown in the digits of a huge one."""
    return {
        name: Multisine(
            tuple(
                replace(sine, phase_rad=math.remainder(sine.phase_rad, math.tau))
                for sine in motion.components
            )
        )
        if isinstance(motion, Multisine)
        else motion
        for name, motion in axes.items()
    }  # type: ignore[return-value]


def chunk(
    trajectory: Trajectory, rest_rad: Sequence[float], start: int, count: int
) -> list[Reference]:
    """References of all axes over samples counted from the first captured one.

    Parameters
    ----------
    trajectory : Trajectory
    rest_rad : sequence of float
        Where the axes stood before, by axis.
    start, count : int
    """
    times = np.arange(start, start + count) * SAMPLE_PERIOD_S
    return [
        reference(trajectory.axes[name], times, trajectory.lead_in_s, rest)
        for name, rest in zip(trajectory.axes, rest_rad, strict=True)
    ]


class TrajectoryCheck:
    """Walks through a trajectory, a bounded stretch at a time.

    Parameters
    ----------
    trajectory : Trajectory
    rest_rad : sequence of float
        Where it starts, by axis.
    limits, gains : mapping
        By axis; the gains in force give the feed-forward effort.
    memories : sequence of Memory
        What the laws remember there, by axis.

    Attributes
    ----------
    trajectory : Trajectory
    remaining : int
        Samples still to check.
    passed : bool
        None of those checked was outside the limits.
    """

    def __init__(
        self,
        trajectory: Trajectory,
        rest_rad: Sequence[float],
        limits: Mapping[str, board_types.AxisLimits],
        gains: Mapping[str, AxisGains],
        memories: Sequence[control_law.Memory],
    ) -> None:
        self.trajectory = trajectory
        self._rest_rad = rest_rad
        self._last_rad = list(rest_rad)
        self._limits = [limits[axis] for axis in trajectory.axes]
        self._gains = [gains[axis] for axis in trajectory.axes]
        self._memories = list(memories)
        self._next = -round(trajectory.lead_in_s / SAMPLE_PERIOD_S)
        self._end = round(trajectory.duration_s / SAMPLE_PERIOD_S)
        self.passed = all(
            _ramps_within(trajectory.axes[name], limit)
            for name, limit in zip(trajectory.axes, self._limits, strict=True)
        )

    @property
    def remaining(self) -> int:
        """Samples still to check; none once one has failed."""
        return self._end - self._next if self.passed else 0

    def go_on(self) -> None:
        """Check the next stretch."""
        count = min(SAMPLES_AT_ONCE, self.remaining)
        if not count:
            return
        with np.errstate(all="ignore"):
            axes = chunk(self.trajectory, self._rest_rad, self._next, count)
            fastest = np.max([np.abs(axis.velocity_rad_s) for axis in axes], axis=0)
            stop_s = np.array([stop_duration_s(speed) for speed in fastest.tolist()])
            self.passed = all(
                self._within(n, axis, axis.velocity_rad_s * stop_s / 2.0, other)
                for n, (axis, other) in enumerate(zip(axes, reversed(axes), strict=True))
            )
        self._next += count
        self._last_rad = [float(axis.position_rad[-1]) for axis in axes]

    def _within(self, n: int, axis: Reference, way_rad: Array, other: Reference) -> bool:
        limit = self._limits[n]
        jumps = np.diff(axis.position_rad, prepend=self._last_rad[n])
        largest_jump = limit.speed_rad_s * SAMPLE_PERIOD_S * (1.0 + JUMP_MARGIN)
        effort, self._memories[n] = control_law.exact_effort_nm(
            self._gains[n], axis, other, self._last_rad[n], self._memories[n]
        )
        return (
            _at_most(axis.position_rad, limit.travel_rad)
            and _at_most(axis.position_rad + way_rad, limit.travel_rad)
            and _at_most(axis.velocity_rad_s, limit.speed_rad_s)
            and _at_most(axis.acceleration_rad_s2, limit.acceleration_rad_s2)
            and _at_most(effort, limit.effort_nm)
            and _at_most(jumps, largest_jump)
        )


def _at_most(values: Array, limit: float) -> bool:
    return bool((np.abs(values) <= limit).all())


def _ramps_within(motion: Multisine | Staircase, limit: board_types.AxisLimits) -> bool:
    """A ramp may be too short for any sample to fall on it."""
    return isinstance(motion, Multisine) or (
        motion.acceleration_rad_s2 <= limit.acceleration_rad_s2
        or not any(a != b for a, b in pairwise([*motion.speeds_rad_s, 0.0]))
    )


# Other gains in force: at rest at once, or, while the law acts, in the sample after an offer.

_MOST_SHOWN_NM: Final = 1e6
_SHARE_OF_EFFORT: Final = 0.2  # of the effort limit: what may jump where nothing is said of it


class Handover:
    """One offer of gains at a time, and what became of the last.

    Parameters
    ----------
    limits : sequence of AxisLimits
        By axis.
    map_version : int
        Of the board's register map: older ones have no command for it.

    Attributes
    ----------
    capable : bool
        The board takes gains while the law acts.
    result : Result
        PENDING until a sample has decided.
    offered : Bank or None
        Gains that wait for that.
    jumps_nm : sequence of float
        Of the last offer that was considered, by axis.
    """

    def __init__(self, limits: Sequence[board_types.AxisLimits], map_version: int) -> None:
        self._limits = limits
        known = map_version >= registers.REGISTERS["bumpless.capable"].since
        self.capable = known and all(limit.effort_jump_nm > 0.0 for limit in limits)
        self.result = registers.Result.NONE
        self.offered: Bank | None = None
        self.jumps_nm: Sequence[float] = [0.0] * len(limits)

    def offer(self, gains: Bank) -> None:
        """Have the next sample decide about these gains."""
        self.offered, self.result = gains, registers.Result.PENDING

    def end(self, result: registers.Result) -> None:
        """There is nothing to decide any more."""
        self.offered, self.result = None, result

    def considered(
        self, drive: Drive, gains: Bank, setpoints: Sequence[Setpoint], *, moving: bool
    ) -> Transfer | None:
        """The transfer to these gains, if it may be; else `result` says why not.

        Every comparison is made so that a value which is not a number refuses.
        """
        transfer = drive.considered(gains, setpoints, moving=moving)
        self.jumps_nm = [_shown(jump) for jump in transfer.jumps_nm]
        limits = self._limits
        if not all(
            abs(jump) <= (limit.effort_jump_nm or _SHARE_OF_EFFORT * limit.effort_nm)
            for jump, limit in zip(transfer.jumps_nm, limits, strict=True)
        ):
            self.end(registers.Result.EFFORT_JUMP)
            return None
        ends = zip(transfer.setpoints, rest_from(transfer.setpoints), limits, strict=True)
        if not all(
            abs(begun.velocity_rad_s) <= limit.speed_rad_s
            and max(abs(begun.position_rad), abs(rest)) <= limit.travel_rad
            for begun, rest, limit in ends
        ):
            self.end(registers.Result.TRAJECTORY_LIMITS)
            return None
        self.end(registers.Result.DONE)
        return transfer


def _shown(jump_nm: float) -> float:
    """The jump as a register says it."""
    if math.isnan(jump_nm):
        return _MOST_SHOWN_NM
    return min(max(jump_nm, -_MOST_SHOWN_NM), _MOST_SHOWN_NM)

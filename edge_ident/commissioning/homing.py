"""Moves the axes to a position, slowly: a motion of no frequency, all of it lead-in.

Holding them where they stand is such a motion too, without a way.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.commissioning.capture import (
    Observer,
    UnreachableError,
    capture_motion,
    with_lead_in,
)
from edge_ident.commissioning.safety import make_ready, ready_to_move
from firmware_interface.board import AxisLimits, Board
from firmware_interface.errors import BoardError, ChangedWordError, ValueRefusedError
from firmware_interface.motion import Multisine, SineComponent, Trajectory

_SPEED_SHARE: Final = 0.2  # share of the board's speed limit, where the user names no speed
_PEAK: Final = 1.875  # largest speed of the blend over its mean
_SHORTEST_S: Final = 0.5
_NEAR_COUNTS: Final = 8  # counts by which two readings of an axis at rest may differ
_CAPTURED: Final = 8  # samples at the end of the way, from which the position reached is taken


@dataclass(frozen=True)
class Way:
    """Where one axis was, was to go, and arrived, rad."""

    from_rad: float
    to_rad: float
    reached_rad: float

    @property
    def left_rad(self) -> float:
        """Distance to the target, where the axis stands."""
        return abs(self.to_rad - self.reached_rad)


@dataclass(frozen=True)
class Homing:
    """What the axes did.

    Attributes
    ----------
    ways : mapping of axis name to Way
    time_s : float
        Of the board's time; 0 where all axes stood there already.
    resolution_rad : float
        Of the encoder: a shorter way is none.
    """

    ways: Mapping[str, Way]
    time_s: float
    resolution_rad: float

    @property
    def stuck(self) -> tuple[str, ...]:
        """Axes that went less than half of their way."""
        if not self.time_s:
            return ()
        return tuple(
            axis
            for axis, way in self.ways.items()
            if (far := abs(way.to_rad - way.from_rad)) >= self.resolution_rad
            and way.left_rad > 0.5 * far
        )


def move_to(
    board: Board, targets: Mapping[str, float], observer: Observer, speed_rad_s: float | None = None
) -> Homing:
    """Move axes to positions; the others stay where they stand.

    Parameters
    ----------
    board : Board
    targets : mapping of axis name to float
        rad.
    observer : Observer
    speed_rad_s : float, optional
        Largest on the way; default a fifth of the board's limit.

    Raises
    ------
    ValueRefusedError
        No such axis, a target outside the travel, or a speed that the board does not allow.
    """
    limits = board.limits()
    speeds = {axis: _speed(axis, limits[axis], speed_rad_s) for axis in limits}
    for axis, target_rad in targets.items():
        _check_target(axis, target_rad, limits)
    with ready_to_move(board, observer.say):
        start = _standing(board)
        wanted = {axis: targets.get(axis, start[axis]) for axis in board.axes}
        far = {axis: abs(wanted[axis] - start[axis]) for axis in board.axes}
        count_rad = board.identity.encoder_resolution_rad
        if max(far.values()) < count_rad:
            there = {axis: Way(start[axis], wanted[axis], start[axis]) for axis in far}
            return Homing(there, 0.0, count_rad)
        lead_in_s = max(_SHORTEST_S, *(_PEAK * far[axis] / speeds[axis] for axis in far))
        captured_s = _CAPTURED * board.identity.sample_period_s
        try:
            way = with_lead_in(board, Trajectory(_still(wanted), captured_s, lead_in_s))
        except UnreachableError as error:
            raise BoardError(
                "the way takes longer than the board allows, or too much of its travel",
                "give a higher --speed, or a position within nine tenths of the travel",
            ) from error
        observer.stage("way")
        legs = ", ".join(f"{axis} {start[axis]:.3f} → {wanted[axis]:.3f} rad" for axis in far)
        observer.say(f"{legs}, in {way.lead_in_s:.1f} s")
        capture = capture_motion(board, way, observer.samples)
        board.finish()
    reached = {axis: float(r.position[-1]) for axis, r in capture.recording.axes.items()}
    ways = {axis: Way(start[axis], wanted[axis], reached[axis]) for axis in far}
    return Homing(ways, way.lead_in_s + captured_s, count_rad)


def move_by(
    board: Board,
    distances: Mapping[str, float],
    observer: Observer,
    speed_rad_s: float | None = None,
) -> Homing:
    """Move axes by so much from where they stand; otherwise as `move_to`.

    Parameters
    ----------
    board : Board
    distances : mapping of axis name to float
        rad, signed.
    observer : Observer
    speed_rad_s : float, optional
        Largest on the way; default a fifth of the board's limit.

    Raises
    ------
    ValueRefusedError
        As `move_to`.
    """
    make_ready(board)  # it may still move by what another host began
    stands = _standing(board)
    targets = {axis: stands.get(axis, 0.0) + way for axis, way in distances.items()}
    return move_to(board, targets, observer, speed_rad_s)


@dataclass(frozen=True)
class Held:
    """What happened to one axis while it was held.

    Attributes
    ----------
    pushed_rad : float
        Farthest that it was from where it should have stood, signed.
    effort_nm : float
        Largest effort, signed.
    """

    pushed_rad: float
    effort_nm: float


def hold(board: Board, duration_s: float, observer: Observer) -> dict[str, Held]:
    """Hold all axes where they stand, with effort on, watched like a motion.

    Parameters
    ----------
    board : Board
    duration_s : float
    observer : Observer

    Returns
    -------
    dict of axis name to Held
    """
    with ready_to_move(board, observer.say):
        stands = _standing(board)
        still = Trajectory(_still(stands), duration_s, _SHORTEST_S)
        observer.stage("hold")
        observer.say(f"held for {duration_s:g} s: push the axes by hand")
        records = capture_motion(board, still, observer.samples).recording.axes
        board.finish()
    return {
        axis: Held(_largest(record.position - stands[axis]), _largest(record.effort))
        for axis, record in records.items()
    }


def _standing(board: Board) -> Mapping[str, float]:
    """Where the axes stand, read twice: it has no checksum, and the way goes by it."""
    first, second = board.status().position_rad, board.status().position_rad
    near_rad = _NEAR_COUNTS * board.identity.encoder_resolution_rad
    if any(abs(second[axis] - first[axis]) > near_rad for axis in first):
        raise ChangedWordError("where the axes stand differs from one reading to the next")
    return second


def _still(positions: Mapping[str, float]) -> dict[str, Multisine]:
    """A sine of no frequency at each position."""
    return {
        axis: Multisine((SineComponent(position, 0.0, math.pi / 2.0),))
        for axis, position in positions.items()
    }


def _largest(values: NDArray[np.float64]) -> float:
    return float(values[np.argmax(np.abs(values))])


def _speed(axis: str, limits: AxisLimits, wanted_rad_s: float | None) -> float:
    if wanted_rad_s is None:
        return _SPEED_SHARE * limits.speed_rad_s
    if not 0.0 < wanted_rad_s <= limits.speed_rad_s:
        raise ValueRefusedError(
            f"axis {axis}: a speed of {wanted_rad_s:g} rad/s is refused",
            f"allowed is more than 0 and at most {limits.speed_rad_s:g} rad/s",
        )
    return wanted_rad_s


def _check_target(axis: str, target_rad: float, limits: Mapping[str, AxisLimits]) -> None:
    if axis not in limits:
        raise ValueRefusedError(f"the board has no axis {axis}", f"it has {', '.join(limits)}")
    travel_rad = limits[axis].travel_rad
    if not abs(target_rad) <= travel_rad:
        raise ValueRefusedError(
            f"axis {axis}: {target_rad:g} rad is outside the travel",
            f"allowed are {-travel_rad:g} to {travel_rad:g} rad; degrees are written as in "
            f"{axis}=90deg",
        )

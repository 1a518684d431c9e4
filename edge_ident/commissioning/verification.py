"""The motion that decides whether new gains stay, and how it decides.

One motion is done with the old gains and once more with the new ones. The squared tracking errors
of both are averaged over short segments of the cycle (over all cycles, where there are several)
and compared segment by segment. How well the motion repeats is taken from how the difference
scatters from one segment to the next: what the gains do changes slowly along the cycle, chance
does not. Gains are

- worse, if on any axis the rms error grew by more than the motion repeats;
- better, if it fell by more than that on one axis and grew on none;
- equal otherwise.

"More than the motion repeats" means more than two standard errors of that mean difference, more
than a fiftieth of the error before, and more than a tenth of an encoder count, below which an
encoder shows nothing.

Whether there is anything to gain is asked beforehand by the same yardstick: with feedback within a
tenth of the one in force, and a change of feed-forward that moves the tracking error by less than
the motion repeats, nothing is written at all.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from edge_ident.commissioning.capture import Capture, capture_motion
from edge_ident.commissioning.observer import Observer
from edge_ident.errors import BoardError
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.board import Board
from firmware_interface.control_law import feedforward_nm
from firmware_interface.gains import FEEDBACK, AxisGains, Bank
from firmware_interface.motion import Reference, Trajectory, reference

Array = NDArray[np.float64]
Verdict = Literal["better", "equal", "worse"]

_STOPPING_S: Final = 2.0
"""Allowance for coming to rest and for the commands around a motion."""
_SEGMENTS: Final = 64
_STANDARD_ERRORS: Final = 2.0
_SHARE: Final = 0.02
_COUNTS: Final = 0.1
_SAME_FEEDBACK: Final = 0.1


@dataclass(frozen=True)
class Tracking:
    """Tracking error (rms, rad) of one axis with the old and the new gains.

    Attributes
    ----------
    repeatability_rad : float
        Differences up to this are the motion's own.
    """

    before_rad: float
    after_rad: float
    repeatability_rad: float

    @property
    def verdict(self) -> Verdict:
        """What the new gains did."""
        grown = self.after_rad - self.before_rad
        if abs(grown) <= self.repeatability_rad:
            return "equal"
        return "worse" if grown > 0.0 else "better"

    @property
    def ratio(self) -> float:
        """How many times smaller the error became."""
        return self.before_rad / max(self.after_rad, 1e-12)


@dataclass(frozen=True)
class Verification:
    """Tracking with the old and the new gains, by axis."""

    axes: Mapping[str, Tracking]

    @property
    def verdict(self) -> Verdict:
        """Of the worst axis; better if one is and none is worse."""
        found = {tracking.verdict for tracking in self.axes.values()}
        if "worse" in found:
            return "worse"
        return "better" if "better" in found else "equal"


def compare_motions(before: Recording, after: Recording, count_rad: float) -> Verification:
    """Compare two recordings of one motion; see above for the rule.

    Parameters
    ----------
    before : Recording
        Whole cycles of the motion.
    after : Recording
        One cycle of it.
    count_rad : float
        Of the encoder.
    """
    cycles = max(round(len(before.time_s) / len(after.time_s)), 1)
    found = {}
    for axis, record in before.axes.items():
        old, new = _mean_squares(record, cycles), _mean_squares(after.axes[axis], 1)
        grown = new - old
        error = np.sqrt(np.sum(np.diff(grown) ** 2) / 2.0 / (_SEGMENTS - 1) / _SEGMENTS)
        rms_before, rms_after = np.sqrt(old.mean()), np.sqrt(new.mean())
        chance = _STANDARD_ERRORS * error / max(rms_before + rms_after, 1e-12)
        repeatability = max(chance, _resolved_rad(rms_before, count_rad))
        found[axis] = Tracking(float(rms_before), float(rms_after), float(repeatability))
    return Verification(found)


def nothing_to_gain(
    wanted: Bank, active: Bank, recording: Recording, trajectory: Trajectory, count_rad: float
) -> bool:
    """Whether gains are so like those in force that the motion would not tell them apart.

    Parameters
    ----------
    wanted, active : mapping of axis name to AxisGains
    recording : Recording
        Of the motion with the active gains.
    trajectory : Trajectory
        That was followed.
    """
    for axis, motion in trajectory.axes.items():
        error = _error(recording.axes[axis])
        rest = float(recording.axes[axis].position[0])
        way = reference(motion, recording.time_s, trajectory.lead_in_s, rest)
        change = _predicted_change_rad(wanted[axis], active[axis], error, way)
        same = _like(wanted[axis], active[axis])
        if not (same and change <= _resolved_rad(rms(error), count_rad)):
            return False
    return True


def verification_motion(
    board: Board,
    trajectory: Trajectory,
    observer: Observer,
    file: Path | None = None,
) -> Capture:
    """Move with unconfirmed gains, inside the window to confirm them.

    Raises
    ------
    BoardError
        The motion takes longer than the board waits.
    """
    needed_s = trajectory.lead_in_s + trajectory.duration_s + _STOPPING_S
    window_s = board.status().confirm_remaining_s
    if needed_s > window_s:
        raise BoardError(
            f"the verification motion takes {needed_s:.0f} s, but the board waits {window_s:.0f} s "
            "for the new gains to be confirmed",
            "describe a shorter motion in the drive description",
        )
    capture = capture_motion(board, trajectory, observer.samples, file, observer.say)
    board.finish()
    return capture


def _like(wanted: AxisGains, active: AxisGains) -> bool:
    new, old = wanted.numbers(), active.numbers()
    return all(abs(new[name] - old[name]) <= _SAME_FEEDBACK * abs(old[name]) for name in FEEDBACK)


def _predicted_change_rad(
    wanted: AxisGains, active: AxisGains, error: Array, way: Reference
) -> float:
    """By how much the rms error would change, as far as a slow motion tells.

    What feedback contributes now it must contribute afterwards, less the change of feed-forward.
    """
    change = feedforward_nm(wanted, way, np) - feedforward_nm(active, way, np)
    then = (active.proportional * error - change) / max(wanted.proportional, 1e-12)
    return abs(rms(then) - rms(error))


def _resolved_rad(rms_rad: float, count_rad: float) -> float:
    """Smallest difference that means anything."""
    return max(_SHARE * rms_rad, _COUNTS * count_rad)


def _mean_squares(record: AxisRecord, cycles: int) -> Array:
    """Of the tracking error, by segment of the cycle."""
    parts = np.array_split(_error(record) ** 2, cycles * _SEGMENTS)
    means = np.array([part.mean() for part in parts])
    return np.asarray(means.reshape(cycles, _SEGMENTS).mean(axis=0))


def _error(record: AxisRecord) -> Array:
    assert record.reference is not None
    return record.reference - record.position

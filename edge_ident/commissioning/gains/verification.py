"""The motions that decide whether new gains stay, and how they decide.

Each motion is done with the old gains and once more with the new ones. The squared tracking errors
of both are averaged over short segments of the cycle (over all cycles, where there are several)
and compared segment by segment. How well the motion repeats is taken from how the difference
scatters from one segment to the next: chance changes there, and of what the gains do only a part.
Gains are

- worse, if on any axis the rms error grew by more than the motion repeats;
- too lively, if an axis answers more than noise explains (`liveliness`): such a loop is on its way
  to oscillate, however small its error is;
- in doubt, if it grew by less than that, but by more than means nothing; or if an axis did not
  follow at least twice as closely, and the machine itself changed between the two motions;
- better, if it fell by more than the motion repeats on one axis and grew on none;
- equal otherwise.

"More than means nothing" is more than a fiftieth of the error before, and more than a twentieth of
an encoder count, to which rms errors repeat on machines that nothing but their encoder disturbs.
"More than the motion repeats" is, besides, more than two standard errors of that mean difference.
A doubt counts against the new gains: to take back good ones costs a run. A changed machine is one
that needs another effort for the same motion (`edge_ident.commissioning.gains.verification`).

Whether there is anything to gain is asked beforehand, of a forecast (`promise`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from edge_ident.commissioning.gains.promise import SHARE
from edge_ident.commissioning.motion.capture import Capture, capture_motion
from edge_ident.commissioning.motion.observer import Observer
from edge_ident.commissioning.motion.second_motion import NamedMotion
from edge_ident.errors import BoardError
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.conditioning import Signals, condition
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.board import Board

Array = NDArray[np.float64]
Verdict = Literal["better", "equal", "in doubt", "too lively", "worse"]

_SEGMENTS: Final = 64
_STANDARD_ERRORS: Final = 2.0
_REPEATED_COUNTS: Final = 0.05
"""Encoder counts to which the rms error of a motion repeats: with the same gains, 101 of 102 rms
errors of random drives of the independent plant differ by less."""
_CLEARLY_BETTER: Final = 2.0
"""Ratio of the errors from which a change of the machine is not asked for."""


@dataclass(frozen=True)
class Tracking:
    """Tracking error (rms, rad) of one axis with the old and the new gains.

    Attributes
    ----------
    repeatability_rad : float
        Differences up to this may be the motion's own; at least `resolved_rad`.
    resolved_rad : float
        Smallest difference that means anything.
    machine_changed : float
        Share of the effort by which the machine itself changed between the motions; zero where it
        did not, or was not asked for.
    count_rad : float
        Of the encoder.
    liveliness : float
        What the loop answers above its bandwidth, over the most that is harmless.
    """

    before_rad: float
    after_rad: float
    repeatability_rad: float
    resolved_rad: float
    machine_changed: float = 0.0
    count_rad: float = 0.0
    liveliness: float = 0.0

    @property
    def verdict(self) -> Verdict:
        """What the new gains did."""
        grown = self.after_rad - self.before_rad
        if grown > self.repeatability_rad:
            return "worse"
        if self.liveliness > 1.0:
            return "too lively"
        if grown > self.resolved_rad or self.machine_changed > SHARE:
            return "in doubt"
        return "better" if -grown > self.repeatability_rad else "equal"

    @property
    def limited_by_floor(self) -> bool:
        """Whether the motion repeats better than any difference that means something."""
        return self.repeatability_rad <= self.resolved_rad

    @property
    def ratio(self) -> float:
        """How many times smaller the error became."""
        return self.before_rad / max(self.after_rad, 1e-12)

    @property
    def resolved(self) -> bool:
        """Whether the error is above what rounding to counts makes, so that a ratio means much."""
        return self.after_rad >= self.count_rad

    @property
    def fall(self) -> str:
        """From which error to which; a ratio only where rounding to counts does not make it."""
        return error_fall(self.before_rad, self.after_rad, self.count_rad)


@dataclass(frozen=True)
class Verification:
    """Tracking with the old and the new gains, by axis."""

    axes: Mapping[str, Tracking]

    @property
    def verdict(self) -> Verdict:
        """Verdict of the worst axis; better if one is better and none is worse."""
        found = {tracking.verdict for tracking in self.axes.values()}
        decisive: tuple[Verdict, ...] = ("worse", "too lively", "in doubt", "better")
        return next((verdict for verdict in decisive if verdict in found), "equal")

    @property
    def keeps(self) -> bool:
        """Whether nothing speaks against the new gains."""
        return self.verdict in ("better", "equal")

    def with_liveliness(self, lively: Mapping[str, float]) -> "Verification":
        """The same with the liveliness of every axis."""
        axes = {axis: replace(of, liveliness=lively[axis]) for axis, of in self.axes.items()}
        return Verification(axes)

    @property
    def machine_changed(self) -> Mapping[str, float]:
        """Share by which the machine changed, by axis, where that means anything."""
        shares = {axis: tracking.machine_changed for axis, tracking in self.axes.items()}
        return {axis: share for axis, share in shares.items() if share > SHARE}


Shown = Callable[[str, float], str]
"""A figure as text, from what it is (a field of the JSON document) and its value."""


def plain_figure(name: str, value: float) -> str:
    """A figure of a fall in mrad, or a ratio, as plain text."""
    if name == "ratio":
        return f"{value:.3g}"
    digits = 2 if name == "count_rad" else 3
    return f"{1e3 * value:.{digits}g} mrad"


def error_fall(
    before_rad: float, after_rad: float, count_rad: float, shown: Shown = plain_figure
) -> str:
    """What became of an error, in words.

    Reference and position both lie on the encoder's grid, so what is below one count is mostly
    rounding: of it nobody can say how many times smaller it is.

    Parameters
    ----------
    before_rad, after_rad : float
        Rms.
    count_rad : float
        Of the encoder.
    shown : callable
        Writes a figure.
    """
    begin = f"from {shown('tracking_rms_before_rad', before_rad)}"
    end = f"{begin} to {shown('tracking_rms_after_rad', after_rad)}"
    if before_rad < count_rad:
        return f"{end}, both below one encoder count"
    if after_rad < count_rad:
        return f"{begin} to below one encoder count ({shown('count_rad', count_rad)})"
    smaller = before_rad / max(after_rad, 1e-12)
    clearly = smaller >= _CLEARLY_BETTER
    return f"{end}, {shown('ratio', smaller)} times smaller" if clearly else end


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
        resolved = _resolved_rad(rms_before, count_rad)
        tracking = Tracking(
            float(rms_before), float(rms_after), float(max(chance, resolved)), float(resolved),
            count_rad=count_rad,
        )  # fmt: skip
        if tracking.verdict != "worse" and tracking.ratio < _CLEARLY_BETTER:
            share = changed_share((before.time_s, after.time_s), (record, after.axes[axis]))
            tracking = replace(tracking, machine_changed=share)
        found[axis] = tracking
    return Verification(found)


def verification_motion(
    board: Board,
    motion: NamedMotion,
    observer: Observer,
    file: Path | None = None,
) -> Capture:
    """Move with unconfirmed gains, inside the window to confirm them.

    Raises
    ------
    BoardError
        The motion takes longer than the board waits.
    """
    window_s = board.status().confirm_remaining_s
    if motion.needed_s > window_s:
        raise BoardError(
            f"the verification motion takes {motion.needed_s:.0f} s, but the board waits "
            f"{window_s:.0f} s for the new gains to be confirmed",
            "describe a shorter motion in the drive description",
        )
    capture = capture_motion(board, motion.trajectory, observer.samples, file, observer.say)
    board.finish()
    return capture


def _resolved_rad(rms_rad: float, count_rad: float) -> float:
    """Smallest difference that means anything."""
    return max(SHARE * rms_rad, _REPEATED_COUNTS * count_rad)


def _mean_squares(record: AxisRecord, cycles: int) -> Array:
    """Mean square of the tracking error, by segment of the cycle."""
    parts = np.array_split(_error(record) ** 2, cycles * _SEGMENTS)
    means = np.array([part.mean() for part in parts])
    return np.asarray(means.reshape(cycles, _SEGMENTS).mean(axis=0))


def _error(record: AxisRecord) -> Array:
    assert record.reference is not None
    return record.reference - record.position


# Whether a machine stayed the same from one recording of a motion to the next.
#
# A machine that stays the same needs the same effort for the same motion, whatever the gains are.
# So the base model is fitted to each recording by itself. What its parameters differ by is compared
# with their scatter from one part of the motion to the next (a Wald test with clustered errors).
#
# Source: Cameron and Miller, A practitioner's guide to cluster-robust inference, 2015, section II.

_PARTS: Final = 32
"""Parts of a recording, each long enough for its residual to forget the one before."""
_PARAMETERS: Final = len(PARAMETERS)
_CHANCE: Final = 1e-3
"""Probability of a difference as large on a machine that stayed the same."""
_RANK: Final = 1e-9


def changed_share(time_s: tuple[Array, Array], axis: tuple[AxisRecord, AxisRecord]) -> float:
    """How much an axis changed from one recording to the other, as a share of the rms effort.

    Parameters
    ----------
    time_s : two (N,) arrays
    axis : two AxisRecord
        Of one motion, with any gains.

    Returns
    -------
    float
        What the base parameters differ by, as effort along the later recording; zero where that
        may be chance.
    """
    signals = [
        condition(times, record.position, record.effort)
        for times, record in zip(time_s, axis, strict=True)
    ]
    fits = [_fitted(s) for s in signals]
    difference = fits[1][0] - fits[0][0]
    wald = difference @ np.linalg.pinv(fits[0][1] + fits[1][1], _RANK, hermitian=True) @ difference
    if _by_chance(float(wald)) > _CHANCE:
        return 0.0
    later = signals[1]
    effort = rms(later.effort[later.moving])
    return rms(later.regressor[later.moving] @ difference) / effort


def _fitted(signals: Signals) -> tuple[Array, Array]:
    """Base parameters (4,) by least squares, and their covariance (4, 4)."""
    moving = signals.moving
    rows, effort = signals.regressor[moving], signals.effort[moving]
    inverse = np.linalg.pinv(rows.T @ rows, _RANK, hermitian=True)
    found = inverse @ (rows.T @ effort)
    part = (_PARTS * np.flatnonzero(moving)) // len(moving)
    scores = np.zeros((_PARTS, _PARAMETERS))
    np.add.at(scores, part, rows * (effort - rows @ found)[:, None])
    return found, inverse @ (scores.T @ scores) @ inverse


def _by_chance(wald: float) -> float:
    """Probability of a Wald statistic as large: of F with four degrees of freedom and those of the
    scatter, which is estimated too. For an even number of parameters it has a closed form."""
    half = _PARTS - 1
    rest = 2 * half / (2 * half + wald)
    return float(rest**half * (1.0 + half * (1.0 - rest)))

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
that needs another effort for the same motion (`edge_ident.commissioning.verification`).

Whether there is anything to gain is asked beforehand, of a forecast (`promise`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, Literal

import numpy as np

from edge_ident.commissioning.capture import Capture, Observer, capture_motion
from edge_ident.commissioning.further_motions import NamedMotion
from edge_ident.commissioning.promise import SHARE, WORTH, Promise
from edge_ident.control.compensation import plant_of
from edge_ident.control.gain_design import QUANTIZATION_SHARE
from edge_ident.control.position_loop import LoopHardware, law_response, open_loop
from edge_ident.errors import BoardError
from edge_ident.model.model import PARAMETERS, Array, AxisModel
from edge_ident.signals.conditioning import Signals, condition
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.support.words import listed
from firmware_interface.board import Board
from firmware_interface.board_gains import RunningCommit
from firmware_interface.gains import AxisGains

Verdict = Literal["better", "equal", "in doubt", "too lively", "worse"]

_SEGMENTS: Final = 64
_STANDARD_ERRORS: Final = 2.0
# Encoder counts to which the rms error of a motion repeats: with the same gains, 101 of 102 rms
# errors of random drives of the independent plant differ by less.
_REPEATED_COUNTS: Final = 0.05
# Ratio of the errors from which a change of the machine is not asked for.
_CLEARLY_BETTER: Final = 2.0


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
        resolved = max(SHARE * rms_before, _REPEATED_COUNTS * count_rad)
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
    board: Board, motion: NamedMotion, observer: Observer, file: Path | None = None
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

# Parts of a recording, each long enough for its residual to forget the one before.
_PARTS: Final = 32
_PARAMETERS: Final = len(PARAMETERS)
_CHANCE: Final = 1e-3  # probability of a difference as large on a machine that stayed the same
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


# Whether a loop is livelier than noise explains: the first sign of one that will oscillate.
#
# A loop that is well damped answers, above its bandwidth, the rounding of its encoder and little
# else. The power of that follows from the law and the axis. One that is too stiff for what it moves
# (a soft chain, play) has more. It is asked of the feedback's effort and of the speed, above the
# frequency at which the opened loop has fallen to one. A motion is taken in stretches, and their
# median counts: a reversal, which is no noise, lasts for a few.
#
# Source: Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Trans.
# Audio and Electroacoustics 15 (1967).

_STRETCH: Final = 256  # samples of a stretch; neighbours overlap by half
# Amplitude over that of the noise from which it is no noise: a sensitivity of up to 2 is sound.
_BEYOND_NOISE: Final = 3.0
# Amplitude in encoder counts, rms, that is no oscillation worth the name.
_LIVELY_COUNTS: Final = 2.0


def liveliness(
    record: AxisRecord, gains: AxisGains, axis: AxisModel, hardware: LoopHardware
) -> float:
    """What an axis answers above its bandwidth, over the most that is harmless; above one, the loop
    is too lively.

    Parameters
    ----------
    record : AxisRecord
        Of a motion with these gains.
    gains : AxisGains
    axis : AxisModel
    hardware : LoopHardware
    """
    assert record.reference is not None
    error = record.reference - record.position
    if len(error) < 2 * _STRETCH:
        return 0.0
    window = np.hanning(_STRETCH)
    starts = range(0, len(error) - _STRETCH + 1, _STRETCH // 2)
    stretches = np.stack([window * error[at : at + _STRETCH] for at in starts])
    power = np.abs(np.fft.rfft(stretches)) ** 2 / (np.sum(window**2) * _STRETCH) * 2.0
    omega = np.asarray(
        2.0 * np.pi * np.fft.rfftfreq(_STRETCH, hardware.sample_period_s), dtype=np.float64
    )
    above = omega > _crossover(gains, axis, hardware)
    if not np.any(above):
        return 0.0
    law = np.abs(law_response(gains, omega[above], hardware.sample_period_s)) ** 2
    # position and reference are both rounded, to one twelfth of a count squared
    noise = hardware.encoder_resolution_rad**2 / 6.0 / (_STRETCH / 2)
    allowed_nm = QUANTIZATION_SHARE * hardware.effort_limit_nm
    found = []
    for weight, harmless in (
        (law, allowed_nm**2),
        (np.ones_like(law), (_LIVELY_COUNTS * hardware.encoder_resolution_rad) ** 2),
    ):
        # the median, of which numpy's own loads numpy.ma
        seen = float(np.sort(power[:, above] @ weight)[len(power) // 2])
        most = max(_BEYOND_NOISE**2 * noise * float(np.sum(weight)), harmless)
        found.append(np.sqrt(seen / most))
    return float(min(found))


def _crossover(gains: AxisGains, axis: AxisModel, hardware: LoopHardware) -> float:
    """Highest frequency at which the opened loop has a gain of one, rad/s."""
    omega, response = open_loop(gains, plant_of(axis), hardware)
    louder = omega[np.abs(response) >= 1.0]
    return float(louder[-1]) if len(louder) else 0.0


# What became of new gains, and the sentence that says it.


@dataclass(frozen=True)
class GainChange:
    """What was done with new gains.

    Attributes
    ----------
    confirmed : bool
        Whether the new gains are in force to stay.
    unchanged : bool
        The forecast was not worth a write, and nothing was written.
    verification : Verification or None
        Tracking with old and new gains on the motion of the identification; None where the drive
        did not move with both.
    tracking_after_rad : mapping of axis name to float, or None
        Rms with the new gains on that motion.
    others : mapping of motion to Verification
        Of the other motions with both gains.
    promise : Promise or None
        What was forecast, and what was measured of it; None where no forecast was made.
    diagnosed : mapping of axis name to tuple of str
        Effects of a diagnosis from which the new gains follow.
    running : RunningCommit or None
        Of a commit while the axes came to rest; None where they stood, or nothing was written.
    dry_run : bool
        Nothing was to be written: `promise` is the forecast on the motion of the identification.
    """

    confirmed: bool
    unchanged: bool = False
    verification: Verification | None = None
    tracking_after_rad: Mapping[str, float] | None = None
    others: Mapping[str, Verification] = field(default_factory=dict)
    promise: Promise | None = None
    diagnosed: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    dry_run: bool = False
    running: RunningCommit | None = None

    @property
    def contradicted(self) -> Mapping[str, tuple[str, ...]]:
        """Diagnosed effects of all axes, where the motions contradict what follows from them."""
        rolled_back = self.verification is not None and not self.confirmed
        if not rolled_back or self.in_doubt:
            return {}
        return {axis: effects for axis, effects in self.diagnosed.items() if effects}

    @property
    def next_step(self) -> str:
        """What to do after a roll-back; empty where nothing was rolled back."""
        if self.verification is None or self.confirmed:
            return ""
        if self._changed:
            return "leave the machine as it is, its payload and warmth included, and try again"
        if self.in_doubt:
            return "try again, along a longer motion"
        motion = self._another_motion
        if self.contradicted:
            return f"take the diagnosis as open: {motion}, and diagnose both recordings"
        where = f" of axis {listed(self.blamed)}" if self.blamed else ""
        return (
            f"look for play or a resonance{where}; {motion}, and diagnose both "
            "recordings; or take a lower --bandwidth"
        )

    @property
    def _another_motion(self) -> str:
        """A motion that shows what the one of the identification does not."""
        made = next(iter(self.promise.motions), "") if self.promise else ""
        if made == "multisine":
            return "record steady speeds (edge-ident capture --motion staircase)"
        return "record many frequencies (edge-ident capture --motion multisine)"

    @property
    def blamed(self) -> list[str]:
        """Axes for which the new gains were rolled back."""
        axes = {
            axis
            for of in self._motions.values()
            for axis, tracking in of.axes.items()
            if tracking.verdict not in ("better", "equal")
        }
        return sorted(axes) if self.verification is not None and not self.confirmed else []

    @property
    def conclusion(self) -> str:
        """One sentence."""
        if self.dry_run:
            said = "gains were designed and checked, nothing was written"
            return f"{said}; {_forecast(self.promise)}"
        if self.unchanged:
            return _why_nothing(self.promise)
        if self.verification is None:
            return "gains restored and confirmed"
        if not self.confirmed:
            falls = "; ".join(f"{axis} {of.fall}" for axis, of in self.verification.axes.items())
            return f"{self._why_rolled_back} (tracking error: {falls}){self._contradiction}"
        if self.verification.verdict == "equal":
            return "new gains confirmed; the tracking error is unchanged within its repeatability"
        axes = self.verification.axes
        fell = [axis for axis, tracking in axes.items() if tracking.verdict == "better"]
        smaller = "; ".join(f"{axis} {axes[axis].fall}" for axis in fell)
        same = listed(axis for axis in axes if axis not in fell)
        beside = f"; {same}: unchanged within its repeatability" if same else ""
        return f"new gains confirmed; the tracking error fell: {smaller}{beside}{self._broken}"

    @property
    def _broken(self) -> str:
        """What was promised and not kept by gains that stay."""
        broken = "" if self.promise is None else listed(self.promise.broken)
        return f"; more was promised than was measured ({broken})" if broken else ""

    @property
    def _why_rolled_back(self) -> str:
        if self._changed:
            return f"{self._changed}: the gains could not be compared, and were rolled back"
        chance = ", perhaps by chance," if self.in_doubt else ""
        against = [motion for motion, of in self._motions.items() if not of.keeps]
        where = f" on the {' and the '.join(against)}" if any(against) else ""
        if lively := self._lively:
            return f"new gains made axis {listed(lively)} too lively and were rolled back"
        return f"new gains increased the tracking error{where}{chance} and were rolled back"

    @property
    def _lively(self) -> list[str]:
        """Axes that are too lively, where none follows worse."""
        verdicts = {axis: of.verdict for v in self._motions.values() for axis, of in v.axes.items()}
        if "worse" in verdicts.values():
            return []
        return [axis for axis, verdict in verdicts.items() if verdict == "too lively"]

    @property
    def _motions(self) -> Mapping[str, Verification]:
        """Verifications; the motion of the identification needs no name."""
        return {**({} if self.verification is None else {"": self.verification}), **self.others}

    @property
    def in_doubt(self) -> bool:
        """Whether the gains were rolled back for a doubt alone."""
        verdicts = {of.verdict for of in self._motions.values()}
        return "in doubt" in verdicts and not verdicts & {"worse", "too lively"}

    @property
    def _changed(self) -> str:
        """What changed on the machine during the trial, where that alone put it in doubt."""
        shares: dict[str, float] = {}
        for of in self._motions.values():
            for axis, share in of.machine_changed.items():
                shares[axis] = max(share, shares.get(axis, 0.0))
        if not self.in_doubt or not shares:
            return ""
        parts = ", ".join(
            f"axis {axis} by {share:.0%} of its effort" for axis, share in shares.items()
        )
        return f"the machine itself changed during the trial ({parts})"

    @property
    def _contradiction(self) -> str:
        named = "; ".join(
            f"axis {axis}: {', '.join(effects).replace('_', ' ')}"
            for axis, effects in self.contradicted.items()
        )
        return f"; the motion does not confirm the diagnosis ({named})" if named else ""


def _forecast(promise: Promise | None) -> str:
    if promise is None or not promise.worth_a_write:
        return f"a run would end with '{_why_nothing(promise)}'"
    falls = ", ".join(f"{axis} {of_axis.improvement:.1%}" for _, axis, of_axis in promise.every)
    return f"the forecast is a tracking error smaller by {falls}"


def _why_nothing(promise: Promise | None) -> str:
    if promise is None:
        return "already tuned, nothing changed: new gains would not reduce the tracking error"
    if promise.worse:
        return f"nothing changed: new gains would follow worse, {' and '.join(promise.worse)}"
    if promise.best >= WORTH:
        return (
            f"nothing changed: the forecast is an error smaller by {promise.best:.0%}, but its own "
            "error, or the encoder's count, is as large"
        )
    return (
        f"already tuned, nothing changed: the forecast is an error smaller by "
        f"{max(promise.best, 0.0):.1%}, and less than {WORTH:.0%} is not worth a write"
    )

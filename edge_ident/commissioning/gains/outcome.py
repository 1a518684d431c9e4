"""What became of new gains, and the sentence that says it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from edge_ident.commissioning.gains.promise import WORTH, Promise
from edge_ident.commissioning.gains.verification import Verification
from edge_ident.support.words import listed
from firmware_interface.board_gains import RunningCommit


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
            said = "dry run: gains were designed and checked, nothing was written"
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

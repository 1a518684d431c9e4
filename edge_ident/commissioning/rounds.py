"""New gains from all motions so far, written as often as it is worth it, three times at most.

A round designs gains for the axes as they are (`edge_ident.identification.effective`), forecasts
them, writes them and moves with them. Its motions are data for the next one. So a first step may be
careful: where an axis follows worse with its new gains, or is too lively, the next round is; and
after that it leaves the axis as it is.
"""

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from edge_ident.commissioning import gain_change, gain_transfer, identification_motions
from edge_ident.commissioning.drawn_loads import Grounds
from edge_ident.commissioning.further_motions import livelier_motion
from edge_ident.commissioning.gain_change import MotionBefore, Recorded, Trial
from edge_ident.commissioning.verification import GainChange, compare_motions
from edge_ident.control.gain_design import GainDesign, Ground, design, left_alone
from edge_ident.control.position_loop import LoopHardware
from edge_ident.errors import DataError
from edge_ident.identification.effective import EffectiveAxis, effective_axis
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Model
from edge_ident.model.motion import LARGEST_SHIFT, Timing
from edge_ident.signals.recording import Recording
from firmware_interface.board import AxisLimits
from firmware_interface.gains import FEEDBACK, POSITIVE, SIGNED, AxisGains, Bank

log = logging.getLogger(__name__)


MOST_WRITES: Final = 3
VERIFICATION_FILE: Final = "verification.npz"
_INTERVAL: Final = 2.0  # standard deviations within which the effort may be late
# Logarithm by which forecasts may be off before one was measured: what machines of another
# simulation did beyond the draws (tools/used_machines.py).
_DISBELIEF: Final = 0.2
_CAREFUL: Final = 0.5  # bandwidth of the round after one that was taken back, over that one's


@dataclass(frozen=True)
class Round:
    """One set of new gains.

    Attributes
    ----------
    designs : mapping of axis name to GainDesign
        As forecast; on trial where `change` says so.
    change : GainChange
    file : str
        Of the first motion with the new gains.
    """

    designs: Mapping[str, GainDesign]
    change: GainChange
    file: str


class Rounds:
    """The rounds of a run.

    Parameters
    ----------
    study : Study
    first : IdentificationMotion
    gains_before : mapping of axis name to AxisGains
        In force before the run.

    Attributes
    ----------
    found : Identification
        From which named effects and the shift of the effort are taken.
    done : list of Round
    livelier : IdentificationMotion or None
        A motion of the drive's own that was made because the others did not show the inertia.
    local : Model
        The axes as they are, from all motions so far.
    original : dict of motion to Recorded
        The motions that judge, with the gains of before.
    """

    def __init__(
        self,
        study: identification_motions.Study,
        first: identification_motions.IdentificationMotion,
        gains_before: Bank,
    ) -> None:
        self._study, self._board, self._first, self.found = study, study.board, first, first.found
        # the same motion, as new gains are judged by it
        before = MotionBefore.of(study.drive, study.plan.motion, first.capture, first.found)
        self._before = before
        self._gains_before = gains_before
        self._hardware = LoopHardware.of_axes(self._board.identity, self._board.limits())
        self._count_rad = self._board.identity.encoder_resolution_rad
        self._recordings: list[Recording] = [before.capture.recording]
        self._caution = dict.fromkeys(self._board.axes, 0)
        self._bandwidths: dict[str, float] = {}
        self._disbelief = _DISBELIEF
        self._timing = {name: axis.timing for name, axis in first.found.axes.items()}
        self.local = first.found.model
        self.done: list[Round] = []
        self.livelier: identification_motions.IdentificationMotion | None = None
        self.original = {before.first.name: Recorded(before.first, before.capture, first.file)}
        self._in_force = dict(self.original)

    @property
    def confirmed(self) -> Round | None:
        """The round whose gains are in force to stay."""
        return next((one for one in reversed(self.done) if one.change.confirmed), None)

    @property
    def writes(self) -> int:
        """How often gains were written."""
        return sum(one.change.verification is not None for one in self.done)

    def dry(self) -> None:
        """Design and forecast, and write nothing."""
        trial, designs = self._forecast()
        self.done.append(Round(designs, GainChange(False, promise=trial.promise, dry_run=True), ""))

    def improve(self) -> None:
        """Write new gains as long as that is worth it.

        Raises
        ------
        LinkError, BoardError
            A motion did not get to its end.
        """
        while self.writes < MOST_WRITES and self._one():
            pass

    def since_before(self, one: Round) -> GainChange:
        """What became of gains in the end, measured against the motions before the first round."""
        change = one.change
        if not change.confirmed or one is self.done[0]:
            return change
        found = {
            name: compare_motions(before.recording, self._in_force[name].recording, self._count_rad)
            for name, before in self.original.items()
        }
        first, *others = found.items()
        return replace(change, verification=first[1], others=dict(others))

    def second(self) -> Recorded | None:
        """The second motion with the gains of before, where it was made."""
        _, *others = self.original.values()
        return others[0] if others else None

    def _one(self) -> bool:
        """One round; whether another one may be worth it."""
        trial, designs = self._forecast()
        if len(self._in_force) == 1:
            if not (trial.promise.worth_a_write or any(found.kept for found in designs.values())):
                return self._nothing(trial, designs)
            self._hear(trial.move_second())
            trial, designs = self._forecast()
        same = trial.wanted == trial.active
        if same or not trial.worth_a_write():
            return self._moved_livelier(designs) or self._nothing(trial, designs)
        gain_transfer.keep_backup(self._gains_before, self._board.identity, self._study.folder)
        change = gain_change.concluded(self._board, trial, worth_a_write=True)
        after = trial.after
        self.done.append(Round(designs, change, after[self._before.first.name].file))
        self._recordings += [made.capture.recording for made in after.values()]
        self._disbelief = max(self._disbelief, trial.promise.missed)
        self._bandwidths = {axis: found.bandwidth_rad_s for axis, found in designs.items()}
        if change.confirmed:
            self._in_force = dict(after)
            self._caution = dict.fromkeys(self._caution, 0)
        for axis in change.blamed:
            self._caution[axis] += 1
            self._study.tell(f"axis {axis}: {change.conclusion}")
        return True

    def _nothing(self, trial: Trial, designs: Mapping[str, GainDesign]) -> bool:
        """The last round: its gains are not worth a write."""
        self._board.settle()
        change = GainChange(False, unchanged=True, promise=trial.promise)
        if not self.done:
            self.done.append(Round(designs, change, ""))
        log.info(change.conclusion)
        return False

    def _hear(self, second: Recorded) -> None:
        """Take a motion with the gains of before that new ones are judged by."""
        self.original[second.motion.name] = self._in_force[second.motion.name] = second
        self._listen(second.recording)

    def _listen(self, recording: Recording) -> None:
        """Take a motion for the next fit; the shift of the effort is that of the surest motion."""
        self._recordings.append(recording)
        try:
            seen = identify(recording, model=self._study.plan.model, diagnose=False)
        except DataError as error:  # too short by itself
            log.info("the shift of the effort in this motion: %s", error.cause)
            return
        for name, axis in seen.axes.items():
            if axis.timing.std_samples < self._timing[name].std_samples:
                self._timing[name] = axis.timing

    def _forecast(self) -> tuple[Trial, dict[str, GainDesign]]:
        """New gains and what they promise; an axis that would gain nothing keeps those in force."""
        grounds, designs = self._designed()
        trial = self._trial(grounds, designs)
        promise = trial.forecast_all()
        useless = [axis for axis in designs if not promise.useful(axis)]
        if not useless or len(useless) == len(designs):
            return trial, designs
        for axis in useless:
            designs[axis] = self._left_alone(axis, grounds.model.axes[axis], trial.active[axis])
        trial = self._trial(grounds, designs)
        trial.forecast_all()
        return trial, designs

    def _designed(self) -> tuple[Grounds, dict[str, GainDesign]]:
        """Gains of every axis from all motions, careful where the last ones were taken back."""
        active, limits = self._board.active_gains(), self._board.limits()
        bandwidth = self._study.plan.bandwidth_rad_s
        with self._study.watch.stage("last_sample_to_verified"):
            axes = {name: self._effective(name) for name in self._hardware}
            grounds = _grounds(axes, self.found, self._timing)
            self.local = grounds.model
            designs = {}
            for name, axis in axes.items():
                caution = self._caution[name]
                ground = Ground(
                    late_s=self._late_s(grounds.timing[name]),
                    repeating=axis.repeating,
                    in_force=active[name],
                    gain_step=limits[name].gain_step,
                    others=grounds.model.axes,
                    most_rad_s=_CAREFUL * self._bandwidths[name] if caution else math.inf,
                )
                found = design(axis.model, self._hardware[name], bandwidth, ground=ground)
                found = replace(found, gains=within_board(found.gains, active[name], limits[name]))
                if caution > 1:
                    found = self._left_alone(name, axis.model, active[name])
                designs[name] = found
        return grounds, designs

    def _left_alone(self, name: str, axis: AxisModel, present: AxisGains) -> GainDesign:
        return left_alone(present, axis, self._hardware[name], "nothing better is promised")

    def _late_s(self, timing: Timing) -> float:
        """Latest time by which the effort may act, beyond what the board says."""
        late = abs(timing.shift_samples) + _INTERVAL * timing.std_samples
        return min(late, LARGEST_SHIFT) * self._board.identity.sample_period_s

    def _effective(self, name: str) -> EffectiveAxis:
        axis, hardware = self.found.axes[name], self._hardware[name]
        lasting = [term for term in axis.model.terms[1:] if not named(term.effect).tied_to_time]
        tables = "load_table" in hardware.law
        late_s = self._timing[name].shift_s
        return effective_axis(self._recordings, name, lasting, late_s, repeats=tables)

    def _trial(self, grounds: Grounds, designs: Mapping[str, GainDesign]) -> Trial:
        wanted = {axis: found.gains for axis, found in designs.items()}
        gain_change.check_change(self._board, self._board.active_gains(), wanted, large_steps=True)
        first, *others = self._in_force.values()
        before = replace(
            self._before,
            capture=first.capture,
            grounds=grounds,
            recorded=others[0] if others else None,
        )
        number = f"_{self.writes + 1}" if self.writes else ""
        file = self._study.folder / VERIFICATION_FILE.replace(".", f"{number}.")
        study = self._study
        return Trial(
            self._board, wanted, before, study.observer, file, study.watch, self._disbelief
        )

    def _moved_livelier(self, designs: Mapping[str, GainDesign]) -> bool:
        """Make the drive's own livelier motion, where the others do not show the inertia."""
        study, first = self._study, self._first
        doubts = {axis: (found.kept,) for axis, found in designs.items() if found.kept}
        if not doubts or self.livelier is not None or study.plan.most_motions < 2:
            return False
        trajectory = livelier_motion(study, first)
        if (
            trajectory is None
            or first.duration_s + identification_motions.duration_s(trajectory) > study.plan.most_s
        ):
            return False
        self._board.settle()
        said = "; ".join(f"axis {axis}: {why}" for axis, (why,) in doubts.items())
        study.tell(f"{said}; a livelier motion follows")
        capture = identification_motions.captured(study, trajectory, 2, first.capture)
        self._board.finish()
        self._listen(capture.recording)
        self.livelier = identification_motions.IdentificationMotion(
            identification_motions.capture_file(2), trajectory, capture, self.found, sought=doubts
        )
        return True


def within_board(wanted: AxisGains, active: AxisGains, limits: AxisLimits) -> AxisGains:
    """Gains with feed-forward that the board takes, in one step from those in force.

    Feedback is left as it is: the design asks the board by itself.
    """
    now, largest = active.numbers(), limits.gain_maximum.numbers()
    numbers = wanted.numbers()
    for name, value in numbers.items():
        if name in FEEDBACK or name in POSITIVE:
            continue
        most, step = largest[name], limits.gain_step * largest[name]
        low = max(now[name] - step, -most if name in SIGNED else 0.0)
        numbers[name] = min(max(value, low), min(now[name] + step, most))
    return AxisGains.of_numbers(list(numbers.values()))


def _grounds(
    axes: Mapping[str, EffectiveAxis], found: Identification, timing: Mapping[str, Timing]
) -> Grounds:
    """What forecasts rest on."""
    return replace(
        Grounds.of(found),
        model=Model({name: axis.model for name, axis in axes.items()}),
        timing=timing,
        repeating={n: axis.repeating for n, axis in axes.items() if axis.repeating is not None},
        spread={name: axis.spread for name, axis in axes.items()},
        drift={name: axis.drift for name, axis in axes.items()},
    )

"""The whole job on a board: move, identify, design, write, verify, confirm or roll back."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np

from edge_ident.commissioning.board_answer import BoardAnswer, board_answer
from edge_ident.commissioning.capture import (
    Capture,
    Observer,
    check_drive,
    check_recordable,
    come_to_rest,
)
from edge_ident.commissioning.gain_transfer import keep_backup
from edge_ident.commissioning.identification_motions import (
    CAPTURE_FILE,
    EarlyAnswer,
    IdentificationMotion,
    Looks,
    Plan,
    Study,
    captured,
    identified,
    rehearse,
)
from edge_ident.commissioning.rounds import Round, Rounds
from edge_ident.commissioning.safety import leave_confirmed, make_ready, ready_to_move
from edge_ident.commissioning.separation import Separation, diagnosed
from edge_ident.commissioning.tracking_forecast import unseen_load
from edge_ident.commissioning.verification import GainChange, Tracking
from edge_ident.control.gain_design import GainDesign, Ground, design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.estimation.network import Network
from edge_ident.estimation.trust import WEAK, WEAK_LIMIT, Finding
from edge_ident.identification.result import Identification, known_sentence, worth_acting_on
from edge_ident.model.model import PARAMETERS, AxisModel, Model
from firmware_interface.board import Board
from firmware_interface.gains import Bank
from firmware_interface.motion import Trajectory

log = logging.getLogger(__name__)


# The answer of a run: two questions, two verdicts, and the figures that everybody shows.
#
# Are the parameters known? Are new gains safe, and better? Only the second decides about a write.
# Terminal, page and JSON take both, and the errors before and after, from here.


class Ending(StrEnum):
    """What became of the machine."""

    BETTER = "better"
    """It follows better than before."""
    AS_WELL = "as_well_as_it_can"
    """Nothing better is promised, or no difference was measured."""
    FORECAST = "forecast"
    """Nothing was to be written."""
    TAKEN_BACK = "taken_back"
    """New gains did not follow better."""
    CONTRADICTORY = "contradictory_data"
    """The data contradict themselves: nothing follows from them."""

    @property
    def good(self) -> bool:
        """Whether the machine follows better than before, or as well as it can."""
        return self in (Ending.BETTER, Ending.AS_WELL, Ending.FORECAST)

    @property
    def spoken(self) -> str:
        """The verdict, as a label."""
        return {
            Ending.BETTER: "better",
            Ending.AS_WELL: "unchanged",
            Ending.FORECAST: "dry run",
            Ending.TAKEN_BACK: "taken back",
            Ending.CONTRADICTORY: "nothing written",
        }[self]


@dataclass(frozen=True)
class AxisAnswer:
    """Both verdicts on an axis.

    Attributes
    ----------
    model : AxisModel
        The axis as it is, from all motions; where none count, from the first.
    known, unknown : tuple of str
        Parameters whose intervals are worth acting on, and the others.
    tracking : Tracking or None
        With the gains of before and of now, on the motion of the identification; None where it was
        not moved with both.
    """

    model: AxisModel
    known: tuple[str, ...]
    unknown: tuple[str, ...]
    tracking: Tracking | None

    @property
    def sentence(self) -> str:
        """What is known, in words."""
        return known_sentence(self.known, self.unknown)

    def settles(self, finding: Finding) -> bool:
        """Whether all motions together show well what the first shows weakly."""
        estimate = self.model.estimate
        well = estimate.std <= WEAK_LIMIT * np.abs(estimate.parameters)
        return finding.code in {f"{WEAK}{PARAMETERS[i]}" for i in np.flatnonzero(well)}


@dataclass(frozen=True)
class RunAnswer:
    """Both verdicts on a machine."""

    ending: Ending
    axes: Mapping[str, AxisAnswer]

    @classmethod
    def of(cls, found: Identification, local: Model, change: GainChange | None) -> Self:
        """From what was identified, first and from all motions, and what became of new gains."""
        tracked = change.verification.axes if change is not None and change.verification else {}
        axes = {}
        for name, axis in found.axes.items():
            model = local.axes[name]
            both = dict(zip(PARAMETERS, worth_acting_on(model.estimate), strict=True))
            known = tuple(name for name, sure in both.items() if sure and axis.consistent)
            unknown = tuple(name for name in both if name not in known)
            axes[name] = AxisAnswer(model, known, unknown, tracked.get(name))
        return cls(_ending(change), axes)

    @property
    def known_everywhere(self) -> bool:
        """Whether every parameter of every axis is known."""
        return not any(axis.unknown for axis in self.axes.values())


def _ending(change: GainChange | None) -> Ending:
    if change is None:
        return Ending.CONTRADICTORY
    if change.dry_run:
        return Ending.FORECAST
    if change.unchanged:
        return Ending.AS_WELL
    if not change.confirmed:
        return Ending.TAKEN_BACK
    verified = change.verification
    return Ending.BETTER if verified and verified.verdict == "better" else Ending.AS_WELL


@dataclass(frozen=True)
class Outcome:
    """What a run found and did.

    Attributes
    ----------
    designs : mapping of axis to GainDesign
        Of the gains in force, or of the last ones that were tried or forecast. Empty where the data
        contradict themselves.
    gains_before : mapping of axis to AxisGains
    change : GainChange or None
        What became of new gains in the end, against those of before; None where none were designed.
    stored : bool
        Whether the gains in force outlast a power cycle.
    conclusion : str
        One sentence.
    timing_ms : mapping of stage to milliseconds
        `last_sample_to_verified` runs from the last page in hand to gains committed and read back,
        the stop included. `separation` is the time of further motions, and of what designs and
        judges them; `diagnosis` is part of both.
    separation : Separation
        All identification motions, the first included.
    board : BoardAnswer or None
        What the board identified by itself from the whole first motion, if it has a network.
    early : EarlyAnswer or None
        Whether the first motion could end early; None where that was not asked for.
    local : Model or None
        The axes as they are, from all motions, where gains were designed.
    rounds : tuple of Round
        Every set of gains that was written, or the one that was not worth it.
    file_after : str
        Of the first motion with the gains of `designs`; empty where none was made.
    """

    capture: Capture
    identification: Identification
    designs: Mapping[str, GainDesign]
    gains_before: Bank
    change: GainChange | None
    stored: bool
    conclusion: str
    timing_ms: Mapping[str, float]
    separation: Separation
    board: BoardAnswer | None = None
    early: EarlyAnswer | None = None
    local: Model | None = None
    rounds: tuple[Round, ...] = ()
    file_after: str = ""

    def captures(self, folder: Path) -> list[Path]:
        """Files of the identification motions."""
        return [folder / made.file for made in self.separation.motions]

    @property
    def confirmed(self) -> bool:
        """Whether new gains are in force to stay."""
        return self.change is not None and self.change.confirmed

    @property
    def tried(self) -> bool:
        """Whether a motion was made with new gains and compared."""
        return self.change is not None and self.change.verification is not None

    @cached_property
    def answer(self) -> RunAnswer:
        """Both verdicts, and the errors before and after: what everybody shows."""
        local = self.identification.model if self.local is None else self.local
        return RunAnswer.of(self.identification, local, self.change)

    @property
    def good(self) -> bool:
        """Whether the machine follows better than before, or as well as it can."""
        return self.answer.ending.good


def commission(
    board: Board,
    drive: Drive,
    network: Network | None,
    plan: Plan,
    folder: Path,
    observer: Observer,
) -> Outcome:
    """Do it all, and leave the machine stopped with gains old or new whatever happens.

    Parameters
    ----------
    board : Board
        Connected.
    folder : Path
        Existing; captures and the backup of the gains are written here as they are made.

    Raises
    ------
    LinkError, BoardError, DataError, ModelError, GainError
    """
    check_drive(board, drive)
    study = Study(plan, board, drive, network, folder, observer)
    trajectory = named_trajectory(drive, plan.motion, plan.cycles)
    check_recordable(board, trajectory, folder / CAPTURE_FILE)
    make_ready(board)
    rehearse(study, trajectory)
    gains_before = board.active_gains()
    # before the effort goes on: whatever happens from there, the backup is there
    keep_backup(gains_before, board.identity, folder)
    with ready_to_move(board, observer.say):
        first, early = _first_motion(study, trajectory, plan.until)
        answer = _answer_of_board(study, first)
        job = _Job(study, first, gains_before)
        job.do()
        change = job.change
        stored = plan.store and change is not None and (change.confirmed or change.unchanged)
        if stored:
            board.store()
    return _outcome(job, gains_before, stored, answer, early)


class _Job:
    """What a run does once its first motion is identified."""

    def __init__(self, study: Study, first: IdentificationMotion, gains_before: Bank) -> None:
        self.study, self.plan, self.first = study, study.plan, first
        self.rounds = Rounds(study, first, gains_before)
        self.separation = Separation((first,))

    @property
    def change(self) -> GainChange | None:
        """What became of new gains in the end, against those of before the run."""
        confirmed = self.rounds.confirmed
        last = confirmed or (self.rounds.done[-1] if self.rounds.done else None)
        return None if last is None else self.rounds.since_before(last)

    def do(self) -> None:
        """The fast answer first, unless the user asks for the diagnosis first."""
        if self.plan.diagnose_first:
            self._diagnose()
        if not self.found.consistent:
            return
        self._improve()
        if self.plan.diagnose and not self.plan.diagnose_first:
            self._afterwards()

    def _improve(self) -> None:
        """New gains, or in a dry run what they would be worth."""
        if self.plan.write:
            self.rounds.improve()
        else:
            self.rounds.dry()

    @property
    def found(self) -> Identification:
        """What is known."""
        return self.separation.found

    def _afterwards(self) -> None:
        """Diagnose, and write once more where that is worth it; Ctrl-C keeps what is confirmed."""
        try:
            known = self.found
            self._diagnose()
            if self.found is not known:
                self._improve()
        except KeyboardInterrupt:
            if self.rounds.confirmed is None:
                raise
            leave_confirmed(self.study.board)
            self.study.tell("interrupted: the gains that were confirmed stay")

    def _diagnose(self) -> None:
        with self.study.watch.stage("separation"):
            self.separation = diagnosed(self.study, self.separation, self.rounds.second())
        self.rounds.found = self.found
        self.study.unload_network()


def _outcome(
    job: _Job,
    gains_before: Bank,
    stored: bool,
    answer: BoardAnswer | None,
    early: EarlyAnswer | None,
) -> Outcome:
    rounds, separation, change = job.rounds, job.separation, job.change
    if rounds.livelier is not None:
        separation = replace(separation, motions=(*separation.motions, rounds.livelier))
    last = rounds.confirmed or (rounds.done[-1] if rounds.done else None)
    designs = {} if last is None else last.designs
    conclusion = _conclude(job.found, change, stored, unseen_load(designs))
    log.info(conclusion)
    return Outcome(
        job.first.capture, job.found, designs, gains_before, change, stored, conclusion,
        job.study.watch.timing_ms(), separation, board=answer, early=early,
        local=rounds.local, rounds=tuple(rounds.done), file_after="" if last is None else last.file,
    )  # fmt: skip


def _answer_of_board(study: Study, first: IdentificationMotion) -> BoardAnswer | None:
    """What the board identified by itself, from whole motions alone; its axes rest meanwhile."""
    if first.capture.ended_early:
        return None
    with study.watch.stage("board_identification"):
        answer = board_answer(study.board, first.recording, first.found, study.network)
    for sentence in answer.sentences if answer else ():
        log.info(sentence)
    return answer


def _first_motion(
    study: Study, trajectory: Trajectory, until: float | None
) -> tuple[IdentificationMotion, EarlyAnswer | None]:
    """The motion that the user asked for, or as much of it as is needed, identified."""
    looks = None if until is None else Looks(study, trajectory, until)
    capture = captured(study, trajectory, 1, enough=None if looks is None else looks.enough)
    with study.watch.stage("last_sample_to_verified"):
        come_to_rest(study.board, capture)
        found = identified(study, capture.recording) if looks is None else looks.identified(capture)
    if capture.ended_early:
        captured_s = len(capture.recording.time_s) * study.board.identity.sample_period_s
        trajectory = replace(trajectory, duration_s=captured_s)
    first = IdentificationMotion(CAPTURE_FILE, trajectory, capture, found)
    return first, None if looks is None else looks.answer(capture, found)


def board_designs(board: Board, found: Identification) -> dict[str, GainDesign]:
    """Gains of every axis, for this board's sampling, delay, encoder, limits and control law."""
    hardware = LoopHardware.of_axes(board.identity, board.limits())
    others = {name: axis.model for name, axis in found.axes.items()}
    return {
        name: design(axis.model, hardware[name], ground=Ground(axis.end_s, others=others))
        for name, axis in found.axes.items()
    }


def _conclude(found: Identification, change: GainChange | None, stored: bool, load: str) -> str:
    if change is None:
        axes = [f"axis {name}" for name, axis in found.axes.items() if not axis.consistent]
        return f"the data contradict themselves: {', '.join(axes)}; nothing was written"
    said = change.conclusion + ("; the active gains are stored" if stored else "")
    return said if change.verification is None else said + load

"""The whole job on a board: move, identify, design, write, verify, confirm or roll back."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from edge_ident.commissioning.capture import Capture, capture_motion, check_drive
from edge_ident.commissioning.gain_change import check_change, put_in_force
from edge_ident.commissioning.gain_files import save_backup
from edge_ident.commissioning.gain_outcome import GainChange
from edge_ident.commissioning.gain_trial import MotionBefore
from edge_ident.commissioning.observer import Observer
from edge_ident.commissioning.safety import make_ready, ready_to_move
from edge_ident.control.gain_design import GainDesign, design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import MotionName, named_trajectory
from edge_ident.estimation.network import Network
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.model.model import Model
from edge_ident.signals.data_checks import check_recording
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board import Board
from firmware_interface.gains import Bank
from firmware_interface.motion import Trajectory

log = logging.getLogger(__name__)

CAPTURE_FILE: Final = "capture.npz"
VERIFICATION_FILE: Final = "verification.npz"
BACKUP_FILE: Final = "gains_before.json"


@dataclass(frozen=True)
class Plan:
    """What the user wants.

    Attributes
    ----------
    motion : {"sinusoid", "multisine", "staircase"}
    cycles : int or None
        Periods of the identification motion; None takes the drive description's.
    bandwidth_rad_s : float or None
        Of the closed loop; None takes the highest that keeps the margins.
    write : bool
        False for a dry run: everything but the write.
    store : bool
        Keep confirmed gains over a power cycle.
    seed : int
    model : Model or None
        Effects that are known of the drive.
    diagnose : bool
        Whether an axis whose base model is not enough is diagnosed.
    """

    motion: MotionName = "sinusoid"
    cycles: int | None = None
    bandwidth_rad_s: float | None = None
    write: bool = True
    store: bool = False
    seed: int = 0
    model: Model | None = None
    diagnose: bool = True


@dataclass(frozen=True)
class Outcome:
    """What a run found and did.

    Attributes
    ----------
    designs : mapping of axis to GainDesign
        Empty where the identification is not trusted.
    gains_before : mapping of axis to AxisGains
    change : GainChange or None
        None where no gains were to be written.
    stored : bool
        Whether the gains in force outlast a power cycle.
    conclusion : str
        One sentence.
    timing_ms : mapping of stage to milliseconds
        `last_sample_to_verified` runs from the last page in hand to gains committed and read back,
        the stop included.
    """

    capture: Capture
    identification: Identification
    designs: Mapping[str, GainDesign]
    gains_before: Bank
    change: GainChange | None
    stored: bool
    conclusion: str
    timing_ms: Mapping[str, float]

    @property
    def confirmed(self) -> bool:
        """Whether new gains are in force to stay."""
        return self.change is not None and self.change.confirmed

    @property
    def trusted(self) -> bool:
        """Whether all went well: the gains in force are the best that is known."""
        good = self.change is None or self.change.confirmed or self.change.unchanged
        return self.identification.trusted and good


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
    watch = Stopwatch()
    trajectory = named_trajectory(drive, plan.motion, plan.cycles)
    make_ready(board)
    gains_before = board.active_gains()
    # before the effort goes on: whatever happens from there, the backup is there
    save_backup(gains_before, board.identity, folder / BACKUP_FILE)
    with ready_to_move(board, observer.say):
        capture = _captured(board, trajectory, folder, observer, watch)
        with watch.stage("last_sample_to_verified"):
            board.finish()
            found = _identified(board, capture, network, plan, observer)
            designs = board_designs(board, found, plan.bandwidth_rad_s) if found.trusted else {}
        before = MotionBefore.of(drive, plan.motion, capture, found)
        change = _change(board, designs, gains_before, before, plan, folder, observer, watch)
        stored = plan.store and change is not None and (change.confirmed or change.unchanged)
        if stored:
            board.store()
    conclusion = _conclude(found, change, stored)
    log.info(conclusion)
    return Outcome(
        capture, found, designs, gains_before, change, stored, conclusion, watch.timing_ms()
    )


def _captured(
    board: Board, trajectory: Trajectory, folder: Path, observer: Observer, watch: Stopwatch
) -> Capture:
    """The identification motion, saved as soon as its last sample arrives."""
    observer.stage("identification motion")
    file = folder / CAPTURE_FILE
    with watch.stage("motion"):
        return capture_motion(board, trajectory, observer.samples, file, observer.say)


def _identified(
    board: Board, capture: Capture, network: Network | None, plan: Plan, observer: Observer
) -> Identification:
    """Identify what was captured, and say what a diagnosis found."""
    observer.stage("identification")
    check_recording(capture.recording)
    found = identify(
        capture.recording,
        network,
        model=plan.model,
        seed=plan.seed,
        diagnose=plan.diagnose,
        on_progress=_progress_on(observer, board),
    )
    for name, axis in found.axes.items():
        if axis.diagnosis is not None:
            observer.say(f"axis {name}: {axis.diagnosis_sentence}")
            log.info("axis %s: %s", name, axis.diagnosis_sentence)
    return found


def _progress_on(observer: Observer, board: Board) -> Callable[[str, int, int], None]:
    """What a diagnosis calls with its progress; it takes longer than a hold lasts."""
    shown: list[str] = []

    def show(stage: str, done: int, total: int) -> None:
        if stage not in shown:
            shown.append(stage)
            observer.stage(stage)
        observer.samples(done, total)
        board.heartbeat()

    return show


def board_designs(
    board: Board, found: Identification, bandwidth_rad_s: float | None = None
) -> dict[str, GainDesign]:
    """Gains of every axis, for this board's sampling, delay, encoder and effort limit."""
    identity, limits = board.identity, board.limits()
    return {
        name: design(axis.model, LoopHardware.of_board(identity, limits[name]), bandwidth_rad_s)
        for name, axis in found.axes.items()
    }


def _change(
    board: Board,
    designs: Mapping[str, GainDesign],
    gains_before: Bank,
    before: MotionBefore,
    plan: Plan,
    folder: Path,
    observer: Observer,
    watch: Stopwatch,
) -> GainChange | None:
    """Check the designed gains and, unless this is a dry run, put them in force."""
    if not designs:
        return None
    wanted = {axis: designed.gains for axis, designed in designs.items()}
    check_change(board, gains_before, wanted, large_steps=True)
    if not plan.write:
        return None
    return put_in_force(board, wanted, before, observer, folder / VERIFICATION_FILE, watch)


def _conclude(found: Identification, change: GainChange | None, stored: bool) -> str:
    if not found.trusted:
        axes = ", ".join(name for name, axis in found.axes.items() if not axis.trusted)
        return f"axis {axes} is not trusted; nothing was written"
    if change is None:
        return "dry run: gains were designed and checked, nothing was written"
    return change.conclusion + ("; the active gains are stored" if stored else "")

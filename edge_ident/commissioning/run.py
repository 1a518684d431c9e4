"""The whole job on a board: move, identify, design, write, verify, confirm or roll back."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from edge_ident.commissioning.capture import Capture, capture_motion, check_drive
from edge_ident.commissioning.gain_files import save_backup
from edge_ident.commissioning.gain_transfer import check_gains, write_gains
from edge_ident.commissioning.safety import left_safe, make_ready
from edge_ident.commissioning.verification import Verification, verification_motion
from edge_ident.control.gain_design import GainDesign, design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import MotionName, named_trajectory
from edge_ident.estimation.network import Network
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.model.model import Model
from edge_ident.signals.data_checks import check_recording
from edge_ident.signals.recording_files import save_recording
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board import Board
from firmware_interface.gains import AxisGains

log = logging.getLogger(__name__)

CAPTURE_FILE: Final = "capture.npz"
VERIFICATION_FILE: Final = "verification.npz"
BACKUP_FILE: Final = "gains_before.json"


class Observer(Protocol):
    """Who wants to see the progress."""

    def stage(self, title: str) -> None:
        """Call when a stage begins."""

    def samples(self, in_hand: int, expected: int) -> None:
        """Call as captured samples arrive."""


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
    """

    motion: MotionName = "sinusoid"
    cycles: int | None = None
    bandwidth_rad_s: float | None = None
    write: bool = True
    store: bool = False
    seed: int = 0
    model: Model | None = None


@dataclass(frozen=True)
class Outcome:
    """What a run found and did.

    Attributes
    ----------
    designs : mapping of axis to GainDesign
        Empty where the identification is not trusted.
    gains_before : mapping of axis to AxisGains
    verification : Verification or None
        None where nothing was written.
    confirmed, stored : bool
        Whether the new gains stay, and whether they outlast a power cycle.
    conclusion : str
        One sentence.
    timing_ms : mapping of stage to milliseconds
        `last_sample_to_verified` runs from the last page in hand to gains committed and read back.
    """

    capture: Capture
    identification: Identification
    designs: Mapping[str, GainDesign]
    gains_before: Mapping[str, AxisGains]
    verification: Verification | None
    confirmed: bool
    stored: bool
    conclusion: str
    timing_ms: Mapping[str, float]


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
    make_ready(board)
    watch = Stopwatch()
    trajectory = named_trajectory(drive, plan.motion, plan.cycles)
    with left_safe(board):
        before = board.active_gains()
        save_backup(before, board.identity, folder / BACKUP_FILE)
        observer.stage("identification motion")
        with watch.stage("motion"):
            capture = capture_motion(board, trajectory, observer.samples)
        observer.stage("identification")
        with watch.stage("last_sample_to_verified"):
            save_recording(capture.recording, folder / CAPTURE_FILE)
            check_recording(capture.recording)
            found = identify(capture.recording, network, model=plan.model, seed=plan.seed)
            designs = design_gains(board, found, plan.bandwidth_rad_s) if found.trusted else {}
            board.finish()  # the machine came to rest meanwhile
            written = _write(board, designs, before, plan)
        verification = None
        if written:
            observer.stage("verification motion")
            with watch.stage("verification"):
                verified = verification_motion(
                    board, named_trajectory(drive, plan.motion, 1), observer.samples
                )
            save_recording(verified.recording, folder / VERIFICATION_FILE)
            verification = Verification(capture.tracking_rms_rad, verified.tracking_rms_rad)
            _settle(board, verification, plan)
    confirmed = verification is not None and verification.improved
    conclusion = _conclude(found, verification)
    log.info(conclusion)
    return Outcome(
        capture=capture,
        identification=found,
        designs=designs,
        gains_before=before,
        verification=verification,
        confirmed=confirmed,
        stored=confirmed and plan.store,
        conclusion=conclusion,
        timing_ms=watch.timing_ms(),
    )


def design_gains(
    board: Board, found: Identification, bandwidth_rad_s: float | None = None
) -> dict[str, GainDesign]:
    """Gains of every axis, for this board's sampling, delay, encoder and effort limit."""
    identity, limits = board.identity, board.limits()
    return {
        name: design(axis.model, LoopHardware.of_board(identity, limits[name]), bandwidth_rad_s)
        for name, axis in found.axes.items()
    }


def _write(
    board: Board,
    designs: Mapping[str, GainDesign],
    before: Mapping[str, AxisGains],
    plan: Plan,
) -> bool:
    """Check the designed gains and, unless this is a dry run, put them in force, unconfirmed."""
    if not designs:
        return False
    wanted = {axis: designed.gains for axis, designed in designs.items()}
    check_gains(wanted, before, board.limits())
    if plan.write:
        write_gains(board, wanted)
    return plan.write


def _settle(board: Board, verification: Verification, plan: Plan) -> None:
    """Confirm gains that follow no worse, and store them if asked to; take the others back."""
    if not verification.improved:
        board.roll_back()
        return
    board.confirm()
    if plan.store:
        board.store()


def _conclude(found: Identification, verification: Verification | None) -> str:
    if not found.trusted:
        axes = ", ".join(name for name, axis in found.axes.items() if not axis.trusted)
        return f"axis {axes} is not trusted; nothing was written"
    if verification is None:
        return "dry run: gains were designed and checked, nothing was written"
    ratios = ", ".join(
        f"{axis} {verification.ratio(axis):.1f} times" for axis in verification.before_rad
    )
    if verification.improved:
        return f"new gains confirmed; the tracking error fell: {ratios}"
    return f"new gains followed worse and were rolled back (error fell: {ratios})"

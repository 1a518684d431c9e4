"""From gains in force to others: checked, committed, verified by a motion, kept or taken back.

`run` and `gains commit` go the same way: a motion with the gains in force, then `put_in_force`.

How large a step may be: the board's own limits hold for everybody. Beyond them, feedback from a
file may grow or shrink five times at once and not to or from zero, unless the user says
`--large-steps`: nobody knows where a file comes from. `run` may take any step that the board
allows, for its gains are designed with margins from a motion of this very drive that it has just
identified and trusts; soft start-up gains are left by a step of four times, and by feed-forward
from nothing. Either way a motion decides, and the board rolls back by itself.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from edge_ident.commissioning.capture import Capture, capture_motion, check_drive
from edge_ident.commissioning.gain_files import GainFile
from edge_ident.commissioning.gain_transfer import check_factor, check_gains, write_gains
from edge_ident.commissioning.motor_way import of_motor
from edge_ident.commissioning.observer import Observer
from edge_ident.commissioning.safety import ready_to_move
from edge_ident.commissioning.verification import (
    Verification,
    compare_motions,
    nothing_to_gain,
    verification_motion,
)
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.errors import BoardError, DataError
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board import Board
from firmware_interface.gains import AxisGains, Bank
from firmware_interface.motion import Trajectory

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class GainChange:
    """What a commit did.

    Attributes
    ----------
    confirmed : bool
        Whether the new gains are in force to stay.
    unchanged : bool
        There was nothing to gain, and nothing was written.
    verification : Verification or None
        Tracking with old and new gains; None where the drive did not move with both.
    tracking_after_rad : mapping of axis name to float, or None
        Rms with the new gains.
    """

    confirmed: bool
    unchanged: bool = False
    verification: Verification | None = None
    tracking_after_rad: Mapping[str, float] | None = None

    @property
    def conclusion(self) -> str:
        """One sentence."""
        if self.unchanged:
            return "already tuned, nothing changed: new gains would not reduce the tracking error"
        if self.verification is None:
            return "gains restored and confirmed"
        ratios = ", ".join(
            f"{axis} {tracking.ratio:.1f} times"
            for axis, tracking in self.verification.axes.items()
        )
        if not self.confirmed:
            return f"new gains increased the tracking error and were rolled back (ratio: {ratios})"
        if self.verification.verdict == "equal":
            return "new gains confirmed; the tracking error is unchanged within its repeatability"
        return f"new gains confirmed; the tracking error fell: {ratios}"


@dataclass(frozen=True)
class MotionBefore:
    """A motion with the gains in force, to which the new ones must measure up.

    Attributes
    ----------
    capture : Capture
        Whole cycles of it.
    trajectory : Trajectory
        As it was followed.
    one_cycle : Trajectory
        What new gains are verified with.
    """

    capture: Capture
    trajectory: Trajectory
    one_cycle: Trajectory


def put_in_force(
    board: Board,
    wanted: Bank,
    before: MotionBefore,
    observer: Observer,
    file: Path | None = None,
    watch: Stopwatch | None = None,
) -> GainChange:
    """Stage, commit, move with the new gains, and confirm them if no axis follows worse.

    Nothing is written where there is nothing to gain. The rules are in
    `edge_ident.commissioning.verification`.

    Parameters
    ----------
    board : Board
        At rest, enabled, within `edge_ident.commissioning.safety.left_safe`.
    wanted : mapping of axis name to AxisGains
        Checked.
    before : MotionBefore
    observer : Observer
    file : Path, optional
        For the recording of the verification motion.
    watch : Stopwatch, optional
        Notes how long writing and verifying take.
    """
    watch = watch or Stopwatch()
    count_rad, active = board.identity.encoder_resolution_rad, board.active_gains()
    recording = before.capture.recording
    if nothing_to_gain(wanted, active, recording, before.trajectory, count_rad):
        log.info("no improvement is possible: nothing is written")
        return GainChange(confirmed=False, unchanged=True)
    after = _in_force(board, wanted, before.one_cycle, observer, file, watch)
    verification = compare_motions(
        of_motor(recording, active), of_motor(after.recording, wanted), count_rad
    )
    keep = verification.verdict != "worse"
    _confirm_or_roll_back(board, keep=keep)
    return GainChange(keep, False, verification, after.tracking_rms_rad)


def wanted_gains(active: Bank, file: GainFile) -> dict[str, AxisGains]:
    """Gains of all axes: a file's, and those in force where it says nothing.

    Raises
    ------
    DataError
        The file names an axis that the board does not have.
    """
    for axis in file.gains:
        if axis not in active:
            raise DataError(
                f"the file has gains of axis {axis}, the board has {', '.join(active)}",
                "give gains for the drive of this board",
            )
    return {**active, **file.gains}


def check_change(
    board: Board,
    active: Bank,
    wanted: Bank,
    large_steps: bool,
) -> None:
    """What is checked before gains are staged, and again before they are committed.

    Raises
    ------
    GainError
    """
    check_gains(wanted, active, board.limits())
    if not large_steps:
        check_factor(wanted, active)


def staged_whole(board: Board) -> dict[str, AxisGains]:
    """Gains in the shadow bank, as somebody staged them.

    Raises
    ------
    BoardError
        Nothing was staged, or not all of it arrived.
    """
    if not board.status().staged_crc_ok:
        raise BoardError(
            "no gains are staged, or they are incomplete", "stage gains: edge-ident gains stage"
        )
    return board.staged_gains()


def commit_staged(board: Board, drive: Drive, staged: Bank, observer: Observer) -> GainChange:
    """Move with the old gains, then with the new ones; keep these if no axis follows worse."""
    check_drive(board, drive)
    trajectory = named_trajectory(drive, "sinusoid", 1)
    with ready_to_move(board, observer.say):
        observer.stage("motion, old gains")
        capture = capture_motion(board, trajectory, observer.samples, say=observer.say)
        board.finish()
        before = MotionBefore(capture, trajectory, trajectory)
        return put_in_force(board, staged, before, observer)


def restore_gains(board: Board, drive: Drive, wanted: Bank, observer: Observer) -> GainChange:
    """Stage gains of before and put them in force; they stay if the drive moves without a fault.

    It does not move with the present gains, which may be the reason for the restoration.
    """
    check_drive(board, drive)
    trajectory = named_trajectory(drive, "sinusoid", 1)
    with ready_to_move(board, observer.say):
        after = _in_force(board, wanted, trajectory, observer, None, Stopwatch())
        _confirm_or_roll_back(board, keep=True)
    return GainChange(confirmed=True, tracking_after_rad=after.tracking_rms_rad)


def roll_back_unconfirmed(board: Board) -> None:
    """Take back what was committed and not confirmed.

    Raises
    ------
    BoardError
        There is nothing to take back.
    """
    if not board.status().unconfirmed:
        raise BoardError(
            "the active gains are confirmed: there is nothing to roll back",
            "to return to older gains, use edge-ident gains restore with a backup",
        )
    board.roll_back()


def check_owner(board: Board, file: GainFile) -> None:
    """Make sure that a backup goes back to the board that it came from.

    Raises
    ------
    DataError
    """
    owner, serial = file.serial_number, board.identity.serial_number
    if owner is not None and owner != serial:
        raise DataError(
            f"the backup is of board {owner}, this is board {serial}",
            "connect the right board; to copy gains to another board, use edge-ident gains stage",
        )


def _in_force(
    board: Board,
    wanted: Bank,
    trajectory: Trajectory,
    observer: Observer,
    file: Path | None,
    watch: Stopwatch,
) -> Capture:
    with watch.stage("last_sample_to_verified"):
        write_gains(board, wanted)
    observer.stage("verification motion")
    with watch.stage("verification"):
        return verification_motion(board, trajectory, observer, file)


def _confirm_or_roll_back(board: Board, *, keep: bool) -> None:
    if keep:
        board.confirm()
    else:
        board.roll_back()
    log.info("gains %s", "confirmed" if keep else "rolled back")

"""From gains in force to others: backed up, committed, verified by a motion, kept or taken back."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from edge_ident.commissioning.capture import capture_motion, check_drive
from edge_ident.commissioning.gain_files import GainFile
from edge_ident.commissioning.gain_transfer import (
    check_factor,
    check_gains,
    commit_gains,
    stage_gains,
)
from edge_ident.commissioning.run import Observer
from edge_ident.commissioning.safety import left_safe
from edge_ident.commissioning.verification import verification_motion
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.errors import BoardError, DataError
from firmware_interface.board import Board
from firmware_interface.gains import AxisGains, Bank

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class GainChange:
    """What a commit did.

    Attributes
    ----------
    tracking_before_rad : mapping of axis name to float, or None
        Rms; None where the drive did not move with the old gains first.
    tracking_after_rad : mapping of axis name to float
    confirmed : bool
        Whether the new gains stay.
    """

    tracking_before_rad: Mapping[str, float] | None
    tracking_after_rad: Mapping[str, float]
    confirmed: bool


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
                "give gains of the drive behind this board",
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
            "nothing is staged, or not all of it arrived", "stage gains: edge-ident gains stage"
        )
    return board.staged_gains()


def commit_staged(board: Board, drive: Drive, staged: Bank, observer: Observer) -> GainChange:
    """Move with the old gains, then with the new ones; keep these if no axis follows worse.

    Parameters
    ----------
    board : Board
        At rest, without unconfirmed gains (`edge_ident.commissioning.safety.make_ready`).
    """
    check_drive(board, drive)
    trajectory = named_trajectory(drive, "sinusoid", 1)
    with left_safe(board):
        observer.stage("motion, old gains")
        before = capture_motion(board, trajectory, observer.samples).tracking_rms_rad
        board.finish()
        after = _in_force(board, drive, staged, observer)
        worse = [axis for axis in after if after[axis] > before[axis]]
        _settle(board, keep=not worse)
    return GainChange(before, after, confirmed=not worse)


def restore_gains(board: Board, drive: Drive, wanted: Bank, observer: Observer) -> GainChange:
    """Stage gains of before and put them in force; they stay if the drive moves without a fault.

    It does not move with the present gains, which may be the reason for the restoration.
    """
    check_drive(board, drive)
    with left_safe(board):
        stage_gains(board, wanted)
        after = _in_force(board, drive, wanted, observer)
        _settle(board, keep=True)
    return GainChange(None, after, confirmed=True)


def roll_back_unconfirmed(board: Board) -> None:
    """Take back what was committed and not confirmed.

    Raises
    ------
    BoardError
        There is nothing to take back.
    """
    if not board.status().unconfirmed:
        raise BoardError(
            "the gains in force are confirmed: there is nothing to roll back",
            "bring older gains back with edge-ident gains restore and a backup",
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
            "connect the right board; to bring gains to another one: edge-ident gains stage",
        )


def _in_force(board: Board, drive: Drive, wanted: Bank, observer: Observer) -> dict[str, float]:
    commit_gains(board, wanted)
    observer.stage("motion, new gains")
    trajectory = named_trajectory(drive, "sinusoid", 1)
    return verification_motion(board, trajectory, observer.samples).tracking_rms_rad


def _settle(board: Board, *, keep: bool) -> None:
    settle: Callable[[], None] = board.confirm if keep else board.roll_back
    settle()
    log.info("gains %s", "confirmed" if keep else "rolled back")

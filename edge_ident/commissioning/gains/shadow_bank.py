"""The shadow bank: what somebody staged in it, and how that outlasts another use of the bank."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from edge_ident.errors import BoardError, EdgeIdentError
from edge_ident.support.interrupts import deaf_to_interrupts, uncut
from firmware_interface.board import Board
from firmware_interface.errors import BusyError, StoppedError
from firmware_interface.gains import AxisGains, Bank

log = logging.getLogger(__name__)

_STAGE: Final = "edge-ident gains stage"
_LOST: Final = f"the staged gains may be lost: stage them again with {_STAGE}"


def staged_whole(board: Board, active: Bank) -> dict[str, AxisGains]:
    """Gains in the shadow bank, as somebody staged them.

    Parameters
    ----------
    board : Board
    active : mapping of axis name to AxisGains
        In force.

    Raises
    ------
    BoardError
        Nothing was staged, not all of it arrived, or it is in force already.
    """
    if not board.status().staged_crc_ok:
        raise BoardError("no gains are staged, or they are incomplete", f"stage gains: {_STAGE}")
    staged = board.staged_gains()
    if staged == active:
        raise BoardError(
            "the staged gains are in force already: there is nothing to commit",
            f"stage other gains: {_STAGE}",
        )
    return staged


@contextmanager
@uncut
def staged_kept(board: Board) -> Iterator[None]:
    """Stage again what was staged before the body, however it ends; noted where that fails."""
    staged = board.staged_gains() if board.status().staged_crc_ok else None
    try:
        yield
        if staged is not None:
            board.stage_gains(staged)
    except BaseException as reason:
        with deaf_to_interrupts():
            if staged is not None and not _staged_again(board, staged, reason):
                reason.add_note(_LOST)
        raise


def confirm_window_s(board: Board) -> float:
    """How long the board waits for new gains to be confirmed.

    It tells only while gains wait, so those in force are committed once more and taken back.
    Nothing changes by that, and what was staged is staged again.
    """
    with staged_kept(board):
        board.stage_gains(board.active_gains())
        board.commit()
        window_s = board.status().confirm_remaining_s
        board.roll_back()
    return window_s


def _staged_again(board: Board, staged: Bank, reason: BaseException) -> bool:
    if isinstance(reason, BusyError | StoppedError):  # then another host may use the bank
        return False
    try:
        board.stage_gains(staged)
    except EdgeIdentError as error:
        log.error("stage again: %s", error.cause)
        return False
    return True

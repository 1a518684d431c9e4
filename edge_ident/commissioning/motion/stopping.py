"""Stops the machine from outside: at the board, and through the processes that have it open."""

import os
import time
from collections.abc import Callable
from typing import Final

from edge_ident.commissioning.link.port_notes import holders_of
from edge_ident.errors import BoardError, EdgeIdentError, LinkError
from firmware_interface.board import Board, BoardStatus
from firmware_interface.connection import open_link
from firmware_interface.registers import Result

_END_S: Final = 20.0
"""Longest time that a process takes to stop the machine, over a line on which much is lost."""
_OTHER_HOST_S: Final = 8.0
"""Longest time that another host has to switch the effort off and to let go of the board, on which
an older firmware leaves it its hold. One that says nothing more loses it sooner."""
_POLL_S: Final = 0.05
_LAST_RESORT: Final = "if the machine moves, use the wired emergency stop"
_END_OTHER: Final = "end that host's program, then: edge-ident stop"


def stop_machine(url: str, baud_rate: int, say: Callable[[str], None]) -> BoardStatus:
    """Bring the machine to rest, whoever moves it, switch the effort off, and end whoever began.

    The board is stopped, which ends the hold of the host that had it. Processes of this user that
    have it open are asked to end; where one has the port to itself, before the board is. Then stop
    and DISABLE are repeated until the board says that it stands without effort and that nobody else
    holds it. A host that vanished while the axes stood has left the effort on, for no watchdog runs
    at rest.

    Parameters
    ----------
    url, baud_rate
        See `firmware_interface.connection.open_link`.
    say : callable
        Takes what the person at the machine should know.

    Raises
    ------
    LinkError
        Neither the board nor the process that holds its port can be reached.
    BoardError
        The machine does not come to rest, or another host keeps the effort on, or the board.
    """
    try:
        board = _connected(url, baud_rate, say)
        try:
            _stop_once(board)
            try:
                _end_others(url, say)
            finally:  # also where one does not end
                status = _at_rest_for_good(board)
            return status
        finally:
            board.close()
    except EdgeIdentError as error:
        error.next_step = f"{_LAST_RESORT}; then {error.next_step}"
        raise


def _connected(url: str, baud_rate: int, say: Callable[[str], None]) -> Board:
    """The board; where another process of this user has the only connection, once it has ended."""
    try:
        return _board(url, baud_rate)
    except LinkError:
        if not _end_others(url, say):
            raise
    return _board(url, baud_rate)


def _board(url: str, baud_rate: int) -> Board:
    link = open_link(url, baud_rate=baud_rate)
    try:
        return Board.connect(link)
    except BaseException:
        link.close()
        raise


def _stop_once(board: Board) -> EdgeIdentError | None:
    """Stop, switch off, and let go; what went wrong."""
    try:
        board.quick_stop()
        if board.status().enabled:
            board.disable()
        board.release()
    except EdgeIdentError as error:
        return error
    return None


def _at_rest_for_good(board: Board) -> BoardStatus:
    """Stop and switch off until the board says so, and nobody else can move the machine.

    A board of map 6 or later ends an axis that shakes by itself, within its time of a stop.
    """
    deadline = time.monotonic() + _OTHER_HOST_S
    while True:
        late = time.monotonic() > deadline
        failed = _stop_once(board)
        try:
            status, held = board.status(), board.held_by_another()
        except EdgeIdentError:  # what stands in between may be busy, too
            if late:
                raise
            continue
        if status.at_rest and not status.enabled and not held:
            return status
        if late:
            raise _not_stopped(status, failed)
        time.sleep(_POLL_S)


def _not_stopped(status: BoardStatus, failed: EdgeIdentError | None) -> BoardError:
    if not status.at_rest:
        return BoardError(f"the board is {status.state.name}: it did not stop", _LAST_RESORT)
    if status.last_result is Result.NOT_AT_REST:
        return BoardError("an axis does not come to rest, and the effort stays on", _LAST_RESORT)
    if status.enabled:
        why = failed.cause if failed else "another host has switched it on again"
        return BoardError(f"the effort stays on: {why}", _END_OTHER)
    return BoardError("the effort is off, but another host keeps the board", _END_OTHER)


def _end_others(url: str, say: Callable[[str], None]) -> bool:
    """Ask the other processes of this user that have the board open to end; whether any had."""
    holders = [holder for holder in holders_of(url) if holder.pid != os.getpid()]
    for holder in holders:
        say(f"{holder} has {holder.device} open: asking it to stop the machine")
        if not holder.end(_END_S):
            raise LinkError(
                f"process {holder.pid}, which has {holder.device} open, does not end",
                f"end it: kill -9 {holder.pid}; then switch the effort off: edge-ident stop again",
            )
        say(f"process {holder.pid} has ended")
    return bool(holders)

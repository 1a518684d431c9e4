"""Stops the machine from outside: at the board, or through the process that holds its port."""

import time
from collections.abc import Callable
from typing import Final

from edge_ident.commissioning.link.port_notes import Holder, holder_of
from edge_ident.errors import BoardError, EdgeIdentError, LinkError
from firmware_interface.board import Board, BoardStatus
from firmware_interface.connection import open_link
from firmware_interface.errors import BusyError, OvertakenError
from firmware_interface.link import Link
from firmware_interface.registers import State

_END_S: Final = 20.0
"""Longest time that a process takes to stop the machine, over a line on which much is lost."""
_OTHER_HOST_S: Final = 5.0
"""Longest time that another host has, once the machine stands, to switch the effort off."""
_POLL_S: Final = 0.05
_LAST_RESORT: Final = "if the machine moves, use the wired emergency stop"


def stop_machine(url: str, baud_rate: int, say: Callable[[str], None]) -> BoardStatus:
    """Bring the machine to rest, whoever moves it, and switch the effort off.

    Where another process of this user holds the port, that one is asked to end, which stops the
    machine; then the board itself says whether it stands. A host that vanished while the axes stood
    has left the effort on, for no watchdog runs at rest. One that is alive has some seconds to
    switch it off itself, as `edge-ident` does when it is stopped.

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
        The machine does not come to rest, or another host keeps the effort on.
    """
    try:
        link = _opened(url, baud_rate, say)
        try:
            board = Board.connect(link)
            board.quick_stop()
            _switch_off(board)
            status = board.status()
            board.release()
        finally:
            link.close()
    except EdgeIdentError as error:
        error.next_step = f"{_LAST_RESORT}; then {error.next_step}"
        raise
    if status.state not in (State.IDLE, State.FAULT):
        raise BoardError(f"the board is {status.state.name}: it did not stop", _LAST_RESORT)
    return status


def _switch_off(board: Board) -> None:
    deadline = time.monotonic() + _OTHER_HOST_S
    while (status := board.status()).state is State.IDLE and status.enabled:
        try:
            board.disable()
        except (BusyError, OvertakenError) as error:
            if time.monotonic() > deadline:
                raise BoardError(
                    f"the machine stands, but the effort stays on: {error.cause}",
                    "end that host's program, then: edge-ident stop",
                ) from error
            time.sleep(_POLL_S)


def _opened(url: str, baud_rate: int, say: Callable[[str], None]) -> Link:
    try:
        return open_link(url, baud_rate=baud_rate)
    except LinkError:
        holder = holder_of(url)
        if holder is None:
            raise
    _end(holder, say)
    return open_link(url, baud_rate=baud_rate)


def _end(holder: Holder, say: Callable[[str], None]) -> None:
    say(f"process {holder.pid} has {holder.device} open: asking it to stop the machine")
    if not holder.end(_END_S):
        raise LinkError(
            f"process {holder.pid}, which has {holder.device} open, does not end",
            f"end it: kill -9 {holder.pid}",
        )
    say(f"process {holder.pid} has ended")

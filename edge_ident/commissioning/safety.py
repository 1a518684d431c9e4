"""Whatever happens, leave the machine stopped and its gains old or new.

This is order, not a safety function: the board's own limits, watchdog and confirm window act
when the host is gone.
"""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from edge_ident.errors import BoardError, EdgeIdentError
from edge_ident.support.interrupts import deaf_to_interrupts
from firmware_interface.board import Board
from firmware_interface.board_checks import fault_error
from firmware_interface.registers import Fault, State

log = logging.getLogger(__name__)


def make_ready(board: Board) -> None:
    """Bring a board that an earlier host left behind back to IDLE with confirmed gains.

    A host that vanished in the middle of a motion leaves the board stopped by its watchdog, in
    that fault: nothing is wrong with the machine, and a host is there again.

    Raises
    ------
    BoardError
        It is in another fault, or moving for somebody else.
    """
    status = board.status()
    if status.state is State.FAULT:
        if status.fault is not Fault.WATCHDOG:
            raise fault_error(status)
        log.warning("an earlier host vanished during a motion: clearing the watchdog's fault")
        board.clear_fault()
        status = board.status()
    if status.state in (State.MOVING, State.STOPPING):
        raise BoardError(
            f"the board is {status.state.name}: another host moves it",
            "wait for its end, or stop it with edge-ident stop",
        )
    if status.state is not State.IDLE or status.unconfirmed:
        log.warning("an earlier host left the board %s: cleaning up", status.state.name)
        board.quick_stop()


@contextmanager
def left_safe(board: Board) -> Iterator[None]:
    """Stop the machine and take back unconfirmed gains if the body does not end well."""
    try:
        yield
    except BaseException as reason:
        log.warning("ended early (%s): stopping the machine", type(reason).__name__)
        with deaf_to_interrupts():  # a second Ctrl-C must not cut the stop short
            _attempt("stop", board.quick_stop)
            _attempt("roll back", lambda: _roll_back_unconfirmed(board))
        raise


def _roll_back_unconfirmed(board: Board) -> None:
    if board.status().unconfirmed:
        board.roll_back()


def _attempt(what: str, action: Callable[[], None]) -> None:
    try:
        action()
        log.info("%s: done", what)
    except EdgeIdentError as error:
        # a second error must not hide the first; the board's own watchdog is behind this
        log.error("%s: %s", what, error.cause)

"""Whatever happens, leave the machine stopped, its effort as it was found, its gains old or new.

This is order, not a safety function: the board's own limits, watchdog and confirm window act
when the host is gone.
"""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Final

from edge_ident.errors import BoardError, EdgeIdentError
from edge_ident.support.interrupts import deaf_to_interrupts, ended_by_suspension, uncut
from edge_ident.support.words import listed
from firmware_interface.board import Board, BoardStatus
from firmware_interface.board_checks import fault_error
from firmware_interface.errors import StoppedError
from firmware_interface.gains import Bank
from firmware_interface.registers import Fault, State

log = logging.getLogger(__name__)

_MOVES: Final = (State.MOVING, State.DRAINING, State.STOPPING)
_STOP_S: Final = 4.0
"""Longest stop that follows a watchdog's end, with some to spare: a ramp, and 2 s more."""
_LEAVE_S: Final = 5.0
"""Longest time for which the machine is told to stop and switch off, until the board says so."""
_POLL_S: Final = 0.01
_OFF: Final = "axes disabled again"


@contextmanager
def ready_to_move(board: Board, say: Callable[[str], None]) -> Iterator[None]:
    """Hold a board that is ready, with effort on; afterwards as it was found, stopped in any case.

    Ctrl-Z ends that as well: no watchdog runs at rest, and a host that is suspended leaves the
    effort on.

    Parameters
    ----------
    board : Board
        Connected.
    say : callable
        Takes what the person at the machine should know.

    Raises
    ------
    BoardError
        It is in fault, or another host has it.
    """
    make_ready(board)
    status = board.status()
    unhomed = [axis for axis in board.axes if axis not in status.homed]
    if unhomed:
        say(
            f"not homed: {listed(unhomed)}. Positions count from where they stood when the board "
            "was switched on"
        )
    with ended_by_suspension(), board.beating(), left_safe(board, say), effort_on(board, say):
        yield


@contextmanager
def effort_on(board: Board, say: Callable[[str], None]) -> Iterator[None]:
    """Switch the effort on where it is off, and off again at the end where it was.

    Where the body does not end well, that is left to `left_safe`, which stops the machine before.
    """
    if board.status().enabled:
        say("the axes were enabled already, and stay so: edge-ident stop switches the effort off")
        yield
        return
    say(f"axes enabled ({', '.join(board.axes)}): the drives now produce effort")
    log.info("axes enabled")
    board.enable()
    yield
    board.disable()
    log.info("axes disabled")
    say(_OFF)


def make_ready(board: Board) -> None:
    """Hold a board and bring what an earlier host left behind to IDLE with confirmed gains.

    A host that vanished in the middle of a motion leaves the board moving until its watchdog stops
    it, then in that fault: nothing is wrong with the machine, and a host is there again. Whatever
    it began is ended, and its effort goes off. But where somebody has pressed the emergency stop
    since, a person has to clear it.

    One that vanished between motions may have left the effort on, which no watchdog guards. That
    looks like effort that somebody wants: it stays, and `effort_on` says so.

    Raises
    ------
    BoardError
        It is in another fault, or the emergency stop was pressed, or it moves for somebody else, or
        another host holds it.
    """
    found = _at_rest(board)  # what is armed is armed no longer once it is this host's
    board.claim()
    status = board.status()  # of now: the hold of a host that is gone may have lasted for seconds
    in_fault = status.state is State.FAULT
    if status.emergency_stop or (in_fault and status.fault is not Fault.WATCHDOG):
        raise fault_error(status)
    if in_fault:
        log.warning("an earlier host disappeared during a motion: clearing the watchdog fault")
        board.clear_fault()
    if not found.at_rest or status.unconfirmed:
        log.warning("an earlier host left the board %s: cleaning up", found.state.name)
        _end_of_abandoned(board)


def clear_fault(board: Board, say: Callable[[str], None]) -> None:
    """Clear the fault that a board is in, and say which; nothing where it is in none.

    Raises
    ------
    BoardError
        While this host waited for the board, something else has happened, which nobody has seen.
    """
    seen = board.status()
    if seen.fault:
        board.claim()
    found = board.status()
    if not found.fault:
        say("no fault")
        return
    if (found.fault, found.emergency_stop) != (seen.fault, seen.emergency_stop):
        raise fault_error(found)
    say(fault_error(found).cause)
    board.clear_fault()


def _end_of_abandoned(board: Board) -> None:
    """Stop what a host that is gone has begun; its effort too, for it will not switch that off."""
    board.quick_stop()
    board.disable()


def _at_rest(board: Board) -> BoardStatus:
    """Wait as long as a motion may go on whose host is gone; a live one fetches its pages."""
    (timeout_s,) = board.register_values("watchdog.timeout")
    fetched, deadline = -1.0, 0.0
    while (status := board.status()).state in _MOVES:
        (now_fetched,) = board.register_values("capture.pages_acknowledged")
        if status.state is State.DRAINING and now_fetched != fetched:
            fetched, deadline = now_fetched, 0.0
        deadline = deadline or time.monotonic() + timeout_s + _STOP_S
        if time.monotonic() > deadline:
            if status.state is not State.DRAINING:
                raise BoardError(
                    f"the board is {status.state.name}: another host is moving the machine",
                    "wait until the motion ends, or stop it with edge-ident stop",
                )
            log.warning("an earlier host disappeared before it had fetched all pages")
            _end_of_abandoned(board)
        time.sleep(_POLL_S)
    return status


@contextmanager
@uncut
def left_safe(board: Board, say: Callable[[str], None] | None = None) -> Iterator[None]:
    """Stop the machine, take back unconfirmed gains and switch off if the body does not end well.

    The effort goes off unless it was on before. This is repeated for some seconds, until the board
    says that it is so. A board that another host has taken over is left to it. What could not be
    done, and gains that are new, is noted on the exception.

    Parameters
    ----------
    board : Board
    say : callable, optional
        Takes that the effort is off again, where the body switches it on.
    """
    was_enabled, gains = board.status().enabled, board.active_gains()
    try:
        yield
    except BaseException as reason:
        with deaf_to_interrupts():  # a second Ctrl-C must not cut the stop short
            if _taken_over(board):
                raise
            log.warning("ended early (%s): stopping the machine", type(reason).__name__)
            stopped = isinstance(reason, StoppedError)  # by another host, which may hold it by now
            for note in _leave(board, was_enabled, gains, stopped=stopped):
                log.warning(note)
                reason.add_note(note)
            if say is not None and not was_enabled and _attempt("state", partial(_see_off, board)):
                say(_OFF)
        raise


def leave_confirmed(board: Board) -> None:
    """Stop after an interruption, with the gains that were confirmed last; the effort stays on."""
    with deaf_to_interrupts():
        if not board.status().at_rest:
            board.quick_stop()
        _roll_back_unconfirmed(board)


def stop_at_once(board: Board) -> bool:
    """Stop the machine; false where it could not be told to, which is noted."""
    return _attempt("stop", board.quick_stop)


def _taken_over(board: Board) -> bool:
    """Whether another host has the board; any device in between may say that it is busy.

    A host that surely holds it does not ask: a stop must not wait.
    """
    try:
        return not board.holds and board.held_by_another()
    except EdgeIdentError:
        return False


def _leave(board: Board, was_enabled: bool, gains: Bank, *, stopped: bool) -> list[str]:
    """Leave a machine in safety, and say what else its user has to know."""
    deadline, left, stops = time.monotonic() + _LEAVE_S, False, stopped
    while True:
        status = _told_to_rest(board, was_enabled, stop=not stops)
        if status is not None and status.at_rest and not status.unconfirmed:
            left = was_enabled or not status.enabled
        if left or time.monotonic() > deadline or _taken_over(board):
            break
        # a stop in place of another host's would end its hold
        stands = status is not None and (status.at_rest or status.state is State.STOPPING)
        stops = stopped and stands
        time.sleep(_POLL_S)
    notes: list[str] = []
    if board.has_committed and not (
        left and _attempt("gains", lambda: notes.append(_in_force(board, gains)))
    ):
        notes.append("which gains are in force is not known: look with edge-ident gains show")
    if board.has_stored:
        notes.append("the gains were stored in the board's permanent memory before this")
    if not left:
        notes.append(
            "the board could not be told to stop and to switch off: its axes may still produce "
            "effort. Use the wired emergency stop, or edge-ident stop once the board answers"
        )
    return notes


def _see_off(board: Board) -> None:
    if board.status().enabled:
        raise BoardError("the effort is on", "switch it off with edge-ident stop")


def _told_to_rest(board: Board, was_enabled: bool, *, stop: bool) -> BoardStatus | None:
    """Tell the board to stop, to take gains back and to switch off; what it says then."""
    if stop:
        stop_at_once(board)
    _attempt("roll back", lambda: _roll_back_unconfirmed(board))
    if not was_enabled:
        _attempt("disable", board.disable)
    try:
        return board.status()
    except EdgeIdentError:
        return None


def _roll_back_unconfirmed(board: Board) -> None:
    if board.status().unconfirmed:
        board.roll_back()


def _in_force(board: Board, before: Bank) -> str:
    if board.active_gains() == before:
        return "the gains of before are in force"
    return "new gains are in force: they were confirmed before this"


def _attempt(what: str, action: Callable[[], None]) -> bool:
    """Try to do something; say in the log what came of it."""
    try:
        action()
    except EdgeIdentError as error:
        # a second error must not hide the first; the board's own watchdog is behind this
        log.error("%s: %s", what, error.cause)
        return False
    log.info("%s: done", what)
    return True

"""Whatever happens, leave the machine stopped, its effort as it was found, its gains old or new.

This is order, not a safety function: the board's own limits, watchdog and confirm window act
when the host is gone.
"""

import logging
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Final

from edge_ident.commissioning.ports import holders_of
from edge_ident.errors import BoardError, EdgeIdentError, LinkError
from edge_ident.support.process import deaf_to_interrupts, ended_by_suspension, uncut
from edge_ident.support.words import listed
from firmware_interface.board import Board, BoardStatus
from firmware_interface.board_checks import fault_error
from firmware_interface.connection import open_link
from firmware_interface.errors import StoppedError
from firmware_interface.gains import Bank
from firmware_interface.registers import Fault, Result, State

log = logging.getLogger(__name__)


_MOVES: Final = (State.MOVING, State.DRAINING, State.STOPPING)
# Longest stop that follows a watchdog's end, with some to spare: a ramp, and 2 s more.
_STOP_S: Final = 4.0
# Longest time for which the machine is told to stop and switch off, until the board says so.
_LEAVE_S: Final = 5.0
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


# Stops the machine from outside: at the board, and through the processes that have it open.


# Longest time that a process takes to stop the machine, over a line on which much is lost.
_END_S: Final = 20.0
# Longest time that another host has to switch the effort off and to let go of the board, on which
# an older firmware leaves it its hold. One that says nothing more loses it sooner.
_OTHER_HOST_S: Final = 8.0
_REST_POLL_S: Final = 0.05
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
        time.sleep(_REST_POLL_S)


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

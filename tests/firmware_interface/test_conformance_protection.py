"""Both boards stop by themselves alike: limits, faults, the watchdog's two ways."""

from dataclasses import replace

import pytest
from board_bench import long_motion
from conformance_boards import (
    SPEED,
    BoardCommand,
    Served,
    ask,
    put_gains,
    serving,
    start,
    until_abandoned,
    until_fault,
)

from edge_ident.commissioning.safety import make_ready
from firmware_interface.board import Board, BoardStatus
from firmware_interface.codec import encode
from firmware_interface.errors import BoardError
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.motion import Staircase, Trajectory
from firmware_interface.registers import (
    MAP_CRC,
    REGISTERS,
    Fault,
    Opcode,
    Result,
    State,
    WatchdogAction,
)

LONG = replace(long_motion(), lead_in_s=2.0)
SOFT = replace(CONSERVATIVE_GAINS, proportional=6.0, derivative=0.0)
STIFF = replace(CONSERVATIVE_GAINS, proportional=360.0, derivative=0.0)
FAULTS = {
    # 6 N*m/rad lag by 0.6 rad against friction of 3.6 N*m, and more while speeding up
    Fault.FOLLOWING_ERROR: (SOFT, Staircase((2.4,), 3.0, 4.0)),
    # without damping a step of the speed overshoots
    Fault.SPEED: (STIFF, Staircase((0.1, 3.9), 0.5, 60.0)),
    # 2 N*m too much push a slow axis 0.15 rad ahead of a reference that ends 0.1 rad inside
    Fault.TRAVEL: (replace(SOFT, offset_feedforward=2.2), Staircase((0.1, 2.0, 0.05), 3.67, 2.0)),
}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_limits_are_enforced_during_the_motion(fresh_board: Board, fault: Fault) -> None:
    gains, stairs = FAULTS[fault]
    put_gains(fresh_board, dict.fromkeys("xz", gains))
    start(fresh_board, Trajectory({"x": stairs, "z": stairs}, 15.0, 2.0))
    assert until_fault(fresh_board) is fault
    status = fresh_board.status()
    assert 0 < status.fault_sample <= status.clock_samples
    assert not status.enabled


def watchdog(board: Board, timeout_s: float, action: WatchdogAction) -> None:
    """Set both."""
    words = encode("watchdog.timeout", timeout_s) + encode("watchdog.action", action)
    board._link.write(REGISTERS["watchdog.timeout"].address, words)


def test_a_fault_stays_until_it_is_cleared(either_board: Board) -> None:
    watchdog(either_board, 0.1, WatchdogAction.QUICK_STOP)
    start(either_board, LONG)
    until_abandoned(either_board, lambda status: status.state is State.FAULT)
    for opcode in (Opcode.ARM, Opcode.COMMIT, Opcode.FINISH, Opcode.START, Opcode.ENABLE):
        assert ask(either_board, opcode, MAP_CRC) is Result.WRONG_STATE
    either_board.quick_stop()
    assert either_board.status().fault is Fault.WATCHDOG
    either_board.clear_fault()
    status = either_board.status()
    assert (status.state, status.fault, status.fault_sample) == (State.IDLE, Fault.NONE, 0)


@pytest.mark.parametrize(
    ("action", "state"),
    [(WatchdogAction.QUICK_STOP, State.STOPPING), (WatchdogAction.COAST, State.FAULT)],
    ids=lambda code: code.name,
)
def test_the_board_stops_by_itself_when_the_host_is_gone(
    command_of_either: BoardCommand, action: WatchdogAction, state: State
) -> None:
    """Under control for a quarter of a second of the board's own clock, or at once without effort.

    Five times slower than time, so that somebody who looks on sees it.
    """
    stop_samples = 80
    with serving(command_of_either(speed=0.2)) as served, served.connected() as board:
        watchdog(board, 0.1, action)
        while True:
            start(board, replace(LONG, lead_in_s=0.1))
            status = until_abandoned(board, lambda status: status.fault is not Fault.NONE)
            assert status.fault is Fault.WATCHDOG
            if status.clock_samples - status.fault_sample < stop_samples:
                break  # seen soon enough
            board.clear_fault()
        assert status.state is state
        assert status.enabled is (state is State.STOPPING)
        assert until_fault(board) is Fault.WATCHDOG
        board.clear_fault()  # carried out at rest only


def tap_stop(served: Served, board: Board) -> BoardStatus:
    """Press the wired emergency stop and release it; gives what the board says a sample later."""
    served.press_stop(True)
    until_abandoned(board, lambda status: status.sto_active)
    served.press_stop(False)
    released = until_abandoned(board, lambda status: not status.sto_active)
    later = released.clock_samples + 1
    return until_abandoned(board, lambda status: status.clock_samples > later)


def test_the_first_fault_stays_beside_the_emergency_stop(command_of_either: BoardCommand) -> None:
    gains, stairs = FAULTS[Fault.FOLLOWING_ERROR]
    with serving(command_of_either()) as served, served.connected() as board:
        put_gains(board, dict.fromkeys("xz", gains))
        start(board, Trajectory({"x": stairs, "z": stairs}, 15.0, 2.0))
        until_fault(board)
        before, after = board.status(), tap_stop(served, board)
        assert (after.fault, after.fault_sample) == (Fault.FOLLOWING_ERROR, before.fault_sample)
        assert after.sto_latched
        board.clear_fault()
        assert not board.status().sto_latched


@pytest.mark.parametrize("state", [State.STOPPING, State.FAULT], ids=lambda state: state.name)
def test_no_host_takes_the_emergency_stop_for_a_fault_of_the_watchdog(
    command_of_either: BoardCommand, state: State
) -> None:
    """Pressed while the axes decelerate, where that is seen in time, or once they stand."""
    speed = 0.2 if state is State.STOPPING else SPEED
    with serving(command_of_either(speed=speed)) as served, served.connected() as board:
        watchdog(board, 0.1, WatchdogAction.QUICK_STOP)
        start(board, replace(LONG, lead_in_s=0.1))
        before = until_abandoned(board, lambda status: status.state in (state, State.FAULT))
        assert before.fault is Fault.WATCHDOG
        after = tap_stop(served, board)
        assert (after.state, after.fault, after.sto_latched) == (State.FAULT, Fault.STO, True)
        assert after.fault_sample > before.fault_sample
        for _ in range(2):
            with pytest.raises(BoardError, match="the wired emergency stop cut the effort"):
                make_ready(board)
        assert board.status().sto_latched
        board.clear_fault()
        make_ready(board)
        assert not board.status().sto_latched

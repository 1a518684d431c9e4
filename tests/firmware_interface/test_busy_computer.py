"""On a computer that is busy with other things, a run ends as on a quiet one, in real time."""

import signal
import time
from pathlib import Path

import pytest
from board_bench import long_motion
from conformance_boards import BoardCommand, serving, start, until

from firmware_interface.registers import State
from tools.busy_runs import runs


@pytest.mark.real_time
@pytest.mark.thorough
def test_a_run_beside_four_busy_processes_ends_well(
    command_of_either: BoardCommand, tmp_path: Path
) -> None:
    (ended,) = runs(command_of_either(speed=1.0), 1, 4, tmp_path)
    assert ended.exit_code == 0, ended


@pytest.mark.real_time
def test_a_board_that_was_held_up_does_not_take_its_host_for_silent(
    command_of_either: BoardCommand,
) -> None:
    """For three times as long as its watchdog waits."""
    with serving(command_of_either(speed=1.0)) as served, served.connected() as board:
        start(board, long_motion())
        board.heartbeat()
        served.process.send_signal(signal.SIGSTOP)
        time.sleep(3.0)
        served.process.send_signal(signal.SIGCONT)
        board.heartbeat()
        assert board.status().state is State.MOVING
        board.quick_stop()
        until(board, lambda status: status.state is State.IDLE)
        board.disable()

"""A command that comes late finds another host at work: it is refused, and stops nobody."""

from collections.abc import Callable

import pytest
from board_bench import NEW, Bench, long_motion

from firmware_interface import board_session
from firmware_interface.codec import encode
from firmware_interface.errors import StoppedError
from firmware_interface.registers import REGISTERS, SESSION_LEASE_S, Opcode, Result

Verb = Callable[[Bench], object]


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board_session, "POLL_S", 0.0)


def late(bench: Bench, opcode: Opcode) -> None:
    """What a host that has given up had sent arrives."""
    words = encode("command.opcode", opcode) + encode("command.token", 54321)
    words += encode("command.argument", 0) + encode("command.key", 4711)
    bench.virtual.write(REGISTERS["command.opcode"].address, words)
    if opcode is not Opcode.QUICK_STOP:
        assert bench.board.status().last_result is Result.NOT_HELD


@pytest.mark.parametrize(
    "verb",
    [
        lambda b: b.board.disable(),
        lambda b: b.board.stage_gains(NEW),
        lambda b: b.arm(long_motion()),
    ],
)
def test_a_late_command_that_is_refused_ends_nobody(verb: Verb) -> None:
    bench = Bench()
    bench.board.enable()
    late(bench, Opcode.ENABLE)
    verb(bench)
    bench.board.quick_stop()
    bench.wait(SESSION_LEASE_S / 2.0 + 0.1)
    bench.board.disable()


def test_a_late_stop_is_a_stop() -> None:
    bench = Bench()
    bench.board.enable()
    late(bench, Opcode.QUICK_STOP)
    with pytest.raises(StoppedError):
        bench.board.enable()


def test_after_a_silence_any_command_counts_for_the_board_may_have_been_used() -> None:
    bench = Bench()
    bench.board.enable()
    bench.wait(SESSION_LEASE_S + 0.1)
    late(bench, Opcode.ENABLE)
    with pytest.raises(StoppedError, match="has used the board"):
        bench.board.stage_gains(NEW)

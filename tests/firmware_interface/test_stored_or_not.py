"""Whether gains are stored is said, whatever ends a command after that."""

import pytest
from board_bench import Bench

from edge_ident.commissioning.gain_change import roll_back_unconfirmed
from edge_ident.commissioning.safety import left_safe
from firmware_interface import board_session
from firmware_interface.errors import BusyError, NoReplyError, RestartedError
from firmware_interface.registers import REGISTERS


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask the board as fast as it answers: its time goes by requests."""
    monkeypatch.setattr(board_session, "POLL_S", 0.0)


def confirmed() -> Bench:
    bench = Bench()
    bench.board.enable()
    bench.commit()
    bench.board.confirm()
    return bench


@pytest.mark.parametrize(
    "ends",
    [
        NoReplyError("no reply", "check cable and power of the board"),
        BusyError("a gateway is busy", "wait"),
        RestartedError(1),
        KeyboardInterrupt(),
    ],
    ids=lambda ends: type(ends).__name__,
)
def test_a_store_that_could_not_be_asked_about_may_have_been_made(
    ends: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = confirmed()
    write = bench.virtual.write

    def last_words(address: int, words: list[int]) -> None:
        write(address, words)
        if address == REGISTERS["command.opcode"].address:
            monkeypatch.setattr(bench.virtual, "read", silent)

    def silent(address: int, count: int) -> list[int]:
        raise ends

    monkeypatch.setattr(bench.virtual, "write", last_words)
    with pytest.raises(type(ends)) as caught:
        bench.board.store()
    assert "whether the gains are stored is not known" in caught.value.__notes__[0]
    assert not bench.board.has_stored


@pytest.mark.parametrize("stored", [False, True])
def test_what_fails_after_the_store_says_that_it_was_made(stored: bool) -> None:
    bench = confirmed()
    if stored:
        bench.board.store()
    failure = RuntimeError()
    with pytest.raises(RuntimeError), left_safe(bench.board):
        raise failure
    assert ("permanent memory" in "; ".join(failure.__notes__)) == stored


@pytest.mark.parametrize("ends", [NoReplyError("no reply", "look"), KeyboardInterrupt()])
def test_a_roll_back_that_is_cut_short_says_that_nobody_knows(
    ends: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench()
    bench.board.enable()
    bench.commit()

    def cut() -> None:
        raise ends

    monkeypatch.setattr(bench.board, "roll_back", cut)
    with pytest.raises(type(ends)) as caught:
        roll_back_unconfirmed(bench.board)
    assert "which gains are in force is not known" in caught.value.__notes__[0]

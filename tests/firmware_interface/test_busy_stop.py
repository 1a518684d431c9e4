"""`edge-ident stop` over a gateway that says for a while that it is busy."""

import pytest
from board_bench import Bench

from edge_ident.commissioning.safety import _at_rest_for_good
from firmware_interface import board_session
from firmware_interface.errors import BusyError


def test_a_busy_gateway_does_not_end_the_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board_session, "POLL_S", 0.0)
    bench = Bench()
    bench.board.enable()
    bench.board.release()
    read, busy = bench.virtual.read, [True] * 5

    def sometimes_busy(address: int, count: int) -> list[int]:
        if busy and busy.pop():
            raise BusyError("refused (Modbus exception 6)", "wait")
        return list(read(address, count))

    monkeypatch.setattr(bench.virtual, "read", sometimes_busy)
    assert not _at_rest_for_good(bench.board).enabled
    assert not bench.virtual.machine.enabled

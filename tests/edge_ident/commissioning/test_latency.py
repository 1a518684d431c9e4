"""What a profile measures and counts, and what it says where a process of its own fails."""

from contextlib import nullcontext
from pathlib import Path

import pytest

from edge_ident.commissioning.latency import measure
from edge_ident.commissioning.latency.measure import MOST_MOTIONS
from edge_ident.commissioning.latency.result import ProfileRun
from edge_ident.commissioning.latency.ways import measured_ways
from edge_ident.errors import BoardError
from edge_ident.estimation.network import load_network
from edge_ident.simulation.simulate import simulate
from firmware_interface.board import Board
from firmware_interface.virtual.board import VirtualBoard
from tests.short_runs import Listening, Silent


def test_the_cause_of_a_cold_process_that_fails_is_said(tmp_path: Path) -> None:
    with pytest.raises(BoardError) as caught:
        measure._cold("virtual", None, tmp_path / "no.npz", load_network(), 1, Silent())
    assert "no.npz" in caught.value.cause


class Counting(Listening):
    """Keeps what was counted, too."""

    def __init__(self) -> None:
        super().__init__()
        self.counted: list[tuple[int, int]] = []

    def samples(self, in_hand: int, expected: int) -> None:
        self.counted.append((in_hand, expected))


def test_every_motion_of_both_ways_is_counted_from_the_first_on() -> None:
    """What is left follows from the first count."""
    observer, board = Counting(), Board.connect(VirtualBoard())
    found = measured_ways(board, simulate(), load_network(), 2, observer)
    assert {way: len(times) for way, times in found.items()} == {"at_rest": 2, "running": 2}
    assert observer.counted == [(done, 4) for done in range(5)]


@pytest.mark.parametrize(("wanted", "made"), [(3, 3), (10, MOST_MOTIONS)])
def test_fewer_motions_than_repetitions_are_said(
    monkeypatch: pytest.MonkeyPatch, wanted: int, made: int
) -> None:
    asked: list[int] = []

    def measured(board: object, recording: object, network: object, repetitions: int, _: object):
        asked.append(repetitions)
        return {"at_rest": [200.0] * repetitions, "running": [50.0] * repetitions}

    run = ProfileRun("warm", "fp32", "image", {"total": [1.0]})
    monkeypatch.setattr(measure, "_board_process", lambda device: nullcontext("there"))
    monkeypatch.setattr(measure, "_connected", lambda *_: nullcontext(None))
    monkeypatch.setattr(measure, "noted", lambda url: nullcontext())
    monkeypatch.setattr(measure, "_record", lambda *_: (1.0, 1.0))
    monkeypatch.setattr(measure, "load_recording", lambda file: None)
    monkeypatch.setattr(measure, "measured_ways", measured)
    monkeypatch.setattr(measure, "_warm", lambda *_: run)
    monkeypatch.setattr(measure, "_cold", lambda *_: run)
    observer = Listening()
    profile = measure.profile_device(None, None, wanted, observer)
    assert asked == [made]
    assert f"p50 of {made}" in profile.ways
    assert any(f"{made} repetitions" in said for said in observer.said) == (made < wanted)

"""What a profile measures and counts, and what it says where a process of its own fails."""

import os
import subprocess
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from interrupted_link import InterruptedLink
from old_gains import assert_old_gains

from edge_ident.commissioning import latency
from edge_ident.commissioning.capture import Capture, capture_motion
from edge_ident.commissioning.latency import MOST_MOTIONS, ProfileRun, measured_ways
from edge_ident.drive.description import Drive, load_drive
from edge_ident.errors import BoardError, DataError
from edge_ident.estimation.network import load_network
from edge_ident.signals.recording_files import load_recording
from edge_ident.simulation.simulate import simulate
from firmware_interface.board import Board
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.motion import Trajectory
from firmware_interface.virtual.board import VirtualBoard
from tests.short_runs import Listening, Silent, brief_drive

STAGED = 35.0
"""Proportional gain in the shadow bank."""


def test_the_cause_of_a_cold_process_that_fails_is_said(tmp_path: Path) -> None:
    with pytest.raises(BoardError) as caught:
        latency._cold("virtual", None, tmp_path / "no.npz", load_network(), 1, Silent())
    assert "no.npz" in caught.value.cause


def small_drive() -> Drive:
    """The built-in drive on a tenth of its motion, within a tenth of its travel."""
    drive = brief_drive()
    axes = {
        name: replace(axis, amplitude_rad=0.1 * axis.amplitude_rad)
        for name, axis in drive.axes.items()
    }
    return replace(drive, axes=axes)


SLOW_TO_END = """
import json, pathlib, signal, sys, time

def end(*_):
    time.sleep(0.5)
    print(json.dumps({"cause": "told to", "next_step": "start it", "notes": ["all is tidy"]}))
    sys.exit()

signal.signal(signal.SIGTERM, end)
pathlib.Path(sys.argv[3]).touch()
time.sleep(60.0)
"""


def test_a_cold_process_has_time_to_leave_the_board_as_it_was(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    began = tmp_path / "began"
    (tmp_path / "slow_to_end.py").write_text(SLOW_TO_END)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(latency, "_MODULE", "slow_to_end")

    class Interrupted(subprocess.Popen[str]):
        """Is interrupted while the process is at its work."""

        def communicate(self, input: str | None = None, timeout: float | None = None) -> Any:
            while timeout is None and not began.exists():
                assert self.poll() is None
            if timeout is None:
                assert os.getsid(self.pid) == self.pid  # no terminal sends it Ctrl-C as well
                raise KeyboardInterrupt
            return super().communicate(input, timeout)

    monkeypatch.setattr(subprocess, "Popen", Interrupted)
    with pytest.raises(KeyboardInterrupt) as caught:
        latency.cold_ms("there", 115200, began, "fp32")
    assert caught.value.__notes__ == ["all is tidy"]


def stage(board: Board) -> None:
    gains = replace(CONSERVATIVE_GAINS, proportional=STAGED)
    board.stage_gains(dict.fromkeys(("x", "z"), gains))


def test_an_interrupted_cold_process_leaves_what_was_staged(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    virtual, file = VirtualBoard(), tmp_path / "capture.npz"
    board = Board.connect(virtual)
    latency._record(board, brief_drive(), file, Silent())
    stage(board)
    board.release()
    link = InterruptedLink(virtual, "asking for the window", KeyboardInterrupt)
    link.starts = 1
    monkeypatch.setattr(latency, "open_link", lambda *_, **__: link)
    with pytest.raises(KeyboardInterrupt):
        latency._measure("there", "115200", str(file), "fp32", "0")
    assert link.struck
    assert_old_gains(virtual)
    board = Board.connect(virtual)
    assert board.status().session_remaining_s == 0.0
    assert board.staged_gains()["x"].proportional == STAGED


def test_what_was_staged_is_staged_again() -> None:
    virtual, network, recording = VirtualBoard(), load_network(), simulate()
    board = Board.connect(virtual)
    stage(board)
    measured_ways(board, load_drive(), recording, network, 1, Silent())
    assert board.staged_gains()["x"].proportional == STAGED
    latency._warm(board, recording, network, 1, Silent())
    assert board.staged_gains()["x"].proportional == STAGED
    assert_old_gains(virtual)


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
    found = measured_ways(board, load_drive(), simulate(), load_network(), 2, observer)
    assert {way: len(times) for way, times in found.items()} == {"at_rest": 2, "running": 2}
    assert observer.counted == [(done, 4) for done in range(5)]


@pytest.mark.parametrize(("wanted", "made"), [(3, 3), (10, MOST_MOTIONS)])
def test_fewer_motions_than_repetitions_are_said(
    monkeypatch: pytest.MonkeyPatch, wanted: int, made: int
) -> None:
    asked: list[int] = []

    def measured(*given: Any) -> dict[str, list[float]]:
        repetitions = given[-2]
        asked.append(repetitions)
        return {"at_rest": [200.0] * repetitions, "running": [50.0] * repetitions}

    run = ProfileRun("warm", "fp32", "image", {"total": [1.0]})
    monkeypatch.setattr(latency, "_board_process", lambda device: nullcontext("there"))
    monkeypatch.setattr(latency, "_connected", lambda *_: nullcontext(None))
    monkeypatch.setattr(latency, "noted", lambda url: nullcontext())
    monkeypatch.setattr(latency, "_record", lambda *_: (1.0, 1.0))
    monkeypatch.setattr(latency, "load_recording", lambda file: None)
    monkeypatch.setattr(latency, "measured_ways", measured)
    monkeypatch.setattr(latency, "_warm", lambda *_: run)
    monkeypatch.setattr(latency, "_cold", lambda *_: run)
    observer = Listening()
    profile = latency.profile_device(None, None, load_drive(), wanted, observer)
    assert asked == [made]
    assert f"p50 of {made}" in profile.ways
    assert any(f"{made} repetitions" in said for said in observer.said) == (made < wanted)


def test_the_axes_move_as_the_drive_that_is_given_does(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    board, drive, moved = Board.connect(VirtualBoard()), small_drive(), list[Trajectory]()
    file = tmp_path / "capture.npz"
    latency._record(board, drive, file, Silent())
    for name, axis in load_recording(file).axes.items():
        assert axis.reference is not None
        amplitude_rad = drive.axes[name].amplitude_rad
        assert np.max(np.abs(axis.reference)) == pytest.approx(amplitude_rad, rel=0.01)

    def captured(board: Board, motion: Trajectory, *given: Any, **more: Any) -> Capture:
        moved.append(motion)
        return capture_motion(board, motion, *given, **more)

    monkeypatch.setattr(latency, "capture_motion", captured)
    measured_ways(board, drive, simulate(), load_network(), 1, Silent())
    assert [motion.axes for motion in moved] == 2 * [drive.trajectory().axes]


def test_nothing_moves_where_board_and_drive_description_differ(tmp_path: Path) -> None:
    virtual = VirtualBoard()
    board, drive = Board.connect(virtual), replace(small_drive(), sampling_period_s=0.001)
    with pytest.raises(DataError, match="sampling period"):
        latency._record(board, drive, tmp_path / "capture.npz", Silent())
    with pytest.raises(DataError, match="sampling period"):
        measured_ways(board, drive, simulate(), load_network(), 1, Silent())
    assert not board.status().pages_written
    assert not board.status().enabled


def test_a_measurement_that_fails_names_no_file_that_goes_with_it(tmp_path: Path) -> None:
    link = InterruptedLink(VirtualBoard(), "identification capture", KeyboardInterrupt)
    observer = Listening()
    with pytest.raises(KeyboardInterrupt):
        latency._record(Board.connect(link), small_drive(), tmp_path / "capture.npz", observer)
    assert not any("saved" in said for said in observer.said)
    assert not [*tmp_path.iterdir()]

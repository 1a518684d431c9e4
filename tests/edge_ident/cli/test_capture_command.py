"""A capture alone: a recording that other commands read, and nothing believed that cannot be."""

from dataclasses import replace
from datetime import datetime, tzinfo
from pathlib import Path
from typing import Self

import numpy as np
import pytest

from edge_ident.cli import sessions
from edge_ident.signals.recording_files import load_recording
from firmware_interface.codec import decode_page, encode_page
from firmware_interface.registers import PAGE_ADDRESS, State
from firmware_interface.virtual.board import VirtualBoard
from tests.edge_ident.shared_board import SharedBoard


def test_a_capture_is_a_recording_and_changes_no_gains(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shared = SharedBoard(monkeypatch)
    gains = shared.board.active_gains()
    document = shared.json("capture", "--output", tmp_path)
    recording = load_recording(Path(document["file"]))
    assert len(recording.time_s) == document["samples"] == 8742
    for axis, rms in document["tracking_rms_rad"].items():
        record = recording.axes[axis]
        assert np.sqrt(np.mean((record.reference - record.position) ** 2)) == pytest.approx(rms)
    assert shared.board.active_gains() == gains
    assert shared.board.status().state is State.IDLE
    assert {path.name for path in tmp_path.iterdir()} == {"capture.npz", "capture.json", "log.txt"}


def test_sessions_of_one_second_have_folders_of_their_own(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    class Stopped(datetime):
        @classmethod
        def now(cls, tz: tzinfo | None = None) -> Self:
            return cls(2026, 1, 2, 3, 4, 5, tzinfo=tz)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sessions, "datetime", Stopped)
    shared = SharedBoard(monkeypatch)
    begun = "edge-ident-runs/2026-01-02T03-04-05"
    for folder in (begun, f"{begun}-2", f"{begun}-3"):
        assert shared.json("capture")["file"] == f"{folder}/capture.npz"


class JumpingBoard(VirtualBoard):
    """Its encoder jumps far away on one page, whose CRC is right."""

    def read(self, address: int, count: int) -> list[int]:
        words = super().read(address, count)
        if address == PAGE_ADDRESS + 5 * 128:
            page = decode_page(words)
            words = encode_page(replace(page, position=page.position + 2_000_000_000))
        return words


def test_positions_that_cannot_be_end_the_capture_with_their_row(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shared = SharedBoard(monkeypatch)
    shared.virtual = JumpingBoard()
    code, stdout, errors = shared.run("capture", "--output", tmp_path)
    assert (code, stdout) == (5, "")
    assert "jumps" in errors
    assert shared.board.status().state is State.IDLE

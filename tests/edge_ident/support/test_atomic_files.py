"""Files are there whole or not at all, whatever interrupts their writing."""

import os
from pathlib import Path

import numpy as np
import pytest

from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording, save_recording
from edge_ident.support.atomic_files import atomic_write
from edge_ident.support.json_text import write_json


def recording(samples: int) -> Recording:
    time_s = 0.01 * np.arange(samples)
    axis = AxisRecord(np.sin(time_s), np.cos(time_s), "rad", "N*m")
    return Recording(time_s, {"x": axis}, "test")


def test_a_full_disk_leaves_the_file_of_before(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "a.json"
    write_json({"n": 1}, path)
    with pytest.raises(OSError, match="No space left"):
        write_half(path)
    assert path.read_text() == '{\n  "n": 1\n}\n'
    assert list(path.parent.iterdir()) == [path]


def test_two_processes_do_not_write_to_one_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with atomic_write(tmp_path / "a") as mine, monkeypatch.context() as other:
        other.setattr(os, "getpid", lambda: 1)
        with atomic_write(tmp_path / "a") as others:
            assert mine != others
            others.touch()
        mine.touch()


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    for folder in (tmp_path, Path()):
        with pytest.raises(IsADirectoryError), atomic_write(folder):
            pass


def write_half(path: Path) -> None:
    with atomic_write(path) as partial:
        partial.write_text('{"n": ')
        raise OSError(28, "No space left on device")


@pytest.mark.parametrize("name", ["a.npz", "a.csv"])
def test_a_recording_that_cannot_be_written_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = tmp_path / name
    save_recording(recording(400), path)
    content = path.read_bytes()

    def full(file: object, *_: object, **__: object) -> None:
        if isinstance(file, Path):
            file.write_bytes(b"half of it")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    monkeypatch.setattr(np, "savetxt", full)
    with pytest.raises(OSError, match="No space left"):
        save_recording(recording(500), path)
    assert path.read_bytes() == content
    assert len(load_recording(path).time_s) == 400
    assert list(tmp_path.iterdir()) == [path]

"""Files are there whole or not at all, whatever interrupts their writing."""

import os
from pathlib import Path

import numpy as np
import pytest

from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording, save_recording
from edge_ident.support.documents import atomic_write, write_json


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


@pytest.fixture
def on_disk(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What the disk has been waited for, in turn, with its content if it is a file."""
    waited_for = list[str]()

    def fsync(number: int) -> None:
        where = Path(f"/proc/self/fd/{number}").resolve()
        waited_for.append(where.name if where.is_dir() else where.read_text())

    monkeypatch.setattr(os, "fsync", fsync)
    return waited_for


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="no /proc here")
def test_a_document_is_on_the_disk_before_it_has_its_name(
    on_disk: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the backup of the gains, which a power cut may follow at any moment."""
    replace = Path.replace

    def named(partial: Path, path: Path) -> Path:
        on_disk.append("named")
        return replace(partial, path)

    monkeypatch.setattr(Path, "replace", named)
    write_json({"n": 1}, tmp_path / "a.json")
    assert on_disk == ['{\n  "n": 1\n}\n', "named", tmp_path.name]


def test_a_capture_does_not_wait_for_the_disk(on_disk: list[str], tmp_path: Path) -> None:
    """The axes may still move when it is saved, and the watchdog runs."""
    save_recording(recording(400), tmp_path / "a.npz")
    assert not on_disk


def test_a_disk_that_fails_leaves_the_file_of_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.json"
    write_json({"n": 1}, path)

    def failing(number: int) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", failing)
    with pytest.raises(OSError, match=r"Input/output error: '.*a\.json'"):
        write_json({"n": 2}, path)
    assert path.read_text() == '{\n  "n": 1\n}\n'
    assert list(tmp_path.iterdir()) == [path]


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

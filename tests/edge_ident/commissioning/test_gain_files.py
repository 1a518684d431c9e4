"""Backups and designs as files: what is written comes back, and nothing else is taken for gains."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from edge_ident.commissioning.gain_transfer import back_up, keep_backup, load_gains
from edge_ident.errors import DataError
from firmware_interface.board import Board
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.settings import BoardSettings

GAINS = {
    "x": replace(CONSERVATIVE_GAINS, ripple_cosine=(0.5, 0.0, -0.25, 0.0)),
    "z": CONSERVATIVE_GAINS,
}


def test_a_backup_comes_back_as_it_was(tmp_path: Path) -> None:
    identity = Board.connect(VirtualBoard(BoardSettings(serial_number=77))).identity
    first, second = (back_up(GAINS, identity, tmp_path / "backups") for _ in range(2))
    assert first != second
    assert first.name.startswith("board-77-20")
    loaded = load_gains(first)
    assert loaded.gains == GAINS
    assert loaded.serial_number == 77
    assert {path.name for path in first.parent.iterdir()} == {first.name, second.name}


def test_the_backup_of_a_run_is_written_again_and_never_over_another(tmp_path: Path) -> None:
    identity = Board.connect(VirtualBoard()).identity
    keep_backup(GAINS, identity, tmp_path)
    kept = (tmp_path / "gains_before.json").read_bytes()
    keep_backup(GAINS, identity, tmp_path)
    with pytest.raises(DataError, match="of another run"):
        keep_backup({**GAINS, "x": CONSERVATIVE_GAINS}, identity, tmp_path)
    with pytest.raises(DataError, match="of another run"):
        keep_backup(GAINS, replace(identity, serial_number=77), tmp_path)
    assert (tmp_path / "gains_before.json").read_bytes() == kept
    (tmp_path / "gains_before.json").unlink()
    keep_backup(GAINS, identity, tmp_path)
    assert load_gains(tmp_path / "gains_before.json").gains == GAINS


def test_a_design_document_holds_gains_too(tmp_path: Path) -> None:
    path = write(tmp_path, {"schema": "edge-ident/gains/1", "axes": {"x": {"gains": entry()}}})
    loaded = load_gains(path)
    assert loaded.gains == {"x": CONSERVATIVE_GAINS}
    assert loaded.serial_number is None


@pytest.mark.parametrize("owner", ["2", True, None, 1.0])
def test_a_backup_without_an_owner_is_refused(tmp_path: Path, owner: Any) -> None:
    path = write(tmp_path, backup(entry()) | {"serial_number": owner})
    with pytest.raises(DataError, match="serial_number is"):
        load_gains(path)


def test_a_backup_of_before_the_effects_had_terms_is_read(tmp_path: Path) -> None:
    short = {name: value for name, value in entry().items() if "ripple" not in name}
    path = write(tmp_path, backup(short))
    assert load_gains(path).gains["x"].ripple_sine == (0.0,) * 4


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ([], "schema is None"),
        ({"schema": "edge-ident/run/1"}, "schema is 'edge-ident/run/1'"),
        ({"schema": "edge-ident/gain-backup/1", "axes": {}}, "contains no gains"),
        ({"schema": "edge-ident/gain-backup/1", "axes": {"x": 3}}, "axis x has no gains"),
        ({"schema": "edge-ident/gains/1", "axes": {"x": {}}}, "axis x has no gains"),
    ],
)
def test_other_documents_are_refused(tmp_path: Path, document: Any, message: str) -> None:
    with pytest.raises(DataError, match=message):
        load_gains(write(tmp_path, document))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"proportional": "30"}, "proportional is '30', not a finite number"),
        ({"proportional": True}, "proportional is True"),
        ({"proportional": float("nan")}, "proportional is nan"),
        ({"proportional": 10**400}, "not a finite number"),
        ({"derivative": None}, "derivative is None"),
        ({"ripple_sine": [0.0]}, "ripple_sine is not a list of 4"),
        ({"ripple_sine": [0.0, 0.0, 0.0, "x"]}, r"ripple_sine\[3\]"),
        ({"magic": 1.0}, "no gain magic"),
    ],
)
def test_doubtful_numbers_are_refused(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(DataError, match=message) as caught:
        load_gains(write(tmp_path, backup(entry() | change)))
    assert caught.value.exit_code == 5


def test_a_missing_number_and_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="derivative is missing"):
        load_gains(write(tmp_path, backup({"proportional": 1.0})))
    with pytest.raises(DataError, match="no such file"):
        load_gains(tmp_path / "absent.json")
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataError, match="not a JSON document"):
        load_gains(tmp_path / "binary.json")


def entry() -> dict[str, Any]:
    return asdict(CONSERVATIVE_GAINS)


def backup(gains: dict[str, Any]) -> dict[str, Any]:
    return {"schema": "edge-ident/gain-backup/1", "serial_number": 1, "axes": {"x": gains}}


def write(folder: Path, document: Any) -> Path:
    path = folder / "gains.json"
    path.write_text(json.dumps(document))
    return path


def test_a_file_that_says_one_thing_twice_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, backup(entry()))
    text = path.read_text().replace('"proportional"', '"proportional": 45.0, "proportional"', 1)
    path.write_text(text)
    with pytest.raises(DataError, match="'proportional' twice"):
        load_gains(path)

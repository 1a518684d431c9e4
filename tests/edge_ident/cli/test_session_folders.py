"""The folder of a run or capture is its own: nothing that another left is written over."""

import logging
from contextlib import suppress
from pathlib import Path

import pytest

from edge_ident.cli import sessions
from edge_ident.errors import BoardError, DataError
from firmware_interface.board import Board
from firmware_interface.registers import Fault
from firmware_interface.virtual.settings import BoardSettings
from tests.edge_ident.shared_board import SharedBoard


@pytest.fixture
def shared(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SharedBoard:
    monkeypatch.chdir(tmp_path)
    return SharedBoard(monkeypatch)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("command", ["capture", "run"])
def test_a_folder_that_holds_a_session_is_refused_before_anything_moves(
    shared: SharedBoard, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared.json("capture", "--output", "a")
    before = contents(Path("a"))
    monkeypatch.setattr(Board, "arm", None)
    code, _, errors = shared.run(command, "--output", "a")
    assert code == 5
    assert "a holds another run or capture" in errors
    assert "--output" in errors
    assert contents(Path("a")) == before


def test_two_sessions_at_once_do_not_share_a_folder(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    second = sessions._log_file(log)
    with sessions._log_file(log), pytest.raises(DataError, match="holds another run"):
        second.__enter__()


@pytest.mark.parametrize("permanent", ["environment", "settings"])
def test_in_a_permanent_folder_each_session_has_its_own(
    shared: SharedBoard, monkeypatch: pytest.MonkeyPatch, permanent: str
) -> None:
    if permanent == "environment":
        monkeypatch.setenv("EDGE_IDENT_OUTPUT", "lab")
    else:
        monkeypatch.setenv("EDGE_IDENT_CONFIG_FILE", "settings.toml")
        Path("settings.toml").write_text('output = "lab"\n', "utf-8")
    files = [Path(shared.json("capture")["file"]) for _ in range(2)]
    assert files[0].parent != files[1].parent
    assert {file.parent.parent for file in files} == {Path("lab")}


def test_a_session_that_was_refused_leaves_the_folder_free(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    faulty = SharedBoard(monkeypatch, BoardSettings(fault=Fault.FOLLOWING_ERROR))
    assert faulty.run("capture", "--output", tmp_path)[0] == 4
    assert not list(tmp_path.iterdir())
    assert faulty.run("clear-fault")[0] == 0
    assert faulty.run("capture", "--output", tmp_path)[0] == 0


def test_a_session_in_which_something_happened_keeps_its_log(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    with suppress(BoardError), sessions._log_file(log):
        logging.getLogger("edge_ident").info("axes enabled")
        raise BoardError("a fault in the lead-in", "look at the machine")
    assert "axes enabled" in log.read_text("utf-8")


@pytest.mark.parametrize(
    ("given", "message"), [("", "the name is empty"), ("file", "file is a file; give a folder")]
)
def test_what_is_no_name_of_a_folder_is_refused(
    shared: SharedBoard, given: str, message: str
) -> None:
    Path("file").touch()
    code, _, errors = shared.run("capture", "--output", given)
    assert code == 2
    assert message in errors
    assert [path.name for path in Path().iterdir()] == ["file"]

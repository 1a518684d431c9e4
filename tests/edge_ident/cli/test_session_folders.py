"""The folder of a run or capture is its own: nothing that another left is written over."""

import logging
import shutil
from contextlib import suppress
from pathlib import Path

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app, sessions
from edge_ident.drive.description import drive_text
from edge_ident.errors import BoardError, DataError
from firmware_interface.board import Board
from firmware_interface.registers import Fault
from firmware_interface.virtual.settings import BoardSettings
from tests.edge_ident.shared_board import SharedBoard
from tests.short_runs import brief_drive


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One that moves for a few seconds."""
    file = tmp_path_factory.mktemp("drive") / "brief.toml"
    file.write_text(drive_text(brief_drive(), {}), "utf-8")
    return file


@pytest.fixture
def shared(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, drive: Path) -> SharedBoard:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("EDGE_IDENT_DRIVE", str(drive))
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


@pytest.mark.parametrize(
    ("command", "name"),
    [
        *(("run", name) for name in ("gains_before.json", "capture.npz", "verification.npz")),
        *(("run", name) for name in ("model.json", "report.html", "report.json")),
        *(("capture", name) for name in ("capture.npz", "capture_partial.npz", "capture.json")),
    ],
)
def test_a_file_that_a_session_would_write_over_is_refused_before_anything_moves(
    shared: SharedBoard, command: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in the folder of an earlier `diagnose`."""
    Path("a").mkdir()
    (Path("a") / name).write_text("of before", "utf-8")
    monkeypatch.setattr(Board, "arm", None)
    code, _, errors = shared.run(command, "--output", "a")
    assert code == 5
    assert f"a holds {name}, which would be lost" in errors
    assert "--output" in errors
    assert contents(Path("a")) == {name: b"of before"}


def test_files_that_a_session_does_not_write_are_left_beside_its_own(shared: SharedBoard) -> None:
    Path("a").mkdir()
    (Path("a") / "model.json").write_text("of before", "utf-8")
    shared.json("capture", "--output", "a")
    assert contents(Path("a"))["model.json"] == b"of before"


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory, drive: Path) -> Path:
    folder = tmp_path_factory.mktemp("run") / "run"
    with pytest.MonkeyPatch.context() as patch:
        SharedBoard(patch).json("run", "--drive", drive, "--output", folder)
    return folder


def test_every_file_of_a_run_keeps_another_run_out(shared: SharedBoard, run_folder: Path) -> None:
    for file in run_folder.iterdir():
        Path(file.stem).mkdir(exist_ok=True)
        copy = Path(file.stem) / file.name
        copy.write_bytes(file.read_bytes())
        assert shared.run("run", "--output", copy.parent)[0] == 5, file.name
        copy.unlink()


@pytest.mark.parametrize("command", ["diagnose", "identify", "survey"])
def test_the_page_and_the_model_of_a_run_are_kept(
    shared: SharedBoard, run_folder: Path, command: str
) -> None:
    before = contents(run_folder)
    recording = run_folder / ("" if command == "survey" else "capture.npz")
    result = CliRunner().invoke(app, [command, str(recording), "--output", str(run_folder)])
    assert result.exit_code == 5
    assert "is the folder of a run" in result.stderr
    assert "another folder with --output" in result.stderr
    assert contents(run_folder) == before


def test_an_offline_command_is_repeated_into_its_own_folder(
    shared: SharedBoard, run_folder: Path
) -> None:
    command = ["identify", str(run_folder / "capture.npz"), "--output", "a"]
    for _ in range(2):
        assert CliRunner().invoke(app, command).exit_code == 0


def test_a_session_that_had_no_room_leaves_the_folder_free(
    shared: SharedBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = shutil.disk_usage(".")
    with monkeypatch.context() as full:
        full.setattr(shutil, "disk_usage", lambda path: usage._replace(free=100_000))
        for command in ("run", "capture"):
            code, _, errors = shared.run(command, "--output", "a")
            assert (code, list(Path("a").iterdir())) == (5, [])
            assert "a has 100 kB free, but the recording needs 123 kB" in errors
    assert shared.run("capture", "--output", "a")[0] == 0


def test_two_sessions_at_once_do_not_share_a_folder(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    second = sessions._log_file(log, ())
    with sessions._log_file(log, ()), pytest.raises(DataError, match="holds another run"):
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
    with suppress(BoardError), sessions._log_file(log, ()):
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

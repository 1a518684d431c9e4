"""Each mistake of a newcomer gets the next step, with what to write."""

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import edge_ident
from edge_ident.cli import app
from edge_ident.report.run_documents import axis_steps, run_steps
from tests.edge_ident.report.page import hand_made_run


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


def said(done: Result) -> str:
    return " ".join(done.stderr.split())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """As a run leaves it."""
    path = tmp_path_factory.mktemp("run")
    for name in ("capture", "a_second"):
        edge_ident.save_recording(edge_ident.simulate(cycles=1), path / f"{name}.npz")
    (path / "report.json").write_text("{}")
    return path


@pytest.mark.parametrize("command", ["identify", "diagnose", "gains"])
def test_a_folder_is_answered_with_the_recording_in_it(command: str, folder: Path) -> None:
    done = run(command, folder)
    assert done.exit_code == 5
    assert f"give a recording in it, such as {folder / 'capture.npz'}" in said(done)


def test_a_folder_without_a_recording_is_answered_with_the_endings(tmp_path: Path) -> None:
    assert "give the path of a recording (.csv" in said(run("identify", tmp_path))


def test_a_document_is_no_recording(folder: Path) -> None:
    done = run("identify", folder / "report.json")
    assert done.exit_code == 5
    assert "a JSON document, and no recording" in done.stderr
    assert "a model goes with --model" in said(done)


@pytest.mark.parametrize("command", [("simulate",), ("capture", "--device", "virtual")])
def test_a_motion_of_no_name_is_answered_with_the_names(
    command: tuple[str, ...], tmp_path: Path
) -> None:
    done = run(*command, "--motion", "sinusoidal", "-o", tmp_path / "a.npz")
    assert done.exit_code == 2
    assert "write sinusoid, multisine, staircase, or the path of a file" in said(done)


def test_degrees_given_as_radians_are_answered_with_how_to_write_them() -> None:
    done = run("home", "--device", "virtual", "--to", "x=90")
    assert done.exit_code == 4
    assert "degrees are written as in x=90deg" in said(done)
    done = run("home", "--device", "virtual", "--to", "90")
    assert done.exit_code == 2
    assert "such as x=1.57 (rad) or x=90deg" in said(done)


def test_an_unknown_register_is_answered_with_where_they_are_listed() -> None:
    done = run("registers", "0x0")
    assert done.exit_code == 2
    assert "edge-ident registers lists all" in said(done)


def test_a_missing_port_is_answered_with_the_virtual_board(tmp_path: Path) -> None:
    done = run("run", "--device", tmp_path / "none")
    assert done.exit_code == 3
    assert "or try --device virtual" in said(done)


def test_a_capture_tells_how_to_identify_it(tmp_path: Path) -> None:
    done = run("capture", "--device", "virtual", "--cycles", "1", "--output", tmp_path)
    assert done.exit_code == 0
    assert f"identify it with: edge-ident identify {tmp_path / 'capture.npz'}" in done.stderr
    assert done.stdout == f"{tmp_path / 'capture.npz'}\n"


def test_a_virtual_board_that_ends_says_so_where_gains_are_stored(tmp_path: Path) -> None:
    done = run("gains", "store", "--device", "virtual", "--backups", tmp_path)
    assert done.exit_code == 0, done.stderr
    assert "this virtual board ends with the command" in done.stderr


@pytest.mark.parametrize(
    ("device", "step"),
    [
        (
            "/dev/ttyACM0",
            "keep the new gains over a power cycle: edge-ident gains store --device /dev",
        ),
        ("virtual", "run a virtual board that keeps its gains: edge-ident board --pty"),
        (None, "keep the new gains over a power cycle: edge-ident gains store;"),
    ],
)
def test_a_run_names_the_command_for_its_board(
    device: str | None, step: str, tmp_path: Path
) -> None:
    outcome, _ = hand_made_run.run(tmp_path)
    (told,) = run_steps(outcome, device)
    assert told.startswith(step)
    assert axis_steps(outcome.identification.axes["x"], outcome, device) == [told]

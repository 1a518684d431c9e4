"""What moves behind the virtual board: a hidden fault or a used machine, told only when asked."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from edge_ident import diagnose, load_recording
from edge_ident.cli import app
from edge_ident.report.page.rendering import Provenance
from tests.processes import running

HIDE = ["--hide", "stribeck_friction=0.5", "--axis", "z"]
CAPTURE = ["capture", "--device", "virtual"]


def run(*arguments: str) -> str:
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    return done.stdout


def refused(*arguments: str) -> str:
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2
    return done.stderr


@pytest.fixture(scope="module")
def captured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("captured")
    run(*CAPTURE, *HIDE, "--output", str(folder))
    return folder


def test_the_diagnosis_names_what_was_hidden_on_its_axis_alone(captured: Path) -> None:
    axes = diagnose([load_recording(captured / "capture.npz")]).axes
    (cause,) = axes["z"].causes
    assert cause.term.effect == "stribeck_friction"
    assert cause.term.values["level"] == pytest.approx(0.55, rel=0.15)
    assert not axes["x"].causes


def test_nothing_tells_what_was_hidden(captured: Path) -> None:
    for file in captured.iterdir():
        content = file.read_bytes()
        assert b"stribeck" not in content, file
        assert b'"hidden"' not in content, file


def test_the_effort_of_the_other_axis_is_that_of_a_sound_drive(
    captured: Path, tmp_path: Path
) -> None:
    run(*CAPTURE, "--output", str(tmp_path))
    sound, faulty = (load_recording(f / "capture.npz").axes for f in (tmp_path, captured))
    np.testing.assert_array_equal(sound["x"].effort, faulty["x"].effort)
    assert np.std(sound["z"].effort - faulty["z"].effort) > 0.05


def test_reveal_puts_the_truth_at_the_end_and_into_the_document(tmp_path: Path) -> None:
    text = run(*CAPTURE, *HIDE, "--reveal", "--output", str(tmp_path))
    assert text.splitlines()[-1] == (
        "hidden in z: stribeck_friction, 0.5 of the Coulomb friction, at rest (0.55 N·m)"
    )
    (fault,) = json.loads((tmp_path / "capture.json").read_text())["hidden"]
    assert (fault["effect"], fault["axis"], fault["strength"]) == ("stribeck_friction", "z", 0.5)


def test_a_board_reveals_what_a_number_draws_without_being_served(tmp_path: Path) -> None:
    told = run("board", "--hide-seed", "7", "--reveal")
    document = json.loads(run("board", "--hide-seed", "7", "--reveal", "--json"))
    assert [fault["effect"] in told for fault in document["hidden"]] == [True, True]
    assert document["device"] is None


def test_a_used_machine_is_drawn_by_its_number_and_its_wear() -> None:
    told = [
        json.loads(run("plant", "--used", "3", *more, "--reveal", "--json"))["hidden"]
        for more in ([], ["--wear", "2"], ["--wear", "0"], ["--friction", "lugre"])
    ]
    inertia = [next(of["size"] for of in every if of["effect"] == "inertia") for every in told]
    assert len(set(inertia)) == 1
    gaps = [next(of["size"] for of in every if of["effect"] == "gap") for every in told[:2]]
    assert gaps[1] == pytest.approx(2.0 * gaps[0])
    assert all("gap" not in {of["effect"] for of in clean} for clean in told[2:])


@pytest.mark.real_time
def test_a_served_board_hides_and_does_not_tell(tmp_path: Path) -> None:
    board = [sys.executable, "-m", "edge_ident", "board", "--tcp", "0", "--speed", "max", *HIDE]
    with running([*board, "--output", str(tmp_path)], errors=None) as process:
        assert process.stdout is not None
        device = process.stdout.readline().strip()
        run("capture", "--device", device, "--output", str(tmp_path / "capture"))
    assert set(json.loads((tmp_path / "board.json").read_text())) == {"schema", "device"}
    (cause,) = diagnose([load_recording(tmp_path / "capture" / "capture.npz")]).axes["z"].causes
    assert cause.term.effect == "stribeck_friction"


def test_options_that_go_nowhere_are_refused() -> None:
    assert "did you mean backlash" in refused("board", "--pty", "--hide", "backlsh")
    assert "nothing is hidden" in refused(*CAPTURE, "--reveal")
    assert "nothing is hidden" in refused(*CAPTURE, "--axis", "z")
    assert "virtual" in refused("capture", "--device", "tcp://127.0.0.1:1", *HIDE)
    assert "virtual" in refused("capture", "--device", "tcp://127.0.0.1:1", "--used", "3")
    assert "--used" in refused(*CAPTURE, "--wear", "1")
    assert "--used" in refused(*CAPTURE, "--friction", "dahl")
    assert "either" in refused(*CAPTURE, "--used", "3", "--hide", "backlash")
    assert "clean" in refused(*CAPTURE, "--used", "3", "--wear", "1", "--friction", "dahl")


@pytest.mark.parametrize(
    "words", [HIDE[:2], ["--hide=stribeck_friction=0.5"], ["--hide-seed", "9"], ["--used", "9"]]
)
def test_a_page_does_not_repeat_it(words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["edge-ident", "run", *words, "--dry-run"])
    command = Provenance.of([]).command
    assert command.startswith("edge-ident run --")
    assert command.endswith(" --dry-run")
    assert "stribeck" not in command
    assert "9" not in command

"""Axes of any name: what is certain needs no option, and what is not names the option to give."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import edge_ident
from edge_ident.cli import app
from edge_ident.model.model import Term

SHEET = (
    "--kind", "rotary", "--gear-ratio", "1", "--encoder", "8400", "--encoder-at", "output",
    "--torque", "20", "--torque-constant", "1", "--travel", "3000deg", "--speed", "300",
    "--sample-rate", "400", "--accept-implausible",
)  # fmt: skip


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


@pytest.fixture(scope="module")
def both() -> edge_ident.Recording:
    return edge_ident.simulate(motion="multisine")


def saved(recording: edge_ident.Recording, names: dict[str, str], path: Path) -> Path:
    """A file of some axes, under other names."""
    axes = {new: recording.axes[old] for old, new in names.items()}
    edge_ident.save_recording(replace(recording, axes=axes), path)
    return path


@pytest.fixture
def joints(both: edge_ident.Recording, tmp_path: Path) -> Path:
    return saved(both, {"x": "joint1", "z": "joint2"}, tmp_path / "joints.csv")


@pytest.fixture
def one(both: edge_ident.Recording, tmp_path: Path) -> Path:
    return saved(both, {"x": "a"}, tmp_path / "one.csv")


@pytest.fixture
def known(tmp_path: Path) -> Path:
    """The model of one axis, x."""
    axis = edge_ident.reduced_model().axes["x"]
    stribeck = Term("stribeck_friction", {"level": 0.05, "speed": 0.1})
    path = tmp_path / "known.json"
    model = edge_ident.Model({"x": replace(axis, terms=(*axis.terms, stribeck))})
    edge_ident.save_model(model, path)
    return path


@pytest.mark.parametrize("command", [("identify",), ("diagnose",)])
def test_a_recording_is_read_whatever_its_axes_are_called(
    command: tuple[str, ...], joints: Path
) -> None:
    done = run(*command, joints)
    assert done.exit_code == 0, done.stderr
    assert "joint1" in done.stdout
    assert "joint2" in done.stdout


@pytest.mark.parametrize("command", [("identify",), ("diagnose",)])
def test_a_model_of_one_axis_is_taken_for_the_only_axis(
    command: tuple[str, ...], one: Path, known: Path
) -> None:
    done = run(*command, one, "--model", known)
    assert f"axis a is taken for axis x of {known}, the only one there" in done.stderr
    assert "stribeck friction: level" in done.stdout or done.exit_code == 0


@pytest.mark.parametrize("command", [("identify",), ("diagnose",), ("plan",)])
def test_a_model_that_fits_no_axis_is_refused(
    command: tuple[str, ...], joints: Path, known: Path, tmp_path: Path
) -> None:
    drive = tmp_path / "joints.toml"
    assert run("init", drive, "--axis", "joint1", "--axis", "joint2", *SHEET).exit_code == 0
    more = ["--drive", drive] if command == ("plan",) else []
    done = run(*command, joints, "--model", known, *more)
    assert done.exit_code == 5
    assert "the model describes x, not joint1, joint2" in done.stderr


def test_a_drive_of_one_axis_is_taken_for_the_only_axis(one: Path, tmp_path: Path) -> None:
    drive = tmp_path / "slide.toml"
    assert run("init", drive, "--axis", "slide", *SHEET).exit_code == 0
    for command in ("gains", "plan"):
        done = run(command, one, "--drive", drive)
        assert "axis a is taken for axis slide of slide, the only one there" in done.stderr
        assert done.exit_code in (0, 1), done.stderr


def test_a_drive_that_fits_no_axis_says_how_to_describe_them(joints: Path) -> None:
    for command in ("gains", "plan"):
        done = run(command, joints)
        assert done.exit_code == 5
        assert "edge-ident init --axis joint1 --axis joint2, and give that file with --drive" in (
            " ".join(done.stderr.split())
        )


def test_a_simulated_drive_of_one_axis_follows_the_only_axis(
    one: Path, joints: Path, known: Path, tmp_path: Path
) -> None:
    file = tmp_path / "followed.npz"
    assert run("simulate", "--model", known, "--motion", one, "-o", file).exit_code == 0
    assert list(edge_ident.load_recording(file).axes) == ["a"]
    done = run("simulate", "--model", known, "--motion", joints, "-o", file)
    assert done.exit_code == 5
    assert "the model describes x, not joint1, joint2" in done.stderr


def test_init_takes_the_axes_that_options_name(tmp_path: Path) -> None:
    file = tmp_path / "joints.toml"
    index = SHEET.index("3000deg")
    sheet = (*SHEET[:index], "joint1=3000deg", "--travel", "a=2000deg", *SHEET[index + 1 :])
    done = run("init", file, *sheet)
    assert done.exit_code == 0, done.stderr
    assert list(edge_ident.load_drive(file).axes) == ["joint1", "a"]


def test_init_keeps_the_axes_of_a_board_where_one_is_named(tmp_path: Path) -> None:
    file = tmp_path / "board.toml"
    assert run("init", file, *SHEET, "--travel", "z=2000deg").exit_code == 0
    assert list(edge_ident.load_drive(file).axes) == ["x", "z"]


# ---- an axis that stands still


def resting(both: edge_ident.Recording, path: Path, *, reference: bool) -> Path:
    moving, other = both.axes["x"], both.axes["z"]
    still = np.full_like(other.position, 0.3)
    axis = replace(other, position=still, reference=still if reference else None, velocity=None)
    edge_ident.save_recording(replace(both, axes={"joint1": moving, "joint2": axis}), path)
    return path


@pytest.mark.parametrize("reference", [True, False])
def test_an_axis_at_rest_is_not_identified_and_the_other_one_is(
    both: edge_ident.Recording, tmp_path: Path, *, reference: bool
) -> None:
    """Without a reference it may be stuck: the sentence says what to check."""
    file = resting(both, tmp_path / "rest.csv", reference=reference)
    done = run("identify", file)
    assert done.exit_code == 0
    said = " ".join(done.stderr.split())
    assert "rest.csv: axis joint2 rests, and is not identified" in said
    assert "check its encoder" in said
    assert "joint2" not in done.stdout
    assert run("identify", file, "--axis", "joint2").exit_code == 5
    read = edge_ident.load_recording(file)
    assert (list(read.axes), list(read.passive)) == (["joint1"], ["joint2"])


def test_an_axis_that_was_told_to_move_and_did_not_is_refused(
    both: edge_ident.Recording, tmp_path: Path
) -> None:
    axis = both.axes["z"]
    still = np.full_like(axis.position, 0.3)
    stuck = replace(axis, position=still, reference=axis.position, velocity=None)
    file = tmp_path / "stuck.csv"
    edge_ident.save_recording(replace(both, axes={"joint1": both.axes["x"], "joint2": stuck}), file)
    done = run("identify", file)
    assert done.exit_code == 5
    assert "leave this axis out: --axis joint1" in " ".join(done.stderr.split())
    assert run("identify", file, "--axis", "joint1").exit_code == 0

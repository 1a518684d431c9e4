"""Efforts whose sign is in the word, or lost: recognized, converted, and then right."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

import edge_ident
from edge_ident.cli import app
from edge_ident.errors import DataError
from edge_ident.signals.effort_encoding import decode, find_encoding

Array = NDArray[np.float64]

TIME_S = 0.004 * np.arange(3000)
POSITION = 0.9 * np.sin(7.0 * TIME_S) + 0.3 * np.sin(19.0 * TIME_S + 1.0)
VELOCITY = 6.3 * np.cos(7.0 * TIME_S) + 5.7 * np.cos(19.0 * TIME_S + 1.0)
ACCELERATION = -44.1 * np.sin(7.0 * TIME_S) - 108.3 * np.sin(19.0 * TIME_S + 1.0)
TRUE = (0.02, 0.05, 0.08, 0.01)
"""Inertia, viscous friction, Coulomb friction and offset."""
EFFORT = TRUE[0] * ACCELERATION + TRUE[1] * VELOCITY + TRUE[2] * np.sign(VELOCITY) + TRUE[3]
EFFORT = EFFORT + 0.004 * np.random.default_rng(1).standard_normal(len(TIME_S))
COUNTS = np.rint(1e3 * EFFORT)

WORDS: dict[str, tuple[str, Callable[[Array], Array]]] = {
    "int8 read without a sign": ("uint8", lambda n: np.rint(n / 30.0) % 256),
    "int16 read without a sign": ("uint16", lambda n: n % 65536),
    "int16 in 0.1 %": ("uint16", lambda n: 0.1 * (n % 65536)),
    "int16 scaled and rounded": ("uint16", lambda n: np.round(0.0061 * (n % 65536), 6)),
    "int16 at full scale": ("uint16", lambda n: np.rint(30000.0 * n / np.max(np.abs(n))) % 65536),
    "int32 read without a sign": ("uint32", lambda n: n % 2.0**32),
    "bit 15 is the sign": ("sign-magnitude", lambda n: np.where(n < 0.0, 32768 - n, n)),
    "bit 12 is the sign": ("sign-magnitude", lambda n: 1e-3 * np.where(n < 0.0, 4096 - n, n)),
}


def write(path: Path, effort: Array) -> Path:
    table = np.column_stack([TIME_S, POSITION, effort])
    head = "time_s,x_position_rad,x_torque_nm"
    np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.6f")
    return path


@pytest.mark.parametrize("kind", WORDS)
def test_an_encoding_is_found_and_converted(kind: str) -> None:
    encoding, written = WORDS[kind]
    assert find_encoding(written(COUNTS)) == encoding
    signed = decode(written(COUNTS), encoding)
    assert np.corrcoef(signed, COUNTS)[0, 1] > 0.999
    np.testing.assert_array_equal(decode(signed, encoding), signed)


@pytest.mark.parametrize(("encoding", "written"), [WORDS["int16 read without a sign"],
                                                   WORDS["bit 12 is the sign"]])  # fmt: skip
def test_the_command_that_is_proposed_gives_the_right_values(
    encoding: str, written: Callable[[Array], Array], tmp_path: Path
) -> None:
    scale = 1e-3 if encoding == "uint16" else 1.0
    path = write(tmp_path / "drive.csv", scale * written(COUNTS))
    asked = CliRunner().invoke(app, ["identify", str(path)])
    assert asked.exit_code == 5
    assert "x_torque_nm is never negative and jumps by" in asked.stderr
    (command,) = (line for line in asked.stderr.splitlines() if line.startswith("next:"))
    assert command.endswith(f"edge-ident identify {path} --effort-encoding {encoding}")
    recording = edge_ident.load_recording(
        path, options=edge_ident.ReadOptions(effort_encoding=encoding)
    )
    found = edge_ident.identify(recording, diagnose=False).axes["x"]
    values = found.estimate.parameters
    np.testing.assert_allclose(values, TRUE, rtol=0.05, atol=1e-3)


def test_a_magnitude_is_said_to_be_one(tmp_path: Path) -> None:
    path = write(tmp_path / "drive.csv", np.abs(EFFORT))
    with pytest.raises(DataError, match="only the magnitude of the effort") as caught:
        edge_ident.load_recording(path)
    assert "with its sign" in caught.value.next_step


@pytest.mark.parametrize(
    "effort",
    [
        EFFORT,
        EFFORT + 20.0,
        COUNTS + 40000.0,
        np.where(EFFORT > 0.0, 1010.0, 10.0) + np.round(3.0 * np.sin(50.0 * TIME_S), 0),
        np.full_like(EFFORT, 2.0),
    ],
    ids=["signed", "a weight", "counts above half a word", "switched", "constant"],
)
def test_other_efforts_have_their_sign(effort: Array) -> None:
    assert find_encoding(effort) is None


def test_a_weight_that_always_pulls_one_way_is_no_magnitude(tmp_path: Path) -> None:
    lifted = EFFORT - np.min(EFFORT)
    assert edge_ident.load_recording(write(tmp_path / "lift.csv", lifted)).axes["x"]


def test_an_unknown_encoding_lists_those_that_are_known(tmp_path: Path) -> None:
    options = edge_ident.ReadOptions(effort_encoding="int16")
    path = write(tmp_path / "drive.csv", 1e-3 * (COUNTS % 65536))
    with pytest.raises(DataError, match="no such encoding") as caught:
        edge_ident.load_recording(path, options=options)
    assert "uint16" in caught.value.next_step


def test_an_effort_that_counts_against_the_position_is_turned(tmp_path: Path) -> None:
    """The next step of the refusal is the command that gives the right values."""
    path = write(tmp_path / "a.csv", -EFFORT)
    refused = CliRunner().invoke(app, ["identify", str(path), "--no-diagnose"])
    assert refused.exit_code == 1
    assert "negative_" not in refused.stdout
    command = ["identify", str(path), "--effort-encoding", "opposite"]
    assert " ".join(command) in " ".join(refused.stdout.split())
    done = CliRunner().invoke(app, [*command, "--json"])
    assert done.exit_code == 0
    found = json.loads(done.stdout)["axes"]["x"]["parameters"]
    assert [one["value"] for one in found.values()] == pytest.approx(TRUE, rel=0.05)

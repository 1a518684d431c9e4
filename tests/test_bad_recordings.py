"""Recordings that something is wrong with: each gets the sentence that helps, and no cause."""

import json
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from edge_ident import AxisRecord, Recording, diagnose, identify
from edge_ident.cli import app
from edge_ident.errors import DataError

Array = NDArray[np.float64]

DONE, UNTRUSTED, DATA = 0, 1, 5
PERIOD_S, SAMPLES = 0.0025, 4000
COUNT_RAD = 2.0 * np.pi / 8400


@dataclass(frozen=True)
class Columns:
    """What a file holds."""

    time_s: Array
    position: Array
    effort: Array

    def write(self, path: Path) -> Path:
        rows = np.column_stack([self.time_s, self.position, self.effort])
        header = "time_s,x_position_rad,x_torque_nm"
        np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.9g")
        return path


def moved(time_s: Array, slow: float = 1.0) -> tuple[Array, Array]:
    """Position and effort of a sound axis on a multisine; its time runs `slow` times slower."""
    position, velocity, acceleration = np.zeros((3, len(time_s)))
    for amplitude, rate, phase in ((2.0, 1.1, 0.3), (0.6, 3.3, 1.1), (0.15, 8.1, 2.0)):
        angle = rate / slow * time_s + phase
        position += amplitude * np.sin(angle)
        velocity += amplitude * rate / slow * np.cos(angle)
        acceleration -= amplitude * (rate / slow) ** 2 * np.sin(angle)
    noise = np.random.default_rng(8).standard_normal(len(time_s))
    effort = 0.5 * acceleration + 0.8 * velocity + 0.6 * np.sign(velocity) + 0.2
    return COUNT_RAD * np.round(position / COUNT_RAD), effort + 0.02 * noise


def sound() -> Columns:
    time_s = PERIOD_S * np.arange(SAMPLES)
    return Columns(time_s, *moved(time_s))


def effort_of(change: Callable[[Array, Array], Array]) -> Columns:
    good = sound()
    return Columns(good.time_s, good.position, change(good.position, good.effort))


def spike(_: Array, effort: Array) -> Array:
    effort[2000] += 60.0
    return effort


def late(_: Array, effort: Array) -> Array:
    return np.concatenate([np.full(30, effort[0]), effort[:-30]])


def clip(_: Array, effort: Array) -> Array:
    return np.clip(effort, -8.0, 8.0)


def noise(_: Array, effort: Array) -> Array:
    return np.random.default_rng(3).standard_normal(len(effort))


def wrapped() -> Columns:
    good = sound()
    return Columns(good.time_s, (good.position + 4.5) % (2.0 * np.pi), good.effort)


def swapped() -> Columns:
    good = sound()
    return Columns(good.time_s, good.effort, good.position)


def milliseconds() -> Columns:
    good = sound()
    return Columns(1e3 * good.time_s, good.position, good.effort)


def degrees() -> Columns:
    good = sound()
    return Columns(good.time_s, np.degrees(good.position), good.effort)


REFUSED = {
    "zero effort": (effort_of(lambda _, u: 0.0 * u), "the effort is zero in every sample"),
    "constant effort": (
        effort_of(lambda _, u: 0.0 * u + 1.5),
        "the effort is 1.5 N*m in every sample",
    ),
    "spike": (effort_of(spike), "effort, row 2002: a spike of 60"),
    "swapped columns": (swapped(), "position and effort are swapped"),
    "milliseconds": (milliseconds(), "if it is in milliseconds, say so: --unit time_s=ms"),
}
DOUBTED = {
    "wrong sign": (effort_of(lambda _, u: -u), "effort_sign"),
    "noise": (effort_of(noise), "unrelated_effort"),
    "velocity": (effort_of(lambda x, _: np.gradient(x, PERIOD_S)), "effort_is_velocity"),
    "late": (effort_of(late), "effort_late"),
    "clipped": (effort_of(clip), "clipped_or_missing"),
}


@pytest.fixture(autouse=True)
def no_warning() -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        yield


def run(*arguments: str | Path) -> tuple[int, Any, str]:
    """Exit code, JSON document and messages of a command."""
    result = CliRunner().invoke(app, [str(argument) for argument in (*arguments, "--json")])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, json.loads(result.stdout or "null"), result.stderr


def test_the_sound_recording_is_trusted(tmp_path: Path) -> None:
    """Otherwise the rows below would show nothing."""
    code, document, _ = run("identify", sound().write(tmp_path / "sound.csv"))
    assert code == DONE, document["axes"]["x"]["warnings"]


@pytest.mark.parametrize("command", ["identify", "diagnose"])
@pytest.mark.parametrize("kind", REFUSED)
def test_what_says_too_little_is_refused(tmp_path: Path, kind: str, command: str) -> None:
    columns, sentence = REFUSED[kind]
    code, _, messages = run(command, columns.write(tmp_path / "bad.csv"))
    assert code == DATA
    assert sentence in messages
    assert "next" in messages


@pytest.mark.parametrize("kind", DOUBTED)
def test_what_contradicts_itself_is_not_trusted(tmp_path: Path, kind: str) -> None:
    columns, finding = DOUBTED[kind]
    code, document, _ = run("identify", "--no-diagnose", columns.write(tmp_path / "bad.csv"))
    assert code == UNTRUSTED
    assert finding in [warning["code"] for warning in document["axes"]["x"]["warnings"]]


@pytest.mark.parametrize("kind", DOUBTED)
def test_what_contradicts_itself_has_no_cause(tmp_path: Path, kind: str) -> None:
    columns, finding = DOUBTED[kind]
    code, document, _ = run("diagnose", columns.write(tmp_path / "bad.csv"))
    axis = document["axes"]["x"]
    named = [found["code"] for found in (*axis["findings"], *document["data_quality"])]
    assert axis["causes"] == []
    if kind == "clipped":
        assert "clipped" in named
        return
    assert finding in named
    assert code == UNTRUSTED


@pytest.mark.parametrize("value", [0.0, 1.5])
def test_an_effort_that_never_changes_is_refused_without_a_file_too(value: float) -> None:
    good = sound()
    axis = AxisRecord(good.position, 0.0 * good.effort + value, "rad", "N*m")
    recording = Recording(good.time_s, {"x": axis}, "memory")
    for refuses in (lambda: identify(recording), lambda: diagnose([recording])):
        with pytest.raises(DataError, match="in every sample"):
            refuses()


def test_degrees_are_asked_about_and_no_cause_comes_of_them(tmp_path: Path) -> None:
    _, document, _ = run("diagnose", degrees().write(tmp_path / "degrees.csv"))
    assert "many_turns" in [found["code"] for found in document["data_quality"]]
    assert document["axes"]["x"]["causes"] == []


def test_thirty_hertz_of_a_slow_arm_are_enough(tmp_path: Path) -> None:
    time_s = np.arange(0.0, 270.0, 1.0 / 30.0)
    slow = Columns(time_s, *moved(time_s, slow=3.0))
    code, document, messages = run("identify", slow.write(tmp_path / "slow.csv"))
    assert code in (DONE, UNTRUSTED), messages
    friction = document["axes"]["x"]["parameters"]["coulomb_friction"]
    assert friction["value"] == pytest.approx(0.6, rel=0.05)


def test_a_wrapped_angle_goes_on(tmp_path: Path) -> None:
    code, document, messages = run("identify", wrapped().write(tmp_path / "wrapped.csv"))
    assert code == 0
    assert "starts again after 6.28319 rad" in messages
    _, whole, _ = run("identify", sound().write(tmp_path / "whole.csv"))
    found, true = (one["axes"]["x"]["parameters"]["inertia"] for one in (document, whole))
    assert found["value"] == pytest.approx(true["value"], rel=1e-3)

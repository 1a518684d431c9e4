"""Play between motor and encoder shows against the reference: how much, and that it is play."""

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

import edge_ident
from edge_ident.cli import app
from edge_ident.report.page.diagnosis_page import diagnosis_card
from edge_ident.signals.tracking import Tracking, tracking

Array = NDArray[np.float64]

PERIOD_S = 0.002
TIME_S = PERIOD_S * np.arange(6000)
REFERENCE_M = 0.0445 * np.sin(2.0 * np.pi * 0.3 * TIME_S)
LAG_S = 0.012
COUNT_M = 1e-6


def behind_play(motor: Array, play: float) -> Array:
    """A load that rests until the motor has gone through the play."""
    load, at = np.empty_like(motor), float(motor[0])
    for i, pushed in enumerate(motor.tolist()):
        at = min(max(at, pushed - 0.5 * play), pushed + 0.5 * play)
        load[i] = at
    return load


def sticking(way: float) -> Array:
    """An axis that stands until its reference is `way` ahead, and then catches up with it."""
    made, at, slides = np.empty_like(REFERENCE_M), 0.0, False
    for i, told in enumerate(REFERENCE_M.tolist()):
        slides = abs(told - at) > (2e-4 if slides else way)
        at += np.clip(told - at, -3e-4, 3e-4) if slides else 0.0
        made[i] = at
    return made


def recording(position: Array, effort: Array | None = None) -> edge_ident.Recording:
    rng = np.random.default_rng(3)
    measured = COUNT_M * np.rint((position + COUNT_M * rng.standard_normal(len(TIME_S))) / COUNT_M)
    speed = np.gradient(position, PERIOD_S)
    pushes = 20.0 * np.tanh(speed / 1e-4) + 200.0 * speed if effort is None else effort
    pushes = pushes + 0.3 * rng.standard_normal(len(TIME_S))
    axis = edge_ident.AxisRecord(measured, pushes, "m", "N", reference=REFERENCE_M)
    return edge_ident.Recording(TIME_S, {"x": axis}, "made.csv")


def followed(position: Array, effort: Array | None = None) -> Tracking:
    found = tracking(recording(position, effort), "x")
    assert found is not None
    return found


MOTOR = np.interp(TIME_S - LAG_S, TIME_S, REFERENCE_M)


@pytest.mark.parametrize("play", [1.2e-3, 2.4e-3])
def test_play_has_its_size_and_its_side(play: float) -> None:
    found = followed(behind_play(MOTOR, play))
    assert found.off
    assert found.step == pytest.approx(play, rel=0.05)
    assert found.lag_s == pytest.approx(LAG_S, rel=0.1)
    assert min(found.stands) > play
    assert found.at_reversals == 1.0
    said = found.sentence("m")
    assert f"it loses {1e3 * found.step:.3g} mm at each reversal" in said
    assert "as with play between motor and encoder" in said
    assert "move the load by hand" in found.next_step


def test_stiction_stands_between_reversals_and_pushes_before_it_lets_go() -> None:
    position = sticking(2e-3)
    found = followed(position, 2e4 * (REFERENCE_M - position))
    assert found.off
    assert found.share > 0.5
    assert found.at_reversals < 0.8
    assert "as stiction" in found.sentence("m")
    assert "lubrication" in found.next_step


@pytest.mark.parametrize("play", [0.0, 1e-4])
def test_an_axis_that_only_lags_is_not_off(play: float) -> None:
    assert not followed(behind_play(MOTOR, play)).off


def test_without_a_reference_that_moves_nothing_is_said() -> None:
    made = recording(MOTOR)
    axis = made.axes["x"]
    for reference in (None, np.zeros_like(REFERENCE_M)):
        other = edge_ident.AxisRecord(axis.position, axis.effort, "m", "N", reference=reference)
        assert tracking(edge_ident.Recording(TIME_S, {"x": other}, "made.csv"), "x") is None


def test_a_diagnosis_that_fits_does_not_say_that_nothing_is_wrong() -> None:
    found = edge_ident.diagnose(recording(behind_play(MOTOR, 2.4e-3)))
    assert found.axes["x"].verdict.value == "adequate"
    (finding,) = (f for f in found.axes["x"].findings if f.code == "off_reference")
    card = diagnosis_card("x", "x", found)
    assert "Nothing is wrong" not in card.verdict
    assert finding.message in card.verdict
    assert "move the load by hand" in card.action[0].lower()


def test_identify_says_it_once(tmp_path: pytest.TempPathFactory) -> None:
    path = f"{tmp_path}/play.csv"
    edge_ident.save_recording(recording(behind_play(MOTOR, 2.4e-3)), path)
    result = CliRunner().invoke(app, ["identify", path])
    assert (result.stdout + result.stderr).count(" at each reversal of the reference") == 1

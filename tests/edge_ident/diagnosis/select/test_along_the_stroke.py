"""What changes along the stroke or with time, in shapes that are no wave: at one place, towards the
ends, in dry friction as well. Formulas of their own, so that none is that of the catalogue."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.result import AxisDiagnosis
from tests.edge_ident.diagnosis.select.test_search_parts import (
    COARSE_S,
    recorded,
    rigid,
    swing,
)
from tests.repetitions import a_few

Array = NDArray[np.float64]

PLACES = [(0.4, 1), (-0.6, 1), (0.4, 2), (-0.6, 2)]
"""And seeds."""


def diagnosed(added: Array, seed: int) -> AxisDiagnosis:
    t, x, v, a = swing(seconds=25.0, period_s=COARSE_S)
    record = recorded(t, x, rigid(v, a) + added, noise=0.02, seed=seed)
    return diagnose([record]).axes["x"]


def at_place(place: float, half_width: float) -> Array:
    """A raised cosine over the position."""
    _, x, _, _ = swing(seconds=25.0, period_s=COARSE_S)
    away = np.clip((x - place) / half_width, -1.0, 1.0)
    return np.asarray(0.5 * (1.0 + np.cos(np.pi * away)))


@pytest.mark.parametrize(("place", "seed"), a_few(PLACES, PLACES[:1]))
def test_a_load_at_one_place_is_no_ripple(place: float, seed: int) -> None:
    axis = diagnosed(0.3 * at_place(place, 0.5), seed)
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.effect == "position_dependent_load"
    assert cause.term.values["place"] == pytest.approx(place, abs=0.03)
    assert cause.term.values["bump"] == pytest.approx(0.3, rel=0.1)


@pytest.mark.parametrize(("place", "seed"), a_few(PLACES, PLACES[:1]))
def test_a_tight_place_is_friction_along_the_stroke(place: float, seed: int) -> None:
    _, _, v, _ = swing(seconds=25.0, period_s=COARSE_S)
    axis = diagnosed(0.4 * at_place(place, 0.5) * np.sign(v), seed)
    assert axis.verdict is Verdict.EXPLAINED
    cause = axis.causes[0]
    assert {one.term.effect for one in axis.causes} == {"position_dependent_friction"}
    assert cause.term.values["place"] == pytest.approx(place, abs=0.03)
    assert cause.term.values["bump"] == pytest.approx(0.4, rel=0.1)


@pytest.mark.parametrize("seed", a_few((1, 2), (1,)))
def test_friction_that_rises_to_the_ends_is_found(seed: int) -> None:
    """As a wave it would have a period of many travels, at the edge of its search."""
    _, x, v, _ = swing(seconds=25.0, period_s=COARSE_S)
    axis = diagnosed(0.05 * (x - 0.2) ** 2 * np.sign(v), seed)
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.effect == "position_dependent_friction"
    assert cause.term.values["curvature"] == pytest.approx(0.05, rel=0.05)


@pytest.mark.parametrize("seed", a_few((1, 2), (1,)))
def test_dry_friction_that_falls_is_a_warm_up(seed: int) -> None:
    t, _, v, _ = swing(seconds=25.0, period_s=COARSE_S)
    axis = diagnosed(0.5 * np.sign(v) / 2.0 ** (t / 5.0), seed)
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.effect == "warm_up"
    assert cause.term.values["dry_excess"] == pytest.approx(0.5, rel=0.05)
    assert cause.term.values["time_constant"] == pytest.approx(5.0 / np.log(2.0), rel=0.1)


@pytest.mark.parametrize("seed", a_few((1, 2), (1,)))
def test_along_one_sinusoid_friction_over_the_speed_is_none_over_the_position(seed: int) -> None:
    """There the square of the speed is a parabola over the position."""
    t = COARSE_S * np.arange(5_000)
    x, v, a = 2.0 * np.sin(t), 2.0 * np.cos(t), -2.0 * np.sin(t)
    record = recorded(t, x, rigid(v, a) + 0.1 * v * np.abs(v), noise=0.02, seed=seed)
    assert not prepare_axis([record], "x").several_speeds
    (cause,) = diagnose([record]).axes["x"].causes
    assert cause.term.effect == "nonlinear_viscous"


def test_a_spring_that_hardens_is_no_inertia_along_one_sinusoid() -> None:
    """Its third power tells it from the inertia there, once the motion has begun."""
    t = np.arange(0.0, 25.0, COARSE_S)
    begun = np.minimum(t, 1.0) ** 2 * (3.0 - 2.0 * np.minimum(t, 1.0))
    x = 1.5 * begun * np.sin(2.0 * np.pi * 0.8 * t)
    v = np.gradient(x, t)
    spring = (2.0 + 3.0 * np.square(x)) * x
    record = recorded(t, x, rigid(v, np.gradient(v, t)) + spring, noise=0.05)
    axis = diagnose([record]).axes["x"]
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.effect == "position_dependent_load"
    assert cause.term.values["cubic"] == pytest.approx(3.0, rel=0.03)
    assert axis.model.parameters[0] == pytest.approx(0.5, rel=0.03)

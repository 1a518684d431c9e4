"""Descents of many nonlinear parameters: each start reaches its own minimum, beside the others."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from edge_ident.diagnosis.fit.candidates import Candidate, candidates, regressors
from edge_ident.diagnosis.fit.library import Grid, ResidualSubspace, ScoredCandidate
from edge_ident.diagnosis.fit.refinement import descended
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.selection import fitted_base
from edge_ident.model.effects import named
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

TRUE = {
    "rate": 25.0,
    "damping_ratio": 0.15,
    "deceleration": 0.2,
    "damping_rate": 0.3,
    "weight": 0.0,
}
"""A soft compliance. The offset of the base model takes its weight: any value is right."""
WRONG = {"damping_ratio": 0.4, "deceleration": 0.5, "damping_rate": 0.6, "weight": 0.05}
NO_WEIGHT = {"weight": 0.0}
RATES = (8.0, 18.0, 35.0, 60.0)


@dataclass(frozen=True)
class Springy:
    """An axis with a compliance, and four starts that are wrong in every parameter.

    Attributes
    ----------
    noise : float
        Sum of squares that is left beside the true parameters.
    """

    subspace: ResidualSubspace
    compliance: Candidate
    grid: Grid
    starts: tuple[ScoredCandidate, ...]
    noise: float


@pytest.fixture(scope="module")
def springy() -> Springy:
    """The recording of a rigid axis, and the effort that the compliance would add."""
    t, x, v, a = swing()
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.01)], "x")
    compliance = next(c for c in candidates(data, False) if c.effect == "coupling_compliance")
    (row,) = regressors(data, fitted_base(data, TEMPLATE).axis, compliance, TRUE)[0]
    data = replace(data, effort=data.effort + 0.4 * row)
    subspace = ResidualSubspace.of(data, fitted_base(data, TEMPLATE))
    grid = {"rate": np.array(RATES)} | {k: np.full(len(RATES), v) for k, v in WRONG.items()}
    at = [{name: values[k : k + 1] for name, values in grid.items()} for k in range(len(RATES))]
    starts = tuple(subspace.score(compliance, one, grid) for one in at)
    truth = subspace.score(compliance, {k: np.array([v]) for k, v in TRUE.items()}, grid)
    return Springy(subspace, compliance, grid, starts, truth.error)


def test_starts_on_both_sides_reach_the_truth(springy: Springy) -> None:
    for end in descended(springy.subspace, springy.starts[1:3], springy.grid):
        found = end.term.nonlinear
        assert end.error < 1.01 * springy.noise
        assert found["rate"] == pytest.approx(TRUE["rate"], rel=0.01)
        assert found["damping_ratio"] == pytest.approx(TRUE["damping_ratio"], rel=0.05)
        assert found["deceleration"] == pytest.approx(TRUE["deceleration"], rel=0.05)
        assert end.term.linear["load_inertia"] == pytest.approx(0.4, rel=0.02)


@pytest.mark.parametrize("rate", [3.8, 4.4])
def test_a_slow_resonance_is_found_in_a_wide_range(rate: float) -> None:
    """A liquid that sloshes at 4 rad/s: a step of the range's would be wider than the resonance."""
    true = {"rate": 4.0, "damping_ratio": 0.05, "deceleration": 0.0, "damping_rate": 0.0}
    t, x, v, a = swing()
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.01)], "x")
    compliance = next(c for c in candidates(data, False) if c.effect == "coupling_compliance")
    (row,) = regressors(data, fitted_base(data, TEMPLATE).axis, compliance, true | NO_WEIGHT)[0]
    data = replace(data, effort=data.effort + 0.4 * row)
    subspace = ResidualSubspace.of(data, fitted_base(data, TEMPLATE))
    values = {"rate": rate, "damping_ratio": 0.1, "deceleration": 0.3, "damping_rate": 0.3}
    at = {name: np.array([value]) for name, value in (values | NO_WEIGHT).items()}
    grid = at | {"rate": np.array([200.0])}
    (end,) = descended(subspace, (subspace.score(compliance, at, grid),), grid)
    assert end.term.nonlinear["rate"] == pytest.approx(4.0, rel=0.01)
    assert end.term.linear["load_inertia"] == pytest.approx(0.4, rel=0.02)


def test_what_changes_nothing_stays(springy: Springy) -> None:
    """Slopes of rounding alone lead nowhere."""
    for end in descended(springy.subspace, springy.starts[1:3], springy.grid):
        assert end.term.nonlinear["weight"] == pytest.approx(WRONG["weight"], rel=1e-3)


def test_descents_do_not_depend_on_those_beside_them(springy: Springy) -> None:
    pairs = [springy.starts[:2], springy.starts[1:3]]
    beside = [descended(springy.subspace, pair, springy.grid) for pair in pairs]
    assert beside[0][1].error == pytest.approx(beside[1][0].error, rel=1e-3)


def test_a_far_start_ends_lower_in_a_minimum_of_its_own(springy: Springy) -> None:
    (end,) = descended(springy.subspace, springy.starts[:1], springy.grid)
    assert springy.noise < end.error < springy.starts[0].error
    bounds = named("coupling_compliance").bounds
    for name, value in end.term.nonlinear.items():
        low, high = bounds[name]
        assert low <= value <= high


def test_where_nothing_near_is_physical_the_start_stays(springy: Springy) -> None:
    """At more than twice the rate, an inertia below zero would fit best."""
    (end,) = descended(springy.subspace, springy.starts[3:], springy.grid)
    assert end is springy.starts[3]
    assert np.isinf(end.error)

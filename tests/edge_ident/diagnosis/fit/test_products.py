"""What is computed from products of matrices is what least squares find."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, candidates, regressors
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit
from edge_ident.diagnosis.fit.held_out import (
    _estimate,
    _orthonormal_directions,
    held_out_residuals,
)
from edge_ident.diagnosis.fit.library import Library, ResidualSubspace
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

Array = NDArray[np.float64]
START = np.array([1.0, 0.0, 0.0, 0.0])
PERIODS = np.array([0.31, 0.5, 1.7])


@pytest.fixture(scope="module")
def data() -> AxisData:
    """An axis with a ripple of half a unit of travel."""
    t, x, v, a = swing()
    ripple = 0.05 * np.cos(2.0 * np.pi / 0.5 * x)
    return prepare_axis([recorded(t, x, rigid(v, a) + ripple, noise=0.01)], "x")


@pytest.fixture(scope="module")
def base(data: AxisData) -> FittedModel:
    """The base model."""
    return fit(data, TEMPLATE, START, ())


def ripple_of(data: AxisData) -> Candidate:
    """The one candidate of its effect."""
    return next(c for c in candidates(data, rotary=True) if c.effect == "torque_ripple")


def left_beside(columns: Array, target: Array) -> float:
    """Sum of squares that least squares leave."""
    fitted = columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return float((target - fitted) @ (target - fitted))


def test_a_library_scores_as_least_squares_do(data: AxisData, base: FittedModel) -> None:
    ripple, points = ripple_of(data), {"period": PERIODS}
    rows = regressors(data, base.axis, ripple, points)[..., data.valid]
    library = Library.of(data, base.axis, {ripple: points})
    subspace = ResidualSubspace.of(data, base)
    for _ in range(2):  # the second time with what was kept
        (scored,) = subspace.score_library(library, {ripple: points}, frozenset())
        known = base.jacobian[data.valid]
        wanted = (data.effort - base.predicted)[data.valid]
        left = [left_beside(np.hstack([known, two.T]), wanted) for two in rows]
        assert scored.term.nonlinear["period"] == PERIODS[int(np.argmin(left))] == 0.5
        assert scored.error == pytest.approx(min(left))
        assert scored.term.linear["cosine"] == pytest.approx(0.05, rel=0.05)


def test_held_out_residuals_are_those_of_fits_to_the_other_blocks(
    data: AxisData, base: FittedModel
) -> None:
    found = held_out_residuals(data, base)
    for fold in range(5):
        out = data.block % 5 == fold
        train = data.valid & ~out
        estimate = np.linalg.lstsq(base.jacobian[train], data.effort[train], rcond=None)[0]
        assert found[out] == pytest.approx(data.effort[out] - base.jacobian[out] @ estimate)


def test_a_difference_that_only_the_held_out_blocks_show_stays_as_it_was() -> None:
    """Dry friction and offset, say, where the axis reverses in one fold only."""
    truth, rng = np.array([3.0, 1.0]), np.random.default_rng(3)
    folds = [np.tile([1.0, 1.0], (20, 1)) for _ in range(5)]
    folds[2][10:, 0] = -1.0
    parts = [np.column_stack([part, part @ truth]) for part in folds]
    unit, length = _orthonormal_directions(np.vstack(parts)[:, :-1])
    directions, nothing = unit / length[:, None], np.empty((0, 2))
    for fold in range(5):
        assert _estimate(parts, fold, directions, nothing, truth) == pytest.approx(truth)
    started = truth + 0.1 * rng.standard_normal(2)
    found = _estimate(parts, 2, directions, nothing, started)
    assert found.sum() == pytest.approx(truth.sum()), "the sum is learned from the other blocks"
    assert found[0] - found[1] == pytest.approx(started[0] - started[1])


def test_a_parameter_that_does_nothing_takes_no_part_in_cross_validation(data: AxisData) -> None:
    """A load on a stiff spring that always slides: its weight is in the base model's offset."""
    nonlinear = {
        "rate": 300.0, "damping_ratio": 0.1, "deceleration": 0.0, "damping_rate": 0.0, "weight": 0.3
    }  # fmt: skip
    compliance = next(c for c in candidates(data, rotary=True) if c.effect == "coupling_compliance")
    residuals = []
    for weight in (0.3, 0.3 * (1.0 + 1e-9)):
        term = FittedTerm(compliance, {**nonlinear, "weight": weight}, {"load_inertia": 0.1})
        residuals.append(held_out_residuals(data, fit(data, TEMPLATE, START, (term,))))
    assert residuals[0] == pytest.approx(residuals[1], abs=1e-9)

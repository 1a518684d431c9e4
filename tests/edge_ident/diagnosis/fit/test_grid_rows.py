"""A search takes regressors over from an earlier one only where they are the same."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.library import Library, grid_rows
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.selection import fitted_base
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing


@pytest.fixture(scope="module")
def search() -> Search:
    """Of a rigid axis."""
    t, x, v, a = swing()
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.01)], "x")
    return Search.of(data, TEMPLATE, fitted_base(data, TEMPLATE))


def moved(data: AxisData) -> AxisData:
    """The same data with the effort a little earlier."""
    return data.with_efforts_of(tuple(s.in_step(s.applied_s + 1e-4) for s in data.segments))


def taken_over(search: Search, data: AxisData, candidate: Candidate) -> bool:
    """Whether a candidate's regressors are those of the search, and not computed again."""
    axis = fitted_base(data, TEMPLATE).axis
    grid = search.grids[candidate]
    rows = Library.of(data, axis, {candidate: grid}, search.library).rows[candidate]
    np.testing.assert_array_equal(rows, grid_rows(data, axis, candidate, grid))
    return np.shares_memory(rows, search.library.rows[candidate])


def test_what_follows_from_the_motion_is_taken_over(search: Search) -> None:
    data = moved(search.data)
    assert not np.array_equal(data.effort, search.data.effort)
    over = {c.effect: taken_over(search, data, c) for c in search.library}
    assert over["torque_ripple"]
    assert over["coupling_compliance"]
    assert not over["encoder_eccentricity"]  # it follows the base model
    assert not over["actuator_deadband"]  # it follows the effort


def test_another_grid_or_other_samples_are_computed(search: Search) -> None:
    data, axis = moved(search.data), search.start.axis
    ripple = next(c for c in search.library if c.effect == "torque_ripple")
    other = {name: 1.01 * values for name, values in search.grids[ripple].items()}
    rows = Library.of(data, axis, {ripple: other}, search.library).rows[ripple]
    np.testing.assert_array_equal(rows, grid_rows(data, axis, ripple, other))
    fewer = replace(data, valid=data.valid & (np.arange(len(data.valid)) % 2 == 0))
    assert not taken_over(search, fewer, ripple)


def test_a_search_of_the_moved_effort_keeps_the_grids(search: Search) -> None:
    """Its base model is another, and the grids of play and compliance begin at that of before."""
    data = moved(search.data)
    start = fitted_base(data, TEMPLATE)
    after = Search.of(data, TEMPLATE, start, search)
    for candidate in after.library:
        points = after.library.points[candidate]
        assert all(np.array_equal(points[k], v) for k, v in search.grids[candidate].items())
        rows = grid_rows(data, start.axis, candidate, points)
        np.testing.assert_array_equal(after.library.rows[candidate], rows)

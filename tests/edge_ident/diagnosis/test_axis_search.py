"""Where a search goes on: what is left of an axis, and what the search already knows."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.axis_search import AxisSearch
from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.judge.judgement import Judgement
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.result import Verdict
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.selection import Selected, SupportedModel, fitted_base
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing


@pytest.fixture(scope="module")
def search() -> Search:
    """An axis with a ripple that is four times its noise, and less than a tolerance of a tenth."""
    t, x, v, a = swing()
    ripple = 0.05 * np.cos(2.0 * np.pi / 0.5 * x)
    data = prepare_axis([recorded(t, x, rigid(v, a) + ripple, noise=0.01)], "x")
    return Search.of(data, TEMPLATE, fitted_base(data, TEMPLATE))


def ripple_of(search: Search) -> Candidate:
    """The one candidate of its effect."""
    return next(c for c in search.library if c.effect == "torque_ripple")


def explained(search: Search) -> FittedModel:
    """With the ripple."""
    term = FittedTerm(ripple_of(search), {"period": 0.5}, {"cosine": 0.05, "sine": 0.0})
    return search.fit(search.start.base, (term,))


def found(search: Search, certain: FittedModel) -> AxisSearch:
    """An axis that is adequate beside a generous tolerance, and all that is certain about it."""
    start = search.start
    supported = SupportedModel(start, (), (), converged=True)
    judged = Judgement(Verdict.ADEQUATE, supported, (), (), 0.0)
    floor = noise_floor(search.data, start)
    return AxisSearch(Selected(search, supported), floor, (), judged)


def test_of_two_selections_the_criterion_says_which_ends_better(search: Search) -> None:
    plain = found(search, search.start).selected
    rippled = replace(plain, supported=SupportedModel(explained(search), (), (), converged=True))
    assert rippled.better_than(plain)
    assert not plain.better_than(rippled)
    assert not plain.better_than(plain)

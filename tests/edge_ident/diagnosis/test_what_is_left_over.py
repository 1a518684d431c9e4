"""What another recording leaves of a model may say less than it did in the whole model."""

import numpy as np
import pytest

from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.selection import SupportedModel, fitted_base
from edge_ident.diagnosis.validation import carry_over, verdict_of_both
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

PERIODS = 0.5, 0.504


def rippled(amplitudes: tuple[float, float], noise: float, seed: int) -> AxisData:
    """Two ripples so much alike that either does for both."""
    t, x, v, a = swing(seed=seed)
    waves = [b * np.cos(2.0 * np.pi / p * x) for b, p in zip(amplitudes, PERIODS, strict=True)]
    return prepare_axis([recorded(t, x, rigid(v, a) + sum(waves), noise, seed)], "x")


def with_both(data: AxisData) -> tuple[FittedModel, FittedModel]:
    start = fitted_base(data, TEMPLATE)
    search = Search.of(data, TEMPLATE, start)
    ripple = next(c for c in search.library if c.effect == "torque_ripple")
    terms = [FittedTerm(ripple, {"period": p}, {"cosine": 0.1, "sine": 0.0}) for p in PERIODS]
    return start, search.fit(start.base, tuple(terms))


def test_a_cause_of_no_certain_size_leaves_with_what_stood_beside_it() -> None:
    """The two cancel in the first recording, of which noise tells the rest; the other one has the
    second of them alone, and noise happens to have its sign."""
    data = rippled((-1.0, 1.0), noise=1.0, seed=8)
    other = rippled((0.0, 3.0), noise=0.02, seed=2)
    start, model = with_both(data)
    _, kept, validation = carry_over(data, other, start, model)
    assert not kept
    first, second = validation.causes
    assert not first.carries_over
    assert second.reason == "beside what carries over, its size is as uncertain as it is large"


@pytest.mark.parametrize("left", [Verdict.EXPLAINED, Verdict.UNEXPLAINED])
def test_an_axis_is_not_explained_by_nothing(left: Verdict) -> None:
    start = fitted_base(rippled((0.0, 0.0), noise=0.02, seed=1), TEMPLATE)
    nothing = SupportedModel(start, (), (), converged=True)
    expected = Verdict.ADEQUATE if left is Verdict.EXPLAINED else left
    assert verdict_of_both(left, nothing, [0], unexplained=False) is expected
    assert verdict_of_both(left, nothing, [0], unexplained=True) is Verdict.UNEXPLAINED

"""A ripple that was found inside the band goes on above it, or it is none."""

import numpy as np
import pytest

from edge_ident.diagnosis.axis_search import AxisSearch, with_ripples_everywhere
from edge_ident.diagnosis.fit.fitting import FittedTerm
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.judge.judgement import Judgement
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.acceptance import Decision
from edge_ident.diagnosis.select.cross_validation import held_out_gain
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.selection import (
    ComparedAlternatives,
    Selected,
    SupportedModel,
    SupportedTerm,
    fitted_base,
)
from edge_ident.signals.recording import Recording
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

PERIOD = 0.05
AMPLITUDE = 0.2


@pytest.fixture(scope="module")
def record() -> Recording:
    """An axis that passes a ripple at 10 Hz where it is slow, and at 60 Hz where it is fast."""
    t, x, v, a = swing()
    ripple = AMPLITUDE * np.cos(2.0 * np.pi / PERIOD * x)
    return recorded(t, x, rigid(v, a) + ripple, noise=0.02)


def explained_by(record: Recording, period: float, amplitude: float) -> AxisSearch:
    """A search that ended with a ripple of this period."""
    data = prepare_axis([record], "x")
    start = fitted_base(data, TEMPLATE)
    search = Search.of(data, TEMPLATE, start)
    ripple = next(c for c in search.library if c.effect == "torque_ripple")
    term = FittedTerm(ripple, {"period": period}, {"cosine": amplitude, "sine": 0.0})
    model = search.fit(start.base, (term,))
    gain = held_out_gain(data, start, model)
    support = SupportedTerm(gain, Decision(True, "", 1.0), ComparedAlternatives(None, None, tuple))
    supported = SupportedModel(model, (support,), (), converged=True)
    judged = Judgement(Verdict.EXPLAINED, supported, (), (), 0.0)
    floor = noise_floor(data, start)
    return AxisSearch(Selected(search, supported), floor, (), judged)


def test_a_ripple_that_goes_on_above_the_band_stays(record: Recording) -> None:
    found = explained_by(record, PERIOD, AMPLITUDE)
    assert with_ripples_everywhere(found, [record], "x", 0.01) is found


def test_a_ripple_that_is_not_there_above_the_band_is_suspected() -> None:
    """The axis shows another one at the places where it is slow."""
    t, x, v, a = swing()
    slow = np.abs(v) < 0.5
    record = recorded(t, x, rigid(v, a) + slow * np.cos(2.0 * np.pi / PERIOD * x), noise=0.02)
    found = with_ripples_everywhere(explained_by(record, PERIOD, 1.0), [record], "x", 0.01)
    assert found.judged.supported.model.terms == ()
    (suspected,) = found.judged.suspected
    assert suspected.term.effect == "torque_ripple"
    assert suspected.decision.startswith("above the band")
    assert found.judged.verdict is Verdict.UNEXPLAINED

"""Terms take their best values beside those that entered later."""

import numpy as np
import pytest

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.selection import polished
from edge_ident.model.effects import named
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

PERIOD = 0.9371


def ripple(period: float) -> FittedTerm:
    (form,) = named("torque_ripple").search.forms
    none = dict.fromkeys(form.linear, 0.0)
    return FittedTerm(Candidate("torque_ripple", form), {"period": period}, none)


def test_a_term_takes_the_best_point_beside_the_others() -> None:
    """It entered at another one, when the others were not there yet."""
    t, x, v, a = swing()
    wave = 0.3 * np.sin(2.0 * np.pi * x / PERIOD)
    data = prepare_axis([recorded(t, x, rigid(v, a) + wave, noise=0.01)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    right = search.fit(start.base, (ripple(PERIOD),))
    entered = search.fit(start.base, (ripple(1.05),))
    (found,) = polished(search, entered).terms
    assert found.nonlinear["period"] == pytest.approx(PERIOD, rel=1e-3)
    assert found.linear["sine"] == pytest.approx(0.3, rel=0.05)
    again = polished(search, right).terms
    assert again[0].nonlinear["period"] == pytest.approx(PERIOD, rel=1e-3)

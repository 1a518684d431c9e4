"""Beside its causes an effort is in step where it was moved out of step before they were known."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.second_looks import data_beside_causes
from edge_ident.diagnosis.select.selection import Selected, SupportedModel, grown_model, moved_model
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, swing

SLOW_S = 0.02
EARLY = 0.8
"""Sampling periods."""


def one_term(name: str, **values: float) -> FittedTerm:
    """A term that is to be fitted, at some nonlinear parameters."""
    form = named(name).search.forms[0]
    nonlinear = {key: values.get(key, 0.0) for key in form.nonlinear}
    return FittedTerm(Candidate(name, form), nonlinear, dict.fromkeys(form.linear, 0.1))


DEAD_BAND = one_term("actuator_deadband", width=1.5)
DAMPED = one_term("coupling_compliance", rate=25.0, damping_ratio=0.9)


@pytest.fixture(scope="module")
def data() -> AxisData:
    """A drive whose dead band is half its effort, and whose command is recorded early."""
    t, x, v, a = swing(40.0, period_s=SLOW_S)
    torque = 0.5 * a + 0.8 * v + 0.2 * np.tanh(20.0 * v)
    command = torque + 1.5 * np.tanh(40.0 * torque)
    command = np.interp(t + EARLY * SLOW_S, t, command)
    return prepare_axis([recorded(t, x, command, noise=0.01)], "x")


def selected(data: AxisData, *terms: FittedTerm, known: AxisModel = TEMPLATE) -> Selected:
    """What a search ends with that has found these, besides what was known."""
    start = fit(data, known, np.zeros(4), ())
    search = Search.of(data, known, start)
    model = search.fit(start.base, terms)
    return Selected(search, SupportedModel(model, (), (), True))


def out_by(data: AxisData, samples: float) -> AxisData:
    """The data with every effort moved so far out of step."""
    (segment,) = data.segments
    moved = segment.in_step((samples - EARLY) * SLOW_S)
    moved = replace(moved, timing_column=segment.timing_column)
    effort = moved.effort[moved.sample_index]
    return replace(data, segments=(moved,), effort=effort)


@pytest.mark.parametrize("others", [(), (DAMPED,)], ids=["alone", "beside a spring"])
def test_an_effort_out_of_step_is_moved_beside_its_dead_band(
    data: AxisData, others: tuple[FittedTerm, ...]
) -> None:
    before = selected(out_by(data, 1.5), DEAD_BAND, *others)
    found = data_beside_causes(before)
    assert found is not None
    assert found.segments[0].applied_s / SLOW_S == pytest.approx(-EARLY, abs=0.25)
    after = fit(found, TEMPLATE, np.zeros(4), (DEAD_BAND,))
    assert after.error < before.supported.model.error
    assert data_beside_causes(selected(found, DEAD_BAND)) is None


def test_the_first_causes_show_the_shift_before_the_others(data: AxisData) -> None:
    first = grown_model(out_by(data, 1.5), TEMPLATE)
    found = data_beside_causes(first)
    assert found is not None
    assert found.segments[0].applied_s / SLOW_S == pytest.approx(-EARLY, abs=0.25)
    again = moved_model(found, first).supported.model
    assert again.terms[0].candidate.effect == "actuator_deadband"
    assert again.terms[0].nonlinear["width"] == pytest.approx(1.5, rel=0.02)


def test_an_effort_is_moved_beside_what_is_known(data: AxisData) -> None:
    known = AxisModel((*TEMPLATE.terms, DEAD_BAND.model_term))
    found = data_beside_causes(selected(out_by(data, 1.5), known=known))
    assert found is not None
    assert found.segments[0].applied_s / SLOW_S == pytest.approx(-EARLY, abs=0.25)


def test_an_effort_in_step_stays_where_it_is(data: AxisData) -> None:
    assert data_beside_causes(selected(out_by(data, 0.0), DEAD_BAND)) is None


def test_without_a_cause_nothing_is_moved(data: AxisData) -> None:
    assert data_beside_causes(selected(out_by(data, 1.5))) is None

"""A delay that a larger cause hides is asked for beside that cause."""

import numpy as np
import pytest

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.second_looks import delayed_data
from edge_ident.diagnosis.select.selection import Selected, SupportedModel
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS
from edge_ident.model.motion import LARGEST_SHIFT
from edge_ident.model.search import Form
from edge_ident.signals.metrics import rms
from tests.edge_ident.diagnosis.select.test_search_parts import (
    PERIOD_S,
    TEMPLATE,
    recorded,
    rigid,
    swing,
)

RIPPLE_PERIOD = 0.31
WAVE = FittedTerm(
    Candidate("torque_ripple", Form(("cosine", "sine"), ("period",))),
    {"period": RIPPLE_PERIOD},
    {"cosine": 0.0, "sine": 0.0},
)
DELAY = FittedTerm(Candidate("time_delay", Form(("delay",))), {}, {"delay": 0.0})


def late(samples: float, ripple: float, shake: float = 0.0) -> AxisData:
    """A drive whose effort is recorded late."""
    t, x, v, a = swing(10.0)
    effort = rigid(v, a) + ripple * np.sin(2.0 * np.pi * x / RIPPLE_PERIOD)
    effort = effort + shake * np.sin(2.0 * np.pi * 3.7 * t)
    effort = np.interp(t - samples * PERIOD_S, t, effort)
    return prepare_axis([recorded(t, x, effort, noise=0.01)], "x")


def hidden(data: AxisData, *terms: FittedTerm) -> AxisData | None:
    """The data once the search has ended with the ripple, and more."""
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    model = search.fit(start.base, (WAVE, *terms))
    return delayed_data(Selected(search, SupportedModel(model, (), (), True)))


def test_a_delay_beside_a_larger_ripple_is_found() -> None:
    data = late(8.0, ripple=0.3)
    assert not data.late
    found = hidden(data)
    assert found is not None
    assert found.late
    start = fit(found, TEMPLATE, np.zeros(4), ())
    model = fit(found, TEMPLATE, start.base, (WAVE, DELAY))
    assert model.terms[-1].linear["delay"] == pytest.approx(8.0 * PERIOD_S, rel=0.02)


def test_a_spring_that_took_the_place_of_a_delay_hides_it_no_more() -> None:
    (form,) = named("coupling_compliance").search.forms
    soft = {"rate": 25.0, "damping_ratio": 0.5}
    nonlinear = {name: soft.get(name, 0.0) for name in form.nonlinear}
    spring = FittedTerm(Candidate("coupling_compliance", form), nonlinear, {"load_inertia": 0.1})
    found = hidden(late(8.0, ripple=0.3), spring)
    assert found is not None
    assert found.late


def test_a_delay_beside_a_vibration_from_outside_is_found() -> None:
    """The vibration is no cause, and leaves what no delay would take."""
    place = {"begin": 0.0, "end": 15.0, "clock": 0.0}
    shake = FittedTerm(VIBRATION, {"frequency": 3.7, **place}, {"cosine": 0.0, "sine": 0.0})
    found = hidden(late(8.0, ripple=0.3, shake=0.5), shake)
    assert found is not None
    assert found.late


@pytest.mark.parametrize("samples", [-1.0, 1.0])
def test_what_timing_explains_is_no_delay_beside_a_ripple(samples: float) -> None:
    assert hidden(late(samples, ripple=0.3)) is None


def test_the_base_model_has_its_timing_where_the_effort_is_later_than_that() -> None:
    """As if the effort were moved by as much, at fast parts of the motion, too."""
    t = np.arange(0.0, 10.0, PERIOD_S)
    rates = 2.0 * np.pi * np.array([0.3, 1.1, 9.0])
    angles, sizes = np.outer(rates, t), 1.0 / rates**2
    x, a = sizes @ np.sin(angles), -np.sum(np.sin(angles), axis=0)
    effort = 5.0 * a + 0.8 * (sizes * rates) @ np.cos(angles)
    effort = np.interp(t - 1.9 * PERIOD_S, t, effort)
    data = prepare_axis([recorded(t, x, effort, noise=0.01)], "x")
    assert data.late
    (segment,) = data.segments
    moved = segment.in_step(LARGEST_SHIFT * segment.raw_period_s)
    start = fit(data, TEMPLATE, np.zeros(4), ())
    columns = start.derivatives[data.valid, : len(PARAMETERS)]
    target = moved.effort[moved.sample_index][data.valid]
    left = rms(target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0])
    assert rms((data.effort - start.predicted)[data.valid]) < 1.1 * left


def test_a_delay_is_scored_as_it_is_fitted() -> None:
    """To first order a delay of two samples may leave more than timing alone."""
    data = late(2.5, ripple=0.0)
    assert data.late
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    best = search.score(start)[0]
    assert best.candidate == DELAY.candidate
    assert best.term.linear["delay"] == pytest.approx(2.5 * PERIOD_S, rel=0.02)
    assert best.error == pytest.approx(search.fit(start.base, (best.term,)).error)

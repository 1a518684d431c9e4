"""Backward elimination drops what the rule refuses, and says when it did not come to an end."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.judge.judgement import Rules, judge
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.result import Refused
from edge_ident.diagnosis.select import backward_elimination, selection
from edge_ident.diagnosis.select.backward_elimination import SupportedModel, eliminate_backward
from edge_ident.diagnosis.select.cross_validation import near_zero
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.thresholds import MOST_ROUNDS
from edge_ident.model.effects import named
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing


@pytest.fixture(scope="module")
def superfluous() -> tuple[Search, FittedModel]:
    """A rigid axis, and a model of it that has friction by direction besides."""
    t, x, v, a = swing(seconds=12.0)
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.05)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    form = named("asymmetric_friction").search.forms[0]
    added = FittedTerm(Candidate("asymmetric_friction", form), {}, dict.fromkeys(form.linear, 0.0))
    return search, search.fit(start.base, (added,))


def test_a_superfluous_term_leaves_and_says_why(superfluous: tuple[Search, FittedModel]) -> None:
    supported = eliminate_backward(*superfluous)
    assert supported.converged
    assert supported.model.terms == ()
    (refused,) = supported.refused
    assert refused.effect == "asymmetric_friction"
    assert "units better" in refused.reason
    assert "more than 0 to stay" in refused.reason


def test_too_few_rounds_say_that_it_did_not_converge(
    superfluous: tuple[Search, FittedModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(backward_elimination, "MOST_ROUNDS", replace(MOST_ROUNDS, value=0))
    supported = eliminate_backward(*superfluous)
    assert not supported.converged
    assert len(supported.model.terms) == len(supported.support) == 1


def test_nothing_is_named_of_a_selection_that_did_not_converge(
    superfluous: tuple[Search, FittedModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(backward_elimination, "MOST_ROUNDS", replace(MOST_ROUNDS, value=0))
    t, x, v, a = swing(seconds=12.0)
    effort = rigid(v, a) + 0.4 * v**2 * np.sign(v)
    search = Search.of(
        data := prepare_axis([recorded(t, x, effort, noise=0.05)], "x"),
        TEMPLATE,
        fit(data, TEMPLATE, np.zeros(4), ()),
    )
    form = named("nonlinear_viscous").search.forms[0]
    bends = FittedTerm(
        Candidate("nonlinear_viscous", form), {"exponent": 2.0}, dict.fromkeys(form.linear, 0.0)
    )
    start = search.criterion.start
    model = search.fit(start.base, (bends, *superfluous[1].terms))
    floor = noise_floor(search.data, model)
    supported = eliminate_backward(search, model)
    assert [s.decision.accepted for s in supported.support] == [True, False]
    for converged, names in ((True, ["nonlinear_viscous"]), (False, [])):
        judged = judge(search, start, replace(supported, converged=converged), floor, Rules())
        assert [t.candidate.effect for t in judged.supported.model.terms] == names
    assert {cause.term.effect for cause in judged.suspected} == model.effects
    assert judged.verdict is Verdict.UNEXPLAINED


def test_what_would_leave_in_one_more_round_is_only_suspected(
    superfluous: tuple[Search, FittedModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(backward_elimination, "MOST_ROUNDS", replace(MOST_ROUNDS, value=0))
    search, supported = superfluous[0], eliminate_backward(*superfluous)
    start, floor = search.criterion.start, noise_floor(search.data, search.criterion.start)
    judged = judge(search, start, supported, floor, Rules())
    assert judged.supported.model.terms == ()
    (doubtful,) = judged.suspected
    assert "more than 0 to stay" in doubtful.decision


def test_what_was_replaced_may_return_when_what_replaced_it_has_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    t, x, v, a = swing(seconds=12.0)
    effort = rigid(v, a) + 0.2 * np.sin(2.0 * np.pi * x / 0.31)
    data = prepare_axis([recorded(t, x, effort, noise=0.05)], "x")
    lost = (
        Refused("torque_ripple", "", instead="asymmetric_friction"),
        Refused("asymmetric_friction", ""),
    )
    models = []

    def first_without_any(search: Search, model: FittedModel) -> SupportedModel:
        models.append(model)
        if len(models) > 1:
            return eliminate_backward(search, model)
        return SupportedModel(search.criterion.start, (), lost, converged=True)

    monkeypatch.setattr(selection, "eliminate_backward", first_without_any)
    found = selection.selected_model(data, TEMPLATE).supported
    assert found.model.effects == {"torque_ripple"}
    assert len(models) == 2
    assert "asymmetric_friction" not in models[1].effects


def test_a_diagnosis_says_whether_it_converged() -> None:
    t, x, v, a = swing(seconds=12.0)
    axis = diagnose([recorded(t, x, rigid(v, a), noise=0.05)]).axes["x"]
    assert axis.converged
    assert axis.refused == ()


@pytest.mark.parametrize(("period", "determined"), [(0.31, True), (40.0, False)])
def test_what_repeats_has_a_period_that_the_data_determine(period: float, determined: bool) -> None:
    """A small part of a wave is as well a part of one twice as long."""
    t, x, v, a = swing()
    angle = 2.0 * np.pi / period * x + 0.8
    wave = np.cos(angle)
    effort = rigid(v, a) + 0.1 * (wave - np.mean(wave)) / np.std(wave)
    data = prepare_axis([recorded(t, x, effort, noise=0.05)], "x")
    ripple = Candidate("torque_ripple", named("torque_ripple").search.forms[0])
    term = FittedTerm(ripple, {"period": period}, {"cosine": 0.0, "sine": 0.0})
    model = fit(data, TEMPLATE, np.zeros(4), (term,))
    assert near_zero(data, model) == [() if determined else ("period",)]


def test_in_place_of_a_wave_that_nothing_bounds_comes_a_simpler_form() -> None:
    t, x, v, a = swing()
    data = prepare_axis([recorded(t, x, rigid(v, a) + 0.3 * x, noise=0.1)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    wave = next(f for f in named("position_dependent_load").search.forms if f.nonlinear)
    load = Candidate("position_dependent_load", wave)
    term = FittedTerm(load, {"period": 40.0}, {"cosine": 0.0, "sine": 0.0})
    supported = eliminate_backward(search, search.fit(start.base, (term,)))
    (left,) = supported.model.terms
    assert left.linear == {"stiffness": pytest.approx(0.3, rel=0.05)}
    assert supported.refused == (), "the effect stays"

"""The search leaves out, exchanges and adds terms, and says when it did not come to an end."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit
from edge_ident.diagnosis.fit.library import ScoredCandidate
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.judge.judgement import judge
from edge_ident.diagnosis.measures import TOLERANCE, Verdict
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select import selection
from edge_ident.diagnosis.select.cross_validation import near_zero
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.selection import different_first, settle
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
    supported = settle(*superfluous)
    assert supported.converged
    assert supported.model.terms == ()
    (refused,) = supported.refused
    assert refused.effect == "asymmetric_friction"
    assert "units better" in refused.reason
    assert "more than 0 to stay" in refused.reason


def test_too_few_rounds_say_that_it_did_not_converge(
    superfluous: tuple[Search, FittedModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(selection, "MOST_ROUNDS", 0)
    supported = settle(*superfluous)
    assert not supported.converged
    assert len(supported.model.terms) == len(supported.support) == 1


def test_nothing_is_named_of_a_selection_that_did_not_converge(
    superfluous: tuple[Search, FittedModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(selection, "MOST_ROUNDS", 0)
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
    start = search.start
    model = search.fit(start.base, (bends, *superfluous[1].terms))
    floor = noise_floor(search.data, model)
    supported = settle(search, model)
    assert [s.decision.accepted for s in supported.support] == [True, False]
    for converged, names in ((True, ["nonlinear_viscous"]), (False, [])):
        judged = judge(search, replace(supported, converged=converged), floor, TOLERANCE)
        assert [t.candidate.effect for t in judged.supported.model.terms] == names
    assert {cause.term.effect for cause in judged.suspected} == model.effects
    assert judged.verdict is Verdict.UNEXPLAINED


def test_what_would_leave_in_one_more_round_is_only_suspected(
    superfluous: tuple[Search, FittedModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(selection, "MOST_ROUNDS", 0)
    search, supported = superfluous[0], settle(*superfluous)
    floor = noise_floor(search.data, search.start)
    judged = judge(search, supported, floor, TOLERANCE)
    assert judged.supported.model.terms == ()
    (doubtful,) = judged.suspected
    assert "more than 0 to stay" in doubtful.decision


def test_from_a_wrong_cause_the_search_comes_to_the_right_ones(
    superfluous: tuple[Search, FittedModel],
) -> None:
    t, x, v, a = swing(seconds=12.0)
    effort = rigid(v, a) + 0.2 * np.sin(2.0 * np.pi * x / 0.31) + 0.4 * v**2 * np.sign(v)
    data = prepare_axis([recorded(t, x, effort, noise=0.05)], "x")
    search = Search.of(data, TEMPLATE, fit(data, TEMPLATE, np.zeros(4), ()))
    wrong = search.fit(search.start.base, superfluous[1].terms)
    supported = settle(search, wrong)
    assert supported.converged
    assert supported.model.effects == {"torque_ripple", "nonlinear_viscous"}
    assert [refused.effect for refused in supported.refused] == ["asymmetric_friction"]


def scored(effect: str, form: int, error: float, source: str | None = None) -> ScoredCandidate:
    candidate = Candidate(effect, named(effect).search.forms[form], source)
    return ScoredCandidate(FittedTerm(candidate, {}, {}), error)


def test_the_best_of_each_kind_comes_before_other_forms_of_the_same() -> None:
    """The weight of a joint that follows the own angle in three forms leaves room for the one that
    follows the sum of two angles."""
    spring, parabola = (scored("position_dependent_load", k, 1.0 + k) for k in (0, 2))
    both = scored("position_dependent_load", 5, 4.0, source="y")
    coupling = scored("cross_axis_coupling", 0, 5.0, source="y")
    ranked = [spring, parabola, both, coupling]
    assert different_first(ranked) == [spring, both, coupling, parabola]


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
    supported = settle(search, search.fit(start.base, (term,)))
    (left,) = supported.model.terms
    assert left.linear == {"stiffness": pytest.approx(0.3, rel=0.05)}
    assert supported.refused == (), "the effect stays"

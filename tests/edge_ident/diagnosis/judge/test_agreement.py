"""A model that all disturbed runs lead to, and the undisturbed data do not."""

from dataclasses import dataclass

import numpy as np
import pytest

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit
from edge_ident.diagnosis.fit.summary import base_space, own_efforts
from edge_ident.diagnosis.judge.stability import DisturbedRuns, agreed
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.backward_elimination import SupportedModel
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.effects import named
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

PERIOD = 0.31


@dataclass(frozen=True)
class Rippled:
    """An axis with a ripple, and models of it."""

    search: Search
    start: FittedModel

    def model(self, *periods: float) -> FittedModel:
        """With a ripple of each period."""
        return self.waves(*(("torque_ripple", period) for period in periods))

    def waves(self, *waves: tuple[str, float]) -> FittedModel:
        """With a wave of each effect and period."""
        terms = []
        for effect, period in waves:
            forms = named(effect).search.forms
            form = next(form for form in forms if form.nonlinear == ("period",))
            zero = dict.fromkeys(form.linear, 0.0)
            terms.append(FittedTerm(Candidate(effect, form), {"period": period}, zero))
        return self.search.fit(self.start.base, tuple(terms))

    def runs(self, *models: FittedModel) -> DisturbedRuns:
        """Disturbed runs that found these models."""
        data = self.search.data
        space = base_space(data, self.start)
        efforts = tuple(own_efforts(data, model, space) for model in models)
        return DisturbedRuns(data, space, models, efforts)

    def selected(self, *periods: float) -> SupportedModel:
        """What the undisturbed data lead to."""
        return SupportedModel(self.model(*periods), (), (), converged=True)


def with_ripples(*periods: float) -> Rippled:
    t, x, v, a = swing(seconds=12.0)
    effort = rigid(v, a) + sum(0.3 * np.sin(2.0 * np.pi * x / period) for period in periods)
    data = prepare_axis([recorded(t, x, effort, noise=0.05)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    return Rippled(Search.of(data, TEMPLATE, start), start)


@pytest.fixture(scope="module")
def rippled() -> Rippled:
    return with_ripples(PERIOD)


def test_what_all_disturbed_runs_find_takes_the_place_of_what_none_finds(rippled: Rippled) -> None:
    runs = rippled.runs(*[rippled.model(PERIOD)] * 4)
    found, times = agreed(rippled.search, rippled.start, rippled.selected(0.47), runs)
    (term,) = found.model.terms
    assert times == [4]  # the undisturbed one does not
    assert term.nonlinear["period"] == pytest.approx(PERIOD, rel=0.02)
    assert len(found.support) == 1


def test_runs_that_disagree_replace_nothing(rippled: Rippled) -> None:
    right, other = rippled.model(PERIOD), rippled.model(0.47)
    selected = rippled.selected(0.22)
    runs = rippled.runs(right, right, right, other)
    assert agreed(rippled.search, rippled.start, selected, runs) == (selected, [1])


def test_runs_that_find_nothing_replace_nothing(rippled: Rippled) -> None:
    selected = rippled.selected(0.47)
    runs = rippled.runs(*[rippled.start] * 4)
    assert agreed(rippled.search, rippled.start, selected, runs) == (selected, [1])


def test_a_model_that_is_found_again_stays(rippled: Rippled) -> None:
    selected = rippled.selected(PERIOD)
    runs = rippled.runs(*[rippled.model(PERIOD)] * 4)
    assert agreed(rippled.search, rippled.start, selected, runs) == (selected, [5])


def test_what_the_runs_find_of_the_selected_model_stays() -> None:
    """One run finds less than the others: what it finds, all do."""
    two = with_ripples(PERIOD, 0.8)
    runs = two.runs(two.model(PERIOD), *[two.model(PERIOD, 0.8)] * 3)
    selected = two.selected(PERIOD, 0.8, 0.47)
    assert agreed(two.search, two.start, selected, runs) == (selected, [5, 4, 1])


def test_runs_that_add_nothing_replace_nothing(rippled: Rippled) -> None:
    """The lift's spring, which no run found beside event and friction, went unsaid: three terms
    became the two that the runs agreed on, whose event was a little better without the spring."""
    selected = rippled.selected(1.004 * PERIOD, 0.47)
    runs = rippled.runs(*[rippled.model(PERIOD)] * 4)
    assert agreed(rippled.search, rippled.start, selected, runs) == (selected, [5, 1])


@pytest.mark.parametrize("effect", ["torque_ripple", "position_dependent_load"])
def test_slow_waves_that_trade_places_are_found_by_what_they_add_up_to(effect: str) -> None:
    """A load along the stroke and a ripple have one formula."""
    slow = with_ripples(5.0)
    model, run = slow.model(4.5, 6.0), slow.waves((effect, 15.0), ("torque_ripple", 5.5))
    space = base_space(slow.search.data, slow.start)
    efforts = [own_efforts(slow.search.data, one, space) for one in (model, run)]
    for effort in efforts[0]:
        apart = np.sqrt(np.mean((efforts[1] - effort) ** 2, axis=1) / np.mean(effort**2))
        assert np.all(apart > 0.5), "no wave is that of the run"
    assert slow.runs(run, run).times_found(model) == [2, 2]


def test_a_wave_that_no_run_finds_is_not_found_beside_a_stronger_one(rippled: Rippled) -> None:
    model, run = rippled.model(PERIOD, 0.47), rippled.model(PERIOD)
    assert rippled.runs(run, run, run).times_found(model) == [3, 0]

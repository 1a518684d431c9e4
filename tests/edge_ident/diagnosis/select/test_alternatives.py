"""Which alternatives a motion separates from a cause, and which it does not."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.acceptance import separable
from edge_ident.diagnosis.select.alternatives import (
    _fitted_alternative,
    compare_alternatives,
)
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.selection import fitted_base
from edge_ident.model.model import Term
from tests.edge_ident.diagnosis.select.test_search_parts import (
    COARSE_S,
    TEMPLATE,
    diagnosed,
    recorded,
    rigid,
    swing,
)


def alternatives(
    t: np.ndarray,
    x: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    *,
    period: float = 6.0,
    noise: float = 0.05,
) -> dict:
    """Alternatives of the only cause, by effect, where a wave acts along the stroke."""
    effort = rigid(v, a) + 0.15 * np.sin(2.0 * np.pi * x / period)
    (cause,) = diagnosed(recorded(t, x, effort, noise=noise)).causes
    return {cause.term.effect: None, **{other.effect: other for other in cause.alternatives}}


def test_in_one_direction_a_ripple_and_friction_along_the_stroke_are_the_same() -> None:
    t = np.arange(0.0, 10.0, 1e-3)
    x = 2.0 * t + 0.5 * np.sin(1.3 * t) + 0.2 * np.sin(3.1 * t + 1.0)
    v = 2.0 + 0.65 * np.cos(1.3 * t) + 0.62 * np.cos(3.1 * t + 1.0)
    a = -0.845 * np.sin(1.3 * t) - 1.922 * np.sin(3.1 * t + 1.0)
    assert v.min() > 0.0
    found = alternatives(t, x, v, a)
    pair = {"torque_ripple", "position_dependent_friction"}
    assert pair <= set(found)
    (other,) = (found[effect] for effect in pair if found[effect] is not None)
    assert not other.separable
    assert "as small" in other.evidence
    assert other.experiment, "the motion that separates them"


def test_in_both_directions_the_two_are_separable() -> None:
    found = alternatives(*swing(seconds=10.0, period_s=COARSE_S))
    others = [alternative for alternative in found.values() if alternative is not None]
    assert found["position_dependent_load"] is None, "the cause: a wave along the stroke is a load"
    fitted = [other for other in others if other.term is not None]
    assert fitted
    assert all(other.separable for other in fitted)
    assert {"torque_ripple", "position_dependent_friction"} <= {o.effect for o in others}


def test_an_alternative_that_was_not_fitted_says_what_it_would_leave() -> None:
    """None is named that one axis alone cannot show."""
    motion = swing(seconds=10.0, period_s=COARSE_S)
    others = [other for other in alternatives(*motion).values() if other is not None]
    unfitted = [other for other in others if other.term is None]
    assert unfitted
    assert "cross_axis_coupling" not in {other.effect for other in others}
    for other in unfitted:
        assert re.search(r"[1-9][0-9]*% larger, at the best values|not physical", other.evidence)


@pytest.mark.parametrize("waves", [1.07, 1.63])
def test_a_wave_that_hardly_repeats_is_a_load_or_a_ripple(waves: float) -> None:
    """The two have one formula, and different grids to search it on. With little noise, even a
    small difference of their periods is a difference of their residuals."""
    motion = swing(seconds=10.0, period_s=COARSE_S)
    found = alternatives(*motion, period=float(np.ptp(motion[1])) / waves, noise=0.002)
    pair = {"torque_ripple", "position_dependent_load"}
    (other,) = (found[effect] for effect in pair if found[effect] is not None)
    assert not other.separable
    larger = re.search(r"\(([+-][0-9.]+)%\)", other.evidence)
    assert larger is not None
    assert abs(float(larger[1])) < 1.0


def test_a_resolver_that_errs_twice_a_turn_is_no_inertia_along_the_stroke() -> None:
    """Both grow with the acceleration and with the speed squared."""
    t, x, v, a = swing(seconds=10.0, period_s=COARSE_S)
    x, v, a = 4.0 * x, 4.0 * v, 4.0 * a
    read = x + 1.5e-3 * np.cos(2.0 * x + 0.4)
    (cause,) = diagnosed(recorded(t, read, rigid(v, a), noise=0.5)).causes
    assert cause.term.effect == "encoder_eccentricity"
    assert cause.term.values["period"] == pytest.approx(np.pi)


def test_an_alternative_that_fits_better_leaves_less() -> None:
    term = Term("torque_ripple", {"cosine": 0.1, "sine": 0.0, "period": 1.0})
    other = SimpleNamespace(error=0.9, terms=(SimpleNamespace(model_term=term),))
    search = SimpleNamespace(gain=lambda before, after: 20.0, noise=0.0)
    cause, rest = SimpleNamespace(error=1.0), SimpleNamespace(error=2.0)
    found = _fitted_alternative(search, cause, rest, other)  # type: ignore[arg-type]
    assert "5.1% smaller, and both leave more than that" in found.evidence


def test_ten_units_separate() -> None:
    assert separable(10.0)
    assert not separable(9.99)


def test_what_fits_worse_than_nothing_is_no_alternative_however_large_its_discrepancy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A fit that has run away has an effort so large that its discrepancy covers every residual."""
    t, x, v, a = swing(seconds=10.0, period_s=COARSE_S)
    effort = rigid(v, a) + 0.15 * np.sin(2.0 * np.pi * x / 2.0)
    data = prepare_axis([recorded(t, x, effort, noise=0.05)], "x")
    start = fitted_base(data, TEMPLATE)
    search = Search.of(data, TEMPLATE, start)
    scored = search.score(start, frozenset())
    ripple = next(s.term for s in scored if s.candidate.effect == "torque_ripple")
    model = search.fit(start.base, (ripple,))

    def run_away(rest: np.ndarray, terms: tuple[FittedTerm, ...]) -> FittedModel:
        found = fit(data, TEMPLATE, rest, terms)
        return replace(found, error=1e3 * start.error) if len(terms) == 1 else found

    def discrepancy(fitted: FittedModel) -> float:
        return 1e9 if fitted.error > start.error else 0.0

    monkeypatch.setattr(Search, "fit", lambda self, base, terms: run_away(base, terms))
    monkeypatch.setattr(Search, "discrepancy", lambda self, fitted: discrepancy(fitted))
    compared = compare_alternatives(search, model, 0)
    assert compared.alternatives
    assert compared.replacement is None
    assert all(alternative.separable for alternative in compared.alternatives)

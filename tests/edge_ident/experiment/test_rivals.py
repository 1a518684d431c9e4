"""What a diagnosis leaves open becomes pairs; what belongs to a time does not come back."""

import math
from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.result import AxisDiagnosis, NotTestable
from edge_ident.experiment.compared import Compared, base_columns, key, term_columns, term_effort
from edge_ident.experiment.rivals import (
    DECIDED,
    Pair,
    Rivals,
    Typical,
    Why,
    distance,
    error_probability,
    rivals,
)
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, AxisModel
from edge_ident.signals.metrics import rms
from tests.edge_ident.experiment.problems import case_of, cause, rival_pair, term

STRIBECK = term("stribeck_friction", level=0.4, speed=0.3)
VISCOUS = term("nonlinear_viscous", quadratic=0.1)
HYSTERESIS = term("presliding_hysteresis", level=0.4, distance=0.01)
EVENT = term("disturbance_event", effort=0.3, start=3.0, duration=1.0)


@pytest.fixture(scope="module")
def typical() -> Typical:
    case = case_of(*rival_pair("stribeck_friction", "nonlinear_viscous"))
    problem = case.problem
    compared = problem.compared(case.named)
    assert isinstance(compared, Compared)
    effort = rms(base_columns(compared, problem.base).effort)
    return Typical(problem.base, problem.judge.excitation, compared, effort, None)


@pytest.fixture
def axis() -> AxisDiagnosis:
    _, diagnosis = rival_pair("stribeck_friction", "nonlinear_viscous")
    found = diagnosis.axes["x"]
    return replace(found, causes=(), suspected=(), not_testable=())


def with_terms(axis: AxisDiagnosis, *terms) -> AxisModel:
    return replace(axis.model, terms=(axis.model.terms[0], *terms))


def pairs(found: Rivals) -> set[tuple[str, str | None, Why]]:
    return {
        (p.first.effect, None if p.second is None else p.second.effect, p.why) for p in found.pairs
    }


def test_a_cause_and_its_alternatives_are_rivals_of_each_other(axis, typical) -> None:
    own = replace(
        axis, causes=(cause(STRIBECK, VISCOUS, HYSTERESIS),), model=with_terms(axis, STRIBECK)
    )
    assert pairs(rivals(own, typical)) == {
        ("stribeck_friction", "nonlinear_viscous", Why.ALTERNATIVE),
        ("stribeck_friction", "presliding_hysteresis", Why.ALTERNATIVE),
        ("nonlinear_viscous", "presliding_hysteresis", Why.ALTERNATIVE),
    }


def test_a_cause_without_rivals_stands_beside_those_of_others(axis, typical) -> None:
    ripple = term("torque_ripple", cosine=0.1, period=0.9)
    own = replace(
        axis,
        causes=(cause(ripple), cause(STRIBECK, VISCOUS)),
        model=with_terms(axis, ripple, STRIBECK),
    )
    (pair,) = rivals(own, typical).pairs
    assert pair.others == (ripple,)


def test_a_suspected_cause_has_its_absence_for_a_rival(axis, typical) -> None:
    own = replace(axis, suspected=(cause(STRIBECK),))
    assert pairs(rivals(own, typical)) == {("stribeck_friction", None, Why.SUSPECTED)}


def test_what_belongs_to_a_time_is_absent_from_another_motion(axis, typical) -> None:
    own = replace(axis, causes=(cause(STRIBECK, EVENT),), model=with_terms(axis, STRIBECK))
    assert pairs(rivals(own, typical)) == {("stribeck_friction", None, Why.ALTERNATIVE)}
    suspected = replace(axis, suspected=(cause(EVENT),))
    found = rivals(suspected, typical)
    assert found.pairs == ()
    assert "repeat the recording" in found.left_out["disturbance_event"]


def test_an_untested_effect_is_as_large_as_is_called_not_testable(axis, typical) -> None:
    own = replace(axis, not_testable=(NotTestable("asymmetric_friction", "", ""),))
    (pair,) = rivals(own, typical).pairs
    assert pair.why is Why.UNTESTED
    size = rms(term_effort(typical.reference, typical.base, pair.first))
    assert size == pytest.approx(0.1 * typical.effort, rel=0.01)


def test_an_effect_of_another_axis_needs_one(axis, typical) -> None:
    own = replace(axis, not_testable=(NotTestable("cross_axis_coupling", "", ""),))
    found = rivals(own, typical)
    assert found.pairs == ()
    assert "cross_axis_coupling" in found.left_out
    assert np.isfinite(typical.effort)


# The distance of two rivals: projection, noise, and what the diagnosis needs to decide.


@pytest.fixture(scope="module")
def case():
    return case_of(*rival_pair("stribeck_friction", "nonlinear_viscous"))


def test_what_the_base_model_and_the_rival_imitate_is_no_distance(case) -> None:
    """The same number by least squares on all columns at once."""
    problem = case.problem
    compared = problem.compared(case.named)
    base = base_columns(compared, problem.base)
    first, second = (
        term("stribeck_friction", level=0.4, speed=0.3),
        term("torque_ripple", cosine=0.1, period=2.0),
    )
    found = term_columns(compared, [(problem.base, first), (problem.base, second)])
    columns = {key(first): found[0], key(second): found[1]}
    noise = 0.01
    pair = Pair(first, None, (second,), Why.SUSPECTED)
    imitated = np.vstack([base.columns, found[1].derivatives])
    left = found[0].effort - imitated.T @ np.linalg.lstsq(imitated.T, found[0].effort)[0]
    other = found[1].effort - imitated.T @ np.linalg.lstsq(imitated.T, found[1].effort)[0]
    varying = base.effort - base.effort.mean()
    allowed = len(left) * noise**2 + sum(
        (named(effect).search.discrepancy * np.linalg.norm(part)) ** 2
        for effect, part in ((BASE, varying), (first.effect, left), (second.effect, other))
    )
    expected = math.sqrt(len(left) * float(left @ left) / allowed)
    assert distance(pair, base, columns, noise) == pytest.approx(expected, rel=1e-3)


def test_a_rival_that_can_take_any_size_is_fitted(case) -> None:
    """Ten times the amplitude of the other rival changes nothing: it is a free parameter."""
    problem = case.problem
    compared = problem.compared(case.named)
    base = base_columns(compared, problem.base)
    one = term("asymmetric_friction", difference=0.2)
    others = [term("torque_ripple", cosine=size, period=2.0) for size in (0.05, 0.5)]
    apart = []
    for other in others:
        found = term_columns(compared, [(problem.base, one), (problem.base, other)])
        columns = {key(one): found[0], key(other): found[1]}
        with_other = Pair(one, other, (), Why.ALTERNATIVE)
        apart.append(distance(with_other, base, columns, 1.0))
    alone = distance(Pair(one, None, (), Why.SUSPECTED), base, columns, 1.0)
    assert apart[1] <= alone * (1.0 + 1e-9)
    assert apart[0] < apart[1]  # with the small ripple for true, little is left to tell it by


def test_no_distance_is_a_coin_and_more_is_better() -> None:
    assert error_probability(0.0) == pytest.approx(0.5)
    assert error_probability(2.0 * 1.6449) == pytest.approx(0.05, abs=1e-4)


def test_at_the_needed_distance_the_criterion_decides_in_99_of_100_records(case) -> None:
    """Records of Gaussian noise: the gain by the true one reaches the threshold."""
    pair = Pair(term("stribeck_friction", level=0.4, speed=0.3), None, (), Why.SUSPECTED)
    samples, judge = 300, case.problem.judge
    needed = judge.needed(pair, samples)
    rng = np.random.default_rng(1)
    shape = rng.normal(size=samples)
    shape *= needed / np.linalg.norm(shape)
    noise = rng.normal(size=(4000, samples))
    gains = samples * np.log(np.sum((noise + shape) ** 2, axis=1) / np.sum(noise**2, axis=1))
    required = 25.0 + judge._cost(pair.first, samples)
    assert np.mean(gains > required) == pytest.approx(DECIDED, abs=0.006)

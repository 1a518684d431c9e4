"""The distance of two rivals: projection, noise, and what the diagnosis needs to decide."""

import math

import numpy as np
import pytest

from edge_ident.experiment.compared import base_columns, key, term_columns
from edge_ident.experiment.rivals import DECIDED, Pair, Why, distance, error_probability
from edge_ident.model.effects import named
from edge_ident.model.model import BASE
from tests.edge_ident.experiment.problems import case_of, rival_pair, term


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

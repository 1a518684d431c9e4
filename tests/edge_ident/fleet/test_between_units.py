"""Which unit stands out: false alarms stay below the level, and what is far away is found."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from edge_ident.fleet.between_units import FALSE_ALARM, FEWEST_UNITS, distances, spread_of
from tests.repetitions import a_few

Array = NDArray[np.float64]
FLEETS = 200
ACCEPTED = stats.binom.isf(0.001, FLEETS, FALSE_ALARM) / FLEETS
"""False alarms that a test at the level exceeds once in a thousand times."""
DEVIATIONS: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "small": lambda rng, n: np.full(n, 0.01),
    "as large as the spread": lambda rng, n: np.full(n, 1.0),
    "from a twentieth to five times the spread": lambda rng, n: np.exp(
        rng.uniform(np.log(0.05), np.log(5.0), n)
    ),
    "small for half of the units, large for the others": lambda rng, n: np.where(
        np.arange(n) < n // 2, 0.1, 3.0
    ),
}


@pytest.mark.parametrize("between", [0.0, 1.0])
@pytest.mark.parametrize("kind", DEVIATIONS)
@pytest.mark.parametrize("count", a_few([6, 12], [6]))
def test_sound_units_stand_out_no_more_often_than_promised(
    count: int, kind: str, between: float
) -> None:
    rng = np.random.default_rng(11)
    named = 0
    for _ in range(FLEETS):
        std = DEVIATIONS[kind](rng, count)
        found = distances(rng.normal(3.0, np.hypot(between, std)), std, quantities=1)
        assert found is not None
        named += bool(np.any(found.stands_out))
    assert named / FLEETS <= ACCEPTED


def test_several_quantities_share_one_level() -> None:
    rng = np.random.default_rng(12)
    named = 0
    for _ in range(FLEETS // 2):
        of_fleet = [distances(rng.normal(size=8), np.full(8, 0.01), quantities=5) for _ in range(5)]
        named += any(np.any(found.stands_out) for found in of_fleet if found)
    assert named / (FLEETS // 2) <= ACCEPTED


def test_without_intervals_the_distance_is_students() -> None:
    """Two samples of one and of n - 1 units: the t of their difference is known exactly."""
    values = np.array([9.0, 1.0, 2.0, 4.0, 3.0, 5.0, 2.5])
    found = distances(values, np.full(7, 1e-6), quantities=1)
    assert found is not None
    others = values[1:]
    expected = (9.0 - np.mean(others)) / (np.std(others, ddof=1) * np.sqrt(1.0 + 1.0 / 6.0))
    assert found.distance[0] == pytest.approx(expected, rel=1e-4)


def test_the_spread_between_units_does_not_count_what_recordings_err() -> None:
    """The variance of the values is that of the true values and that of the errors."""
    rng = np.random.default_rng(13)
    std = np.full(4000, 2.0)
    found = spread_of(rng.normal(5.0, np.hypot(1.5, 2.0), 4000), std, np.ones((1, 4000), bool))
    assert found.between[0] == pytest.approx(1.5, rel=0.1)
    assert found.centre[0] == pytest.approx(5.0, abs=4.0 * found.std[0])
    alike = spread_of(np.full(5, 7.0), np.full(5, 1.0), np.ones((1, 5), bool))
    assert alike.between[0] == pytest.approx(0.0, abs=1e-6)


def test_a_unit_far_from_the_others_stands_out_alone() -> None:
    values = np.array([20.0, 10.1, 9.8, 10.0, 10.3, 9.9, 10.2, 9.7])
    found = distances(values, np.full(8, 0.05), quantities=8)
    assert found is not None
    assert list(np.flatnonzero(found.stands_out)) == [0]
    assert found.centre == pytest.approx(np.mean(values[1:]), abs=0.05)


def test_two_units_do_not_hide_each_other() -> None:
    values = np.array([20.0, 21.0, 10.1, 9.8, 10.0, 10.3, 9.9, 10.2, 9.7, 10.0, 9.9, 10.1])
    found = distances(values, np.full(12, 0.05), quantities=8)
    assert found is not None
    assert list(np.flatnonzero(found.stands_out)) == [0, 1]


def test_an_uncertain_value_does_not_stand_out() -> None:
    values = np.array([20.0, 10.1, 9.8, 10.0, 10.3, 9.9, 10.2, 9.7])
    std = np.array([5.0, *[0.05] * 7])
    found = distances(values, std, quantities=8)
    assert found is not None
    assert not np.any(found.stands_out)


def test_where_half_of_the_units_differ_none_stands_out() -> None:
    values = np.array([1.0, 1.1, 0.9, 1.0, 2.0, 2.1, 1.9, 2.0])
    found = distances(values, np.full(8, 0.02), quantities=1)
    assert found is not None
    assert not np.any(found.stands_out)


def test_too_few_units_are_not_judged() -> None:
    few = FEWEST_UNITS - 1
    values = np.array([100.0, *[1.0] * (few - 1)])
    assert distances(values, np.full(few, 0.01), quantities=1) is None

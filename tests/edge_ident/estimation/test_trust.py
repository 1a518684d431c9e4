"""When an estimate is not trusted, and what the user is told."""

import re

import numpy as np
import pytest

from edge_ident.estimation.least_squares import Columns
from edge_ident.estimation.trust import check_estimate, compare_estimators, not_shown
from edge_ident.model.model import Estimate

TIME = 0.01 * np.arange(2000)
VELOCITY = np.cos(TIME)
REGRESSOR = np.column_stack([-np.sin(TIME), VELOCITY, np.sign(VELOCITY), np.ones(2000)])
VALUES = np.array([0.4, 0.9, 1.4, 0.05])
EFFORT = REGRESSOR @ VALUES


def estimate(values=VALUES, std=(0.01, 0.01, 0.01, 0.01)) -> Estimate:
    return Estimate(np.array(values, dtype=float), np.array(std, dtype=float))


def test_a_good_estimate_raises_nothing() -> None:
    assert check_estimate(estimate(), Columns(REGRESSOR), EFFORT, 0.03) == []


def test_a_weak_inertia_is_reported_with_its_number_and_a_motion() -> None:
    [finding] = check_estimate(
        estimate(std=(0.08, 0.01, 0.01, 0.01)), Columns(REGRESSOR), EFFORT, 0.03
    )
    assert finding.code == "weak_inertia"
    assert not finding.blocks
    assert "±20%" in finding.message
    # 5 % instead of 20 % needs four times the rms acceleration, which is 0.70 here; that takes no
    # more than all of the effort, of which the inertia has a fifth here
    assert "accelerates 4 times as much: with 2.8 rms instead of 0.7" in finding.next_step


def test_no_acceleration_is_asked_for_that_takes_more_effort_than_the_drive_gave() -> None:
    """Of an inertia with a hundredth of the effort, known to ± 50 %: ten times the acceleration is
    within the effort. Known to ± 20 times, or where no value is known, no number is."""
    small = estimate(values=(0.005, *VALUES[1:]), std=(0.0025, 0.01, 0.01, 0.01))
    [finding] = check_estimate(small, Columns(REGRESSOR), EFFORT, 0.03)
    assert "accelerates 10 times as much" in finding.next_step
    unknown = estimate(values=(0.001, *VALUES[1:]), std=(0.6, 0.01, 0.01, 0.01))
    [finding] = check_estimate(unknown, Columns(REGRESSOR), EFFORT, 0.03)
    assert finding.code == "undetermined_inertia"
    assert "most of the effort goes into acceleration" in finding.next_step
    assert not re.search("[0-9]", finding.next_step)


@pytest.mark.parametrize(
    ("values", "std", "residual", "code"),
    [
        (VALUES, (0.01,) * 4, 0.4, "poor_fit"),
        ((-0.4, 0.9, 1.4, 0.05), (0.01,) * 4, 0.03, "negative_inertia"),
        (VALUES, (0.01, 0.5, 0.01, 0.01), 0.03, "undetermined_viscous_friction"),
        ((0.4, 0.9, -0.001, 0.05), (0.01,) * 4, 0.03, "undetermined_coulomb_friction"),
    ],
)
def test_reasons_to_refuse(values, std, residual: float, code: str) -> None:
    findings = check_estimate(estimate(values, std), Columns(REGRESSOR), EFFORT, residual)
    assert [finding.code for finding in findings if finding.blocks] == [code]


def test_one_way_motion_cannot_tell_coulomb_friction_from_offset() -> None:
    one_way = REGRESSOR.copy()
    one_way[:, 1], one_way[:, 2] = 2.0 + VELOCITY, 1.0
    [finding] = check_estimate(estimate(), Columns(one_way), one_way @ VALUES, 0.03)
    assert finding.code == "inseparable"
    assert finding.blocks
    assert finding.message.startswith("coulomb friction and offset cannot be distinguished")


def test_a_negative_offset_is_physical() -> None:
    assert check_estimate(estimate((0.4, 0.9, 1.4, -0.5)), Columns(REGRESSOR), EFFORT, 0.03) == []


def test_estimators_may_differ_within_their_uncertainty_only() -> None:
    near = estimate((0.43, 0.9, 1.4, 0.05))
    assert compare_estimators(near, estimate()) == []
    [finding] = compare_estimators(estimate((0.45, 0.9, 1.4, 0.05)), estimate())
    assert finding.code == "estimators_disagree_inertia"
    assert finding.blocks


def test_what_a_livelier_motion_settles_is_told_in_words() -> None:
    """A wrong sign shows in inertia alone: on one sinusoid that is a spring as well."""
    negative = check_estimate(estimate((-0.4, 0.9, 1.4, 0.05)), Columns(REGRESSOR), EFFORT, 0.03)
    beside = compare_estimators(estimate((0.45, 0.9, 1.4, 0.05)), estimate())
    assert not_shown([*negative, *beside]) == ("inertia cannot be told from a spring",)
    assert not_shown(beside) == (
        "network and least squares differ in inertia by 3.5 standard deviations",
    )


def test_a_livelier_motion_settles_no_poor_fit_and_no_doubt() -> None:
    poor = check_estimate(estimate(), Columns(REGRESSOR), EFFORT, 0.4)
    weak = check_estimate(
        estimate(VALUES, (0.08, 0.01, 0.01, 0.01)), Columns(REGRESSOR), EFFORT, 0.03
    )
    assert [finding.code for finding in (*poor, *weak)] == ["poor_fit", "weak_inertia"]
    assert not_shown([*poor, *weak]) == ()

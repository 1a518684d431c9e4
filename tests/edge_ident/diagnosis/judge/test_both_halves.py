"""A law of the machine has one size throughout; what only looks like one for a while has not."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.fit.summary import base_space
from edge_ident.diagnosis.judge.halves import decide_halves
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.acceptance import Decision
from edge_ident.diagnosis.select.thresholds import SAME_SIZE
from edge_ident.model.effects import catalogue
from edge_ident.model.search import Form
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

Array = NDArray[np.float64]

PERIOD = 0.31
TIME_S, POSITION, VELOCITY, ACCELERATION = swing()
RIPPLE = 0.1 * np.sin(2.0 * np.pi * POSITION / PERIOD + 0.4)


def decided(effort: Array, effect: str, form: Form, values: dict[str, float]) -> Decision | None:
    """On a model that has one more term than the base model."""
    data = prepare_axis([recorded(TIME_S, POSITION, effort, noise=0.02)], "x")
    term = FittedTerm(Candidate(effect, form), values, dict.fromkeys(form.linear, 0.0))
    start = np.zeros(4)
    space = base_space(data, fit(data, TEMPLATE, start, ()))
    (decision,) = decide_halves(data, fit(data, TEMPLATE, start, (term,)), space)
    return decision


def decided_on_ripple(strength: Array | float) -> Decision:
    form = Form(("cosine", "sine"), ("period",))
    effort = rigid(VELOCITY, ACCELERATION) + strength * RIPPLE
    decision = decided(effort, "torque_ripple", form, {"period": PERIOD})
    assert decision is not None
    return decision


def test_a_ripple_of_one_size_is_a_law() -> None:
    decision = decided_on_ripple(1.0)
    assert decision.accepted
    assert decision.margin > 0.3


@pytest.mark.parametrize("late", [0.0, 3.0])
def test_a_ripple_that_comes_or_goes_is_none(late: float) -> None:
    strength = np.where(np.arange(len(TIME_S)) < len(TIME_S) // 2, 1.0, late)
    decision = decided_on_ripple(strength)
    assert not decision.accepted
    assert decision.reason.startswith("early the data show")


@pytest.mark.parametrize(
    ("signal", "where"), [(VELOCITY, "at low speed"), (ACCELERATION, "at small acceleration")]
)
def test_what_acts_in_a_part_of_the_motion_is_no_law(signal: Array, where: str) -> None:
    """It comes and goes all the time, so early and late agree."""
    small = np.abs(signal) < np.median(np.abs(signal))
    decision = decided_on_ripple(np.where(small, 2.0, 0.0))
    assert not decision.accepted
    assert decision.reason.startswith(f"{where} the data show 1.")


def test_a_ripple_that_drowns_in_noise_is_no_contradiction() -> None:
    """Sizes that are uncertain may differ."""
    assert decided_on_ripple(0.01).accepted


def test_no_formula_is_farther_off_than_halves_may_be_apart() -> None:
    assert max(effect.search.discrepancy for effect in catalogue().values()) == SAME_SIZE


def test_an_event_has_no_second_half() -> None:
    acts = (TIME_S > 3.0) & (TIME_S < 3.5)
    form = Form(("level",), ("time", "duration"))
    effort = rigid(VELOCITY, ACCELERATION) + 2.0 * acts
    assert decided(effort, "disturbance_event", form, {"time": 3.0, "duration": 0.5}) is None

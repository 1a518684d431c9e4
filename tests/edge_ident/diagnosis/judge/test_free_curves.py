"""Laws outside the catalogue, and the effects that they are taken for: a curve describes them
better."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.judge.free_curves import curves_instead
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.search import ChangesWith, Form
from tests.edge_ident.diagnosis.select.test_search_parts import (
    COARSE_S,
    TEMPLATE,
    recorded,
    rigid,
    swing,
)
from tests.repetitions import a_few

Array = NDArray[np.float64]

TIME_S, POSITION, VELOCITY, ACCELERATION = swing(period_s=COARSE_S)
SOUND = rigid(VELOCITY, ACCELERATION)


def doubt(effort: Array, effect: str, form: Form, position: Array = POSITION, **at: float) -> str:
    """The reason against one effect, or nothing."""
    data = prepare_axis([recorded(TIME_S, position, effort, noise=0.01)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    term = FittedTerm(Candidate(effect, form), at, dict.fromkeys(form.linear, 0.0))
    model = search.fit(start.base, (term,))
    return curves_instead(search, model, noise_floor(data, start)).get(0, "")


POWERS = Form(("rate", "curvature"), changes=ChangesWith.TIME)
COURSE = Form(("rate",), ("time_constant",), changes=ChangesWith.TIME)


IN_TIME = {"an inertia": ACCELERATION, "dry friction": np.sign(VELOCITY), "": SOUND}
CONSTANT_S = {POWERS: 1e6, COURSE: 6.0}
FEW = (("an inertia", POWERS), ("dry friction", COURSE), ("", POWERS))
"""Each law and each form once."""


@pytest.mark.parametrize(("law", "form"), a_few(product(IN_TIME, CONSTANT_S), FEW))
def test_what_changes_with_time_is_no_gain(law: str, form: Form) -> None:
    extra, constant_s = IN_TIME[law], CONSTANT_S[form]
    course = -constant_s * np.expm1(-TIME_S / constant_s)
    reason = doubt(SOUND + 0.03 * course * extra, "gain_drift", form, time_constant=constant_s)
    assert bool(reason) is bool(law)
    assert "over time" in reason or not law


LOSS = Form(("share",), ("guided", "moved"), changes=ChangesWith.EFFORT)
LIMIT = Form((), ("limit",), changes=ChangesWith.EFFORT)


NEEDED = 2.0 * ACCELERATION + SOUND
MOST = float(np.max(np.abs(NEEDED)))
SATURATING = NEEDED + 0.001 * NEEDED**3


def test_a_motor_that_saturates_is_no_loss_of_a_transmission() -> None:
    lost = NEEDED / (1.0 - 0.15 * np.sign(NEEDED * VELOCITY))
    assert not doubt(lost, "load_dependent_friction", LOSS, guided=1.0, moved=1.0)
    reason = doubt(SATURATING, "load_dependent_friction", LOSS, guided=1.0, moved=1.0)
    assert "of which no law is assumed" in reason


def test_a_motor_that_saturates_is_no_limit() -> None:
    wound_up = np.where(np.abs(NEEDED) > 0.97 * MOST, 1.3 * NEEDED, NEEDED)
    assert not doubt(wound_up, "actuator_saturation", LIMIT, limit=MOST)
    reason = doubt(SATURATING, "actuator_saturation", LIMIT, limit=MOST)
    assert "of which no law is assumed" in reason


DEADBAND = Form((), ("width",), changes=ChangesWith.EFFORT)


def test_a_power_of_the_effort_is_no_deadband() -> None:
    assert not doubt(NEEDED + 0.4 * np.sign(NEEDED), "actuator_deadband", DEADBAND, width=0.4)
    power = np.sign(NEEDED) * np.abs(NEEDED) ** 0.8
    reason = doubt(power, "actuator_deadband", DEADBAND, width=0.2)
    assert "of which no law is assumed" in reason

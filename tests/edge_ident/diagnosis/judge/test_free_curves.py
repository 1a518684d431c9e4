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
from edge_ident.model.effects import named
from edge_ident.model.search import Form
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


POWERS = Form(("rate", "curvature"))
COURSE = Form(("rate",), ("time_constant",))


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


LOSS = Form(("share",), ("guided", "moved"))
LIMIT = Form((), ("limit",))


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


DEADBAND = Form((), ("width",))


def test_a_power_of_the_effort_is_no_deadband() -> None:
    assert not doubt(NEEDED + 0.4 * np.sign(NEEDED), "actuator_deadband", DEADBAND, width=0.4)
    power = np.sign(NEEDED) * np.abs(NEEDED) ** 1.2
    reason = doubt(power, "actuator_deadband", DEADBAND, width=0.2)
    assert "of which no law is assumed" in reason


PERIOD, PLACE, WIDTH = 2.3, 0.2, 0.5
WAVE = Form(("cosine", "sine"), ("period",))
BUMP = next(
    form for form in named("position_dependent_load").search.forms if form.linear == ("bump",)
)
AWAY = (POSITION - PLACE) / WIDTH
COSINE, BELL = np.cos(2.0 * np.pi / PERIOD * POSITION), np.exp(-(AWAY**2))
ALONG = {
    "encoder_eccentricity": (WAVE, COSINE, 0.0 * POSITION, {"period": PERIOD}),
    "position_dependent_load": (
        BUMP,
        BELL,
        -2.0 * AWAY / WIDTH * BELL,
        {"period": PERIOD, "place": PLACE, "width": WIDTH},
    ),
}
"""Form of an effect, what may change along the stroke like it, the slope of that, parameters."""
CHANGES = [
    ("encoder_eccentricity", "a force constant"),
    ("position_dependent_load", "a force constant"),
    ("position_dependent_load", "inertia"),
]


@pytest.mark.parametrize(("effect", "law"), a_few(CHANGES, [CHANGES[0], CHANGES[2]]))
def test_what_changes_along_the_stroke_is_no_effect_of_another_name(effect: str, law: str) -> None:
    form, shape, slope, at = ALONG[effect]
    inertia = shape * ACCELERATION + 0.5 * slope * VELOCITY**2
    extra = inertia if law == "inertia" else shape * SOUND
    reason = doubt(SOUND + 0.1 * extra, effect, form, **at)
    assert reason.startswith("a curve of the inertia over position")


def test_a_load_at_one_place_is_no_curve() -> None:
    _, bell, _, at = ALONG["position_dependent_load"]
    assert not doubt(SOUND + 0.1 * bell, "position_dependent_load", BUMP, **at)


WAVES = {
    "encoder_eccentricity": (POSITION + 0.01 * COSINE, np.zeros(1)),
    "position_dependent_friction": (POSITION, 0.05 * COSINE * np.sign(VELOCITY)),
    "torque_ripple": (POSITION, 0.05 * COSINE),
}


@pytest.mark.parametrize("effect", a_few(WAVES, ["encoder_eccentricity"]))
def test_a_wave_along_the_stroke_is_no_curve(effect: str) -> None:
    position, extra = WAVES[effect]
    assert not doubt(SOUND + extra, effect, WAVE, position, period=PERIOD)


def test_a_gain_that_differs_with_the_sign_is_no_loss_of_a_transmission() -> None:
    one_sided = np.where(NEEDED > 0.0, 1.08, 1.0) * NEEDED
    reason = doubt(one_sided, "load_dependent_friction", LOSS, guided=0.0, moved=0.1)
    assert reason.startswith("a curve of the difference of directions over acceleration")


SPEED, LEVEL = 0.2, 0.5
STRIBECK = next(form for form in named("stribeck_friction").search.forms if form.grid is None)


@pytest.mark.parametrize("wrong", [False, True])
def test_a_law_whose_formula_is_not_quite_the_machines_is_that_law(wrong: bool) -> None:
    """Friction falls with the speed as 1/(1 + v²), not as exp(-v²); or it swings."""
    speed = np.abs(VELOCITY) / SPEED
    course = np.sin(3.0 * speed) if wrong else 1.0 / (1.0 + speed**2)
    effort = SOUND + LEVEL * course * np.sign(VELOCITY)
    reason = doubt(effort, "stribeck_friction", STRIBECK, speed=SPEED, exponent=2.0)
    assert bool(reason) is wrong

"""Laws outside the catalogue, and the effects that they are taken for."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.judge.unnamed_laws import unnamed
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.effects import named
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
PERIOD = 2.3
RATE = 2.0 * np.pi / PERIOD
COSINE, SINE = np.cos(RATE * POSITION), np.sin(RATE * POSITION)
SOUND = rigid(VELOCITY, ACCELERATION)
WAVE = Form(("cosine", "sine"), ("period",), changes=ChangesWith.STROKE)


def doubt(effort: Array, effect: str, form: Form, position: Array = POSITION, **at: float) -> str:
    """The reason against one effect, or nothing."""
    data = prepare_axis([recorded(TIME_S, position, effort, noise=0.01)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    term = FittedTerm(Candidate(effect, form), at, dict.fromkeys(form.linear, 0.0))
    return unnamed(search, search.fit(start.base, (term,))).get(0, "")


BUMP = Form(("bump",), ("place", "width"), changes=ChangesWith.STROKE)
AWAY = (POSITION - 0.2) / 0.5
BELL = np.exp(-(AWAY**2))
PLACE = {"place": 0.2, "width": 0.5, "period": PERIOD}
SHAPES = {
    "encoder_eccentricity": (COSINE, -RATE * SINE, WAVE, {"period": PERIOD}),
    "position_dependent_load": (BELL, -4.0 * AWAY * BELL, BUMP, PLACE),
}
"""Over the position, with its derivative, of an effect in one of its forms."""
LAWS = ("an inertia", "viscous friction", "a force constant of the motor")


@pytest.mark.parametrize(
    ("effect", "law"), a_few(product(SHAPES, LAWS), [(effect, "an inertia") for effect in SHAPES])
)
def test_what_changes_along_the_stroke_is_called_no_effect(effect: str, law: str) -> None:
    shape, slope, form, at = SHAPES[effect]
    efforts = (shape * ACCELERATION + 0.5 * slope * VELOCITY**2, shape * VELOCITY, shape * SOUND)
    extra = dict(zip(LAWS, efforts, strict=True))[law]
    reason = doubt(SOUND + 0.1 * extra, effect, form, **at)
    assert reason.startswith(f"{law} that changes along the stroke describes the effort better")


def test_a_load_at_one_place_is_no_other_law() -> None:
    assert not doubt(SOUND + 0.1 * BELL, "position_dependent_load", BUMP, **PLACE)


WAVES = {
    "encoder_eccentricity": (POSITION + 0.01 * COSINE, np.zeros(1)),
    "position_dependent_friction": (POSITION, 0.05 * COSINE * np.sign(VELOCITY)),
    "torque_ripple": (POSITION, 0.05 * COSINE),
}


@pytest.mark.parametrize("effect", a_few(WAVES, ["encoder_eccentricity"]))
def test_an_effect_is_no_other_law(effect: str) -> None:
    position, extra = WAVES[effect]
    assert not doubt(SOUND + extra, effect, WAVE, position, period=PERIOD)


LOSS = Form(("share",), ("guided", "moved"), changes=ChangesWith.EFFORT)


NEEDED = 2.0 * ACCELERATION + SOUND


def test_a_gain_that_differs_with_the_sign_is_no_loss_of_a_transmission() -> None:
    one_sided = np.where(NEEDED > 0.0, 1.08, 1.0) * NEEDED
    reason = doubt(one_sided, "load_dependent_friction", LOSS, guided=0.0, moved=0.1)
    assert reason.startswith("a gain that differs with the sign of the effort describes")


def test_a_force_constant_that_steps_is_no_payload() -> None:
    form = Form(("inertia", "coulomb_friction"), ("time",), changes=ChangesWith.MOMENT)
    later, at = TIME_S >= 7.0, {"time": 7.0, "clock": 0.0}
    assert not doubt(SOUND + 0.05 * later * ACCELERATION, "payload_change", form, **at)
    reason = doubt(SOUND + 0.06 * later * SOUND, "payload_change", form, **at)
    assert reason.startswith("a force constant that changes then describes")


def test_a_law_gains_nothing_by_a_shift_that_no_other_model_may_have() -> None:
    inertia = 0.1 * COSINE * ACCELERATION - 0.05 * RATE * SINE * VELOCITY**2
    late = np.interp(TIME_S - 0.004, TIME_S, SOUND + inertia)
    assert not doubt(late, "position_dependent_inertia", WAVE, period=PERIOD)


HEIGHT = POSITION - np.mean(POSITION)
POWERS_OF_PLACE = {
    "position_dependent_inertia": (("slope",), HEIGHT * ACCELERATION + 0.5 * VELOCITY**2),
    "position_dependent_friction": (("gradient",), HEIGHT * np.sign(VELOCITY)),
}
"""Linear parameters of a form, and the effort of one."""


@pytest.mark.parametrize("effect", a_few(POWERS_OF_PLACE, ["position_dependent_friction"]))
def test_a_force_constant_that_falls_along_the_stroke_is_no_effect(effect: str) -> None:
    linear, extra = POWERS_OF_PLACE[effect]
    form = next(form for form in named(effect).search.forms if form.linear == linear)
    at = {"centre": float(np.mean(POSITION)), "period": PERIOD}
    assert not doubt(SOUND + 0.05 * extra, effect, form, **at)
    reason = doubt((1.0 + 0.03 * HEIGHT) * SOUND, effect, form, **at)
    assert reason.startswith("a force constant of the motor that changes along the stroke")


def test_a_transmission_that_loses_of_a_weight_is_no_friction_of_the_stroke() -> None:
    """The weight differs along the stroke, and friction that follows it does, too."""
    weight = 1.5 * COSINE + 0.4 * ACCELERATION
    lost = SOUND + weight + 0.2 * np.abs(weight) * np.sign(VELOCITY)
    data = prepare_axis([recorded(TIME_S, POSITION, lost, noise=0.01)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    terms = tuple(
        FittedTerm(Candidate(effect, WAVE), {"period": PERIOD}, dict.fromkeys(WAVE.linear, 0.0))
        for effect in ("position_dependent_load", "position_dependent_friction")
    )
    search = Search.of(data, TEMPLATE, start)
    doubts = unnamed(search, search.fit(start.base, terms))
    assert doubts == {1: "friction that follows the load describes the effort better"}


def test_a_law_with_fewer_parameters_need_not_be_better() -> None:
    """Without a weight, and beside so much noise, a payload may be a force constant as well."""
    form = Form(("inertia", "coulomb_friction"), ("time",), changes=ChangesWith.MOMENT)
    stepped = SOUND + 0.06 * (TIME_S >= 7.0) * SOUND
    data = prepare_axis([recorded(TIME_S, POSITION, stepped, noise=1.0)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    at, nothing = {"time": 7.0, "clock": 0.0}, dict.fromkeys(form.linear, 0.0)
    model = search.fit(start.base, (FittedTerm(Candidate("payload_change", form), at, nothing),))
    reason = "a force constant that changes then describes the effort as well, "
    assert unnamed(search, model) == {0: reason + "with fewer parameters"}

"""Laws outside the catalogue, and the effects that they are taken for."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.unnamed_laws import unnamed
from edge_ident.model.search import Form
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

Array = NDArray[np.float64]

TIME_S, POSITION, VELOCITY, ACCELERATION = swing()
PERIOD = 2.3
RATE = 2.0 * np.pi / PERIOD
COSINE, SINE = np.cos(RATE * POSITION), np.sin(RATE * POSITION)
SOUND = rigid(VELOCITY, ACCELERATION)
WAVE = Form(("cosine", "sine"), ("period",))


def doubt(effort: Array, effect: str, form: Form, position: Array = POSITION, **at: float) -> str:
    """The reason against one effect, or nothing."""
    data = prepare_axis([recorded(TIME_S, position, effort, noise=0.01)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    term = FittedTerm(Candidate(effect, form), at, dict.fromkeys(form.linear, 0.0))
    return unnamed(search, search.fit(start.base, (term,))).get(0, "")


@pytest.mark.parametrize(
    ("law", "extra"),
    [
        ("an inertia", COSINE * ACCELERATION - 0.5 * RATE * SINE * VELOCITY**2),
        ("viscous friction", COSINE * VELOCITY),
        ("a force constant of the motor", COSINE * SOUND),
    ],
)
def test_what_changes_along_the_stroke_is_called_no_effect(law: str, extra: Array) -> None:
    reason = doubt(SOUND + 0.1 * extra, "encoder_eccentricity", WAVE, period=PERIOD)
    assert reason.startswith(f"{law} that changes along the stroke, which is not in the catalogue")


@pytest.mark.parametrize(
    ("effect", "position", "extra"),
    [
        ("encoder_eccentricity", POSITION + 0.01 * COSINE, 0.0),
        ("position_dependent_friction", POSITION, 0.05 * COSINE * np.sign(VELOCITY)),
        ("torque_ripple", POSITION, 0.05 * COSINE),
    ],
)
def test_an_effect_is_no_other_law(effect: str, position: Array, extra: Array | float) -> None:
    assert not doubt(SOUND + extra, effect, WAVE, position, period=PERIOD)


POWERS, COURSE = Form(("rate", "curvature")), Form(("rate",), ("time_constant",))


@pytest.mark.parametrize(("form", "constant_s"), [(POWERS, 1e6), (COURSE, 6.0)])
@pytest.mark.parametrize(
    ("law", "extra"),
    [("an inertia", ACCELERATION), ("dry friction", np.sign(VELOCITY)), ("", SOUND)],
)
def test_what_changes_with_time_is_no_gain(
    law: str, extra: Array, form: Form, constant_s: float
) -> None:
    course = -constant_s * np.expm1(-TIME_S / constant_s)
    reason = doubt(SOUND + 0.03 * course * extra, "gain_drift", form, time_constant=constant_s)
    assert reason.startswith(f"{law} that changes with time" if law else "")
    assert bool(reason) is bool(law)


@pytest.mark.parametrize(("share", "iron"), [(0.15, 0.0), (0.0, 0.01)])
def test_a_motor_that_saturates_is_no_loss_of_a_transmission(share: float, iron: float) -> None:
    effort = 2.0 * ACCELERATION + SOUND
    driven = np.sign(effort * VELOCITY)
    effort = effort / (1.0 - share * driven) + iron * effort**3
    form = Form(("share",), ("guided", "moved"))
    reason = doubt(effort, "load_dependent_friction", form, guided=1.0, moved=1.0)
    assert reason.startswith("a motor whose force saturates" if iron else "")
    assert bool(reason) is bool(iron)

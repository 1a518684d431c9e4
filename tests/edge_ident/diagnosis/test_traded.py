"""Base parameters that trade places with a cause get the interval that says so."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.deviations import traded_deviations
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import AxisRecord, Recording

Array = NDArray[np.float64]

TEMPLATE = AxisModel((Term(BASE, dict.fromkeys(PARAMETERS, 0.0)),))
BENT = FittedTerm(
    Candidate("nonlinear_viscous", named("nonlinear_viscous").search.forms[0]),
    {"exponent": 2.0},
    {"level": 0.0},
)
POWER = replace(BENT, nonlinear={"exponent": 0.2})
STRIBECK = FittedTerm(
    Candidate("stribeck_friction", named("stribeck_friction").search.forms[0]),
    {"speed": 1.0, "exponent": 1.0},
    {"level": 0.0},
)
NOISE = 0.01
SQUARE, CANCELLING = np.array([0.3, 0.0, 0.0]), np.array([0.0, 0.6, 0.25])


def traded(wobble: float, *terms: FittedTerm, bends: Array) -> tuple[Array, Array]:
    """Trading and its largest size, on friction that bends, with `wobble` that nothing explains.

    Parameters
    ----------
    bends : (3,) array
        Levels of friction by the square of the speed, by a power of it, and by Stribeck's law.
    """
    rng = np.random.default_rng(2)
    t = np.arange(0.0, 20.0, 1e-3)
    rate = 2.0 * np.pi * np.array([0.11, 0.23, 0.37, 0.61, 0.89])
    angle = rate * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, 5)
    x, v, a = (np.sin(angle) / rate).sum(1), np.cos(angle).sum(1), -(rate * np.sin(angle)).sum(1)
    effort = 0.5 * a + 0.8 * v + 1.1 * np.sign(v)
    effort += np.sign(v) * (bends @ [v**2, np.abs(v) ** 0.2, np.exp(-np.abs(v))])
    effort += wobble * np.sin(2.0 * np.pi * 1.7 * t) + NOISE * rng.standard_normal(len(t))
    axis = AxisRecord(np.round(x / 1e-5) * 1e-5, effort, "rad", "N*m")
    data = prepare_axis([Recording(t, {"x": axis}, "by hand")], "x")
    base = fit(data, TEMPLATE, np.array([1.0, 0.0, 0.0, 0.0]), ())
    model = fit(data, TEMPLATE, base.base, terms)
    floor = rms((data.effort - model.predicted)[data.valid]) if not wobble else 0.0
    return traded_deviations(data, base, model, floor), np.abs(base.base - model.base)


def test_a_formula_that_is_confirmed_takes_nothing() -> None:
    found, moved = traded(0.0, BENT, bends=SQUARE)
    assert moved[1] > 0.3, "viscous friction changes its name"
    assert np.all(found < 1e-6 * moved)


def test_what_is_left_unexplained_doubts_the_formula() -> None:
    found, moved = traded(1.0, BENT, bends=SQUARE)
    np.testing.assert_allclose(found[1:3], moved[1:3], rtol=0.2)
    some, _ = traded(0.1, BENT, bends=SQUARE)
    assert 0.05 * moved[1] < some[1] < 0.8 * moved[1]


def test_two_laws_of_one_curve_that_cancel_confirm_neither() -> None:
    """A power of the speed and a Stribeck friction had 36 % of the Coulomb friction, and together
    they made hardly more than what was left."""
    found, moved = traded(0.03, POWER, STRIBECK, bends=CANCELLING)
    assert moved[2] > 0.5
    np.testing.assert_allclose(found[1:3], moved[1:3])

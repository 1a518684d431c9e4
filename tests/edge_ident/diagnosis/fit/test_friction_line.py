"""Where friction trades places among the terms of a model, its line is known all the same."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.deviations import friction_line, with_trades
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Estimate, Term
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import AxisRecord, Recording

Array = NDArray[np.float64]

TEMPLATE = AxisModel((Term(BASE, dict.fromkeys(PARAMETERS, 0.0)),))
STRIBECK = Candidate("stribeck_friction", named("stribeck_friction").search.forms[0])
TRUTH = (0.5, 0.8, 1.1, 0.2)
LEVEL, SPEED = 0.9, 2.2  # the bump is as wide as the range of speeds: hardly more than a bend
NOISE, MEMORY = 0.012, 0.98


def friction(velocity: Array) -> Array:
    """The whole curve."""
    _, viscous, coulomb, offset = TRUTH
    dry = coulomb + LEVEL * np.exp(-((velocity / SPEED) ** 2))
    return np.asarray(viscous * velocity + dry * np.sign(velocity) + offset)


def recorded(seed: int) -> AxisData:
    """A motion of several speeds, and slow noise in the effort."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 20.0, 2e-3)
    rate = 2.0 * np.pi * np.array([0.11, 0.23, 0.37, 0.61, 0.89])
    angle = rate * t[:, None] + np.array([0.3, 1.9, 4.0, 5.5, 2.6])
    x, v, a = (np.sin(angle) / rate).sum(1), np.cos(angle).sum(1), -(rate * np.sin(angle)).sum(1)
    noise = lfilter([1.0], [1.0, -MEMORY], NOISE * rng.standard_normal(len(t)))
    effort = TRUTH[0] * a + friction(v) + noise
    axis = AxisRecord(np.round(x / 1e-5) * 1e-5, effort, "rad", "N*m")
    return prepare_axis([Recording(t, {"x": axis}, "by hand")], "x")


def true_line(data: AxisData) -> Array:
    """Least squares through the true curve, at the speeds of the motion."""
    (segment,) = data.segments
    v = segment.motion.velocity[segment.direction_known]
    columns = np.stack([v, np.sign(v), np.ones_like(v)], axis=1)
    return np.asarray(np.linalg.lstsq(columns, friction(v), rcond=None)[0])


def found(data: AxisData) -> tuple[Estimate, Estimate]:
    """Physical parameters with the bump fitted beside them, and the line."""
    base = fit(data, TEMPLATE, np.array([1.0, 0.0, 0.0, 0.0]), ())

    def beside(logarithm: float) -> FittedTerm:
        return FittedTerm(STRIBECK, {"speed": float(np.exp(logarithm))}, {"level": 0.0})

    best = minimize_scalar(
        lambda at: fit(data, TEMPLATE, base.base, (beside(at),)).error,
        bounds=(np.log(0.3), np.log(8.0)),
        method="bounded",
    )
    model = fit(data, TEMPLATE, base.base, (beside(best.x),))
    floor = rms((data.effort - model.predicted)[data.valid])
    line = friction_line(data, base, model, floor)
    assert line is not None
    return Estimate(model.base, with_trades(data, base, model, floor)[:4]), line


def test_the_line_is_known_within_percent_where_its_parts_trade_places() -> None:
    data = recorded(1)
    physical, line = found(data)
    parts = physical.std[1:3] / np.array(TRUTH[1:3])
    assert np.all(parts > 0.05), "the motion does not tell the parts of the friction"
    assert line.parameters[1:] == pytest.approx(true_line(data), rel=0.03, abs=0.01)
    assert np.all(line.std[1:3] < 0.03 * line.parameters[1:3])
    assert np.all(line.std[1:3] < 0.3 * physical.std[1:3])
    assert line.parameters[0] == physical.parameters[0]


def test_intervals_of_the_line_hold_the_true_one() -> None:
    """Of 60 intervals of 95 %, at least 52: fewer come in one case of 300."""
    inside = np.zeros(3, dtype=np.intp)
    for seed in range(20):
        data = recorded(seed)
        _, line = found(data)
        inside += np.abs(line.parameters[1:] - true_line(data)) <= 1.96 * line.std[1:]
    assert np.all(inside >= 16), inside
    assert np.sum(inside) >= 52, inside


def test_a_curve_that_is_a_line_is_said_once() -> None:
    data = recorded(1)
    base = fit(data, TEMPLATE, np.array([1.0, 0.0, 0.0, 0.0]), ())
    assert friction_line(data, base, base, 0.01) is None

"""A joint with a weight: what is named, and whether the intervals hold its inertia.

Along one sinusoid the weight looks like a spring, and a spring like inertia. What is left of the
acceleration is then hardly more than the noise that the encoder has in it.
"""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.model.model import AxisModel, Model, Term
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.simulate import simulate

Array = NDArray[np.float64]

INERTIA, WEIGHT, ANGLE, VISCOUS, COULOMB = 0.7, 9.0, 0.3, 0.8, 1.5
COUNT = 2.0 * np.pi / 65536
TIME_S = 0.005 * np.arange(4800)
SINUSOID = ((1.5, 0.23, 1.0),)
TWO_LINES = ((1.2, 0.14, 0.4), (0.25, 0.41, 2.0))
"""Amplitude, frequency (Hz) and phase of each line."""


def joint(
    lines: tuple[tuple[float, float, float], ...], *, loss: float = 0.0, seed: int = 0
) -> AxisDiagnosis:
    position, velocity, acceleration = np.zeros((3, len(TIME_S)))
    for amplitude, frequency_hz, phase in lines:
        rate = 2.0 * np.pi * frequency_hz
        angle = rate * TIME_S + phase
        position += amplitude * np.sin(angle)
        velocity += amplitude * rate * np.cos(angle)
        acceleration -= amplitude * rate**2 * np.sin(angle)
    output = INERTIA * acceleration + WEIGHT * np.sin(position + ANGLE)
    effort = output / (1.0 - loss * np.sign(velocity * output))
    effort += VISCOUS * velocity + COULOMB * np.sign(velocity)
    effort += 0.002 * np.std(effort) * np.random.default_rng(seed).standard_normal(len(TIME_S))
    axis = AxisRecord(COUNT * np.round(position / COUNT), effort, "rad", "N*m")
    return diagnose([Recording(TIME_S, {"j": axis}, "a test")]).axes["j"]


def named(axis: AxisDiagnosis) -> set[str]:
    return {cause.term.effect for cause in axis.causes}


@pytest.mark.parametrize("seed", range(3))
def test_a_weight_along_a_sinusoid_has_the_period_of_a_turn(seed: int) -> None:
    """A period of its own fits the noise of the encoder a little better, because the inertia, and
    with it the noise, is less then: by a quarter, with a deviation of 1.5 %."""
    axis = joint(SINUSOID, seed=seed)
    assert (axis.verdict, named(axis)) == (Verdict.EXPLAINED, {"position_dependent_load"})
    weight = axis.causes[0].term.values
    assert weight["period"] == pytest.approx(2.0 * np.pi)
    inertia, std = axis.extended.estimate.parameters[0], axis.extended.estimate.std[0]
    assert abs(inertia - INERTIA) < 2.5 * std
    assert std < 0.05 * INERTIA


@pytest.mark.parametrize("lines", [SINUSOID, TWO_LINES])
def test_friction_that_follows_the_weight_is_named(
    lines: tuple[tuple[float, float, float], ...],
) -> None:
    """Most of what a joint's gear transmits is often its weight."""
    axis = joint(lines, loss=0.12)
    assert axis.verdict is Verdict.EXPLAINED
    assert named(axis) == {"position_dependent_load", "load_dependent_friction"}
    (loss,) = (c.term for c in axis.causes if c.term.effect == "load_dependent_friction")
    assert loss.values["share"] == pytest.approx(0.12, abs=0.005)
    assert axis.extended.estimate.parameters[2] == pytest.approx(COULOMB, rel=0.02)


def test_a_weight_along_a_sinusoid_passes_more_noise_and_keeps_its_name() -> None:
    """The weight looks like a spring, so the base model has too little inertia, and curves in the
    place of the weight leave it so: less of the encoder's noise passes beside them."""
    base = dict(inertia=0.4, viscous_friction=0.5, coulomb_friction=0.6, offset=0.2)
    weight = dict(stiffness=0.0, curvature=0.0, cosine=0.0, sine=1.0, period=2.0 * np.pi)
    terms = Term("rigid_body", base), Term("position_dependent_load", weight)
    time_s = 0.001 * np.arange(15_000)
    position = 1.2 * np.sin(2.0 * np.pi * 0.4 * time_s)
    axis = AxisRecord(position, 0.0 * position, "rad", "N*m", reference=position)
    drawn = simulate(
        Model({"x": AxisModel(terms)}), Recording(time_s, {"x": axis}, "drawn"),
        encoder_counts=8192, effort_resolution=0.0, noise=0.02,
    )  # fmt: skip
    found = diagnose([drawn]).axes["x"]
    assert [cause.term.effect for cause in found.causes] == ["position_dependent_load"]
    assert found.model.parameters[0] == pytest.approx(0.4, rel=0.05)


@pytest.mark.parametrize("seed", [0, 2, 4, 5])
def test_a_weight_and_cogging_along_a_short_stroke_have_their_names_or_none(seed: int) -> None:
    """The weight is nearly straight there, and one wave with its second order nearly does both."""
    rng = np.random.default_rng(seed)
    time_s = 0.001 * np.arange(12_000)
    rates = 2.0 * np.pi * np.array([0.2, 0.37, 0.61, 0.9, 1.35])
    size = 0.22 * rates[0] / rates
    angle = rates * time_s[:, None] + rng.uniform(0.0, 2.0 * np.pi, len(rates))
    position, velocity = (size * np.sin(angle)).sum(1), (size * rates * np.cos(angle)).sum(1)
    acceleration = -(size * rates**2 * np.sin(angle)).sum(1)
    effort = 0.4 * acceleration + 0.5 * velocity + 0.6 * np.sign(velocity)
    effort += np.sin(position) + 0.2 * np.sin(20.0 * position)
    effort += 0.02 * np.std(effort) * rng.standard_normal(len(time_s))
    axis = AxisRecord(7e-4 * np.round(position / 7e-4), effort, "rad", "N*m")
    found = diagnose([Recording(time_s, {"x": axis}, "a.csv")]).axes["x"]
    if found.causes:
        load, ripple = sorted((c.term for c in found.causes), key=lambda term: term.effect)
        assert (load.effect, ripple.effect) == ("position_dependent_load", "torque_ripple")
        assert ripple.values["period"] == pytest.approx(np.pi / 10.0, rel=0.01)
    assert bool(found.causes) == (found.verdict is Verdict.EXPLAINED)

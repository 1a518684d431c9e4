"""A motor moves a load through a spring, and the encoder, such as a linear scale, is on the load.

Two masses with friction on both sides are integrated in small steps. The loop is closed on the
motor, as drives with two encoders do.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.control.compensation import plant_of
from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.errors import ModelError
from edge_ident.model.model import Model
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.loop import recorded_references
from edge_ident.simulation.simulate import Scenario, record

Array = NDArray[np.float64]

PERIOD_S, STEPS = 0.004, 60
INERTIA, VISCOUS, COULOMB, OFFSET = 0.02, 0.05, 0.3, 0.05
COUNT_RAD = 2.0 * np.pi / 125_000
ON_MOTOR = 0.4
"""Share of inertia and friction."""


def wanted(seed: int) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration of six sines, 15 s."""
    t = PERIOD_S * np.arange(3_750)[:, None]
    rates = 2.0 * np.pi * np.array([0.2, 0.5, 0.9, 1.4, 2.1, 3.0])
    angles = rates * t + np.random.default_rng(seed).uniform(0.0, 6.0, 6)
    sizes = 4.7 * rates**-1.5
    derivatives = (sizes * np.sin(angles), sizes * rates * np.cos(angles))
    return *(x.sum(axis=1) for x in derivatives), -(sizes * rates**2 * np.sin(angles)).sum(axis=1)


@cache
def recorded(resonance_hz: float, seed: int) -> Recording:
    """The free resonance of the two masses is that; their spring is damped by 3 %."""
    position, velocity, acceleration = wanted(seed)
    motor, load = ON_MOTOR * INERTIA, (1.0 - ON_MOTOR) * INERTIA
    rate, reduced = 2.0 * np.pi * resonance_hz, motor * load / INERTIA
    stiffness, damping = rate**2 * reduced, 2.0 * 0.03 * rate * reduced
    friction = VISCOUS * velocity + COULOMB * np.tanh(velocity / 0.02)
    forward = INERTIA * acceleration + friction + OFFSET
    at, speed = [position[0]] * 2, [0.0, 0.0]
    shown, effort, step_s = np.empty(len(position)), np.empty(len(position)), PERIOD_S / STEPS
    for k in range(len(position)):
        shown[k] = np.floor(at[1] / COUNT_RAD) * COUNT_RAD
        effort[k] = forward[k] + 7.1 * (position[k] - at[0]) + 0.5 * (velocity[k] - speed[0])
        for _ in range(STEPS):
            twist = stiffness * (at[0] - at[1]) + damping * (speed[0] - speed[1])
            drags = [VISCOUS * v + COULOMB * np.tanh(v / 0.001) for v in speed]
            speed[0] += step_s * (effort[k] - twist - ON_MOTOR * drags[0]) / motor
            speed[1] += step_s * (twist - OFFSET - (1.0 - ON_MOTOR) * drags[1]) / load
            at = [x + step_s * v for x, v in zip(at, speed, strict=True)]
    noise = np.random.default_rng(seed + 100).normal(0.0, 0.01 * np.std(effort), len(effort))
    axis = AxisRecord(shown, effort + noise, "rad", "N*m")
    return Recording(PERIOD_S * np.arange(len(shown)), {"x": axis}, f"{resonance_hz} Hz, {seed}")


@cache
def soft() -> AxisDiagnosis:
    """Of 10 Hz, beside another motion of the same machine."""
    found = diagnose([recorded(10.0, 1)], validate=recorded(10.0, 2))
    scored = found.validation["x"]
    assert scored.extended < 0.3 * scored.base
    return found.axes["x"]


def test_it_is_named_with_its_resonance_and_carries_over() -> None:
    axis = soft()
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.effect == "noncollocated_compliance"
    rate_hz = float(cause.term.values["lag_per_acceleration"]) ** -0.5 / (2.0 * np.pi)
    assert rate_hz == pytest.approx(10.0, rel=0.03)


def test_base_parameters_come_closer() -> None:
    axis, truth = soft(), np.array([INERTIA, VISCOUS, COULOMB])
    off = [
        np.abs(model.estimate.parameters[:3] / truth - 1.0) for model in (axis.base, axis.extended)
    ]
    assert np.all(off[1] < off[0])
    assert off[1][0] < 0.01


def test_a_loop_on_this_encoder_meets_the_resonance() -> None:
    (spring,) = plant_of(soft().model).springs
    at = 1j * spring.rate_rad_s * np.array([1.0, 3.0])
    rigid = 1.0 / (at * (at * INERTIA + VISCOUS))
    ratio = plant_of(soft().model).response(at) / rigid
    assert np.abs(ratio[0]) > 10.0
    assert ratio[1].real == pytest.approx(-1.0 / 8.0, rel=0.1)  # it moves against the motor


def test_its_model_can_be_simulated_and_is_found_again() -> None:
    """Stiff gains bear the spring; soft ones know nothing of it, and do not close a loop."""
    references = recorded_references(recorded(10.0, 2), {"x": "rad"})
    model, scenario = Model({"x": soft().model}), Scenario(references, noise=0.01)
    with pytest.raises(ModelError, match="does not follow"):
        record(model, scenario, "soft gains")
    again = record(model, replace(scenario, stiff=True), "stiff gains")
    axis = diagnose([again]).axes["x"]
    assert [cause.term.effect for cause in axis.causes] == ["noncollocated_compliance"]


def test_a_stiff_chain_is_no_cause() -> None:
    axis = diagnose([recorded(40.0, 3)]).axes["x"]
    assert axis.verdict is Verdict.ADEQUATE
    assert axis.causes == ()

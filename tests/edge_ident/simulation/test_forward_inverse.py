"""Forward and inverse direction are one physics: what one simulates, the other explains.

Every effect is simulated in closed loop; along the motion that came of it, the inverse direction
must give back the effort that was applied.
"""

from collections.abc import Mapping

import numpy as np
import pytest

from edge_ident.model.effect import scale_of
from edge_ident.model.effects import catalogue, random_term
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import BASE, AxisModel, Term
from edge_ident.model.motion import Motion
from edge_ident.signals.filters import lowpass
from edge_ident.simulation.loop import References, Sampling, Simulation, closed_loop
from edge_ident.simulation.machine import Machine
from firmware_interface.gains import AxisGains

PERIOD_S = 0.002
BASE_TERM = Term(
    BASE, {"inertia": 0.4, "viscous_friction": 0.9, "coulomb_friction": 1.4, "offset": 0.2}
)
GAINS = AxisGains(600.0, 30.0, 0.0, 0.0, 0.4, 0.9, 1.4, 0.05, 0.2)
# values that show well on the motion below; an effect that is not here is drawn at random
EXAMPLES: Mapping[str, Mapping[str, float]] = {
    "actuator_deadband": {"width": 0.3},
    "actuator_saturation": {"limit": 2.9},
    "asymmetric_friction": {"difference": 0.3},
    "backlash": {"gap": 0.02, "load_inertia": 0.2, "deceleration": 4.0},
    "coupling_compliance": {"load_inertia": 0.2, "rate": 25.0, "damping_ratio": 0.4},
    "cross_axis_coupling": {
        "inertia": 0.1, "viscous_friction": 0.2, "coulomb_friction": -0.2,
        "outer_sine": 0.05, "inner_cosine": 0.06, "inner_sine": -0.05,
    },
    "disturbance_event": {"time": 0.7, "duration": 0.4, "level": 1.5},
    "encoder_eccentricity": {"cosine": 0.03, "sine": -0.02, "period": 1.3},
    "gain_drift": {"rate": 0.1, "curvature": -0.01},
    "load_dependent_friction": {"share": 0.4, "guided": 0.5, "moved": 0.6},
    "nonlinear_viscous": {"level": 0.4, "exponent": 1.7},
    "noncollocated_compliance": {"lag_per_acceleration": 7e-5, "damping_ratio": 0.5},
    "offset_drift": {"rate": 0.2, "curvature": -0.05},
    "payload_change": {"time": 1.0, "inertia": 0.15, "coulomb_friction": 0.3, "offset": 0.1},
    "position_dependent_friction": {"gradient": 0.2, "cosine": 0.2, "sine": 0.1, "period": 0.7},
    "position_dependent_load": {
        "stiffness": 0.5, "curvature": 0.3, "cosine": 0.2, "sine": 0.2, "period": 2.0,
    },
    "presliding_hysteresis": {"level": 0.9, "distance": 0.02},
    "stribeck_friction": {"level": 0.7, "speed": 0.2},
    "time_delay": {"delay": 0.0123},
    "torque_ripple": {"cosine": 0.3, "sine": 0.2, "period": 0.3},
    "warm_up": {"excess": 0.5, "time_constant": 0.8},
}  # fmt: skip
# relative to the effect's own effort, below 15 Hz, once the loads' unknown start is forgotten
TOLERANCE = {"backlash": 0.15, "coupling_compliance": 0.1, "noncollocated_compliance": 0.1}


def references() -> References:
    """Two axes in full swing after half a second, faster than the paper's motion."""
    time = PERIOD_S * np.arange(-250, 850)
    angle = 3.1 * time + np.array([[0.4], [2.2]])
    share = np.clip(1.0 + time / 0.5, 0.0, 1.0)
    position = (
        share**3
        * (10 - 15 * share + 6 * share**2)
        * (0.7 * np.sin(angle) + 0.07 * np.cos(3 * angle))
    )
    velocity = np.gradient(position, PERIOD_S, axis=1)
    return References(time, position, velocity, np.gradient(velocity, PERIOD_S, axis=1))


def example(effect: str) -> Mapping[str, float]:
    if effect in EXAMPLES:
        return EXAMPLES[effect]
    motion = references()
    arrays = (motion.time_s, motion.position[0], motion.velocity[0], motion.acceleration[0])
    scale = scale_of(AxisModel((BASE_TERM,)).parameters, *arrays)
    values = random_term(effect, np.random.default_rng(1), scale, "z").values
    return {name: float(value) for name, value in values.items()}


def simulated(*effects: str) -> tuple[AxisModel, Simulation]:
    terms = (Term(effect, example(effect), source_axis="z") for effect in effects)
    axes = {"x": AxisModel((BASE_TERM, *terms)), "z": AxisModel((BASE_TERM,))}
    motion = references()
    machine = Machine(axes, motion.position[:, :1], np.full(2, 3.0), PERIOD_S, 0.0)
    exact = Sampling(np.zeros(2), np.zeros(2))
    return axes["x"], closed_loop(machine, motion, {name: [GAINS] for name in axes}, exact)


def between_samples(simulation: Simulation) -> list[Motion]:
    """Motion of both axes in the middle of every sample, over which the command is held."""
    position, velocity = simulation.true_position[:, 0], simulation.true_velocity[:, 0]
    time = simulation.time_s[1:] - 0.5 * PERIOD_S
    return [
        Motion.known(time, 0.5 * (q[1:] + q[:-1]), 0.5 * (v[1:] + v[:-1]), np.diff(v) / PERIOD_S)
        for q, v in zip(position, velocity, strict=True)
    ]


def as_read(motion: Motion, values: Mapping[str, float]) -> Motion:
    """The motion that an eccentric encoder reads, by the chain rule."""
    rate = 2 * np.pi / values["period"]
    phasor = (values["cosine"] - 1j * values["sine"]) * np.exp(1j * rate * motion.position)
    error, slope, bend = phasor.real, (1j * rate * phasor).real, -(rate**2) * phasor.real
    return Motion.known(
        motion.time_s,
        motion.position + error,
        motion.velocity * (1 + slope),
        motion.acceleration * (1 + slope) + bend * motion.velocity**2,
    )


def rms(signal: np.ndarray) -> float:
    return float(np.sqrt(np.mean(signal**2)))


@pytest.mark.parametrize("effect", catalogue())
def test_inverse_effort_along_the_simulated_motion_is_the_one_that_was_applied(
    effect: str,
) -> None:
    axis, simulation = simulated(effect)
    motion, other = between_samples(simulation)
    if effect == "encoder_eccentricity":
        motion = as_read(motion, EXAMPLES[effect])
    explained = inverse_effort(axis, motion, {"z": other})
    without = inverse_effort(AxisModel(axis.terms[:1]), motion)
    applied = simulation.effort[0, 0, :-1]
    if effect == "actuator_saturation":  # what is commanded beyond the limit moves nothing
        assert applied.max() > 1.02 * EXAMPLES[effect]["limit"]
        applied = np.clip(applied, -EXAMPLES[effect]["limit"], EXAMPLES[effect]["limit"])
        without = simulation.effort[0, 0, :-1]
    miss, share = applied - explained, explained - without
    # at a sign change the sampled direction is undefined; a deadband is passed in a few samples
    speeds = [motion.velocity, other.velocity]
    signs = [*speeds, explained] if effect == "actuator_deadband" else speeds
    turns = sum(np.abs(np.diff(np.sign(s), append=np.sign(s[-1]))) for s in signs) > 0
    miss[np.convolve(turns, np.ones(31), "same") > 0] = 0.0
    if effect in TOLERANCE:
        miss, share = (lowpass(signal, 15.0, PERIOD_S) for signal in (miss, share))
    assert rms(share) > 0.02 * rms(applied), "the example hardly shows"
    settled = slice(450 if effect in TOLERANCE else 100, None)
    assert rms(miss[settled]) < TOLERANCE.get(effect, 0.02) * rms(share[settled])


def test_friction_that_follows_the_load_follows_that_along_the_stroke_too() -> None:
    axis, simulation = simulated("load_dependent_friction", "position_dependent_load")
    motion, other = between_samples(simulation)
    explained = inverse_effort(axis, motion, {"z": other})
    apart = inverse_effort(AxisModel(axis.terms[:2]), motion)
    apart += inverse_effort(AxisModel((axis.terms[0], axis.terms[2])), motion, {"z": other})
    apart -= inverse_effort(AxisModel(axis.terms[:1]), motion)
    applied = simulation.effort[0, 0, :-1]
    turned = np.abs(np.diff(np.sign(motion.velocity), append=0.0)) > 0
    settled = np.convolve(turned, np.ones(31), "same") == 0
    settled[:100] = False
    assert rms((explained - apart)[settled]) > 0.02 * rms(applied)
    assert rms((applied - explained)[settled]) < 0.02 * rms((explained - apart)[settled])

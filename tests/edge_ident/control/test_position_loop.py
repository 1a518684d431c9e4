"""Loops around a spring, with the encoder before or behind it, checked against a simulation of two
masses that shares no formula."""

import math

import numpy as np
import pytest
import scipy.signal

from edge_ident.control.gain_design import GAIN_MARGIN, PHASE_MARGIN_RAD, design
from edge_ident.control.position_loop import LoopHardware, Plant, SprungLoad, margins_of
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from firmware_interface.gains import AxisGains

PERIOD_S = 0.0025
HARDWARE = LoopHardware(PERIOD_S, 0.0, 2 * math.pi / 84000, 120.0)
INERTIA, VISCOUS = 0.43, 0.9
SPRUNG = (
    {"load_inertia": 0.38, "rate": 100.0, "damping_ratio": 0.002},
    {"load_inertia": 0.38, "rate": 60.0, "damping_ratio": 0.002},
)
"""With the encoder on the motor, and on the load; at the rate, the motor is held."""
BOTH_FREE = (1.0 - 0.38 / INERTIA) ** -0.5
"""Rate and damping ratio with both masses free, over these."""
SOFT = (
    Term("coupling_compliance", SPRUNG[0]),
    Term(
        "noncollocated_compliance",
        {"lag_per_acceleration": (60.0 * BOTH_FREE) ** -2, "damping_ratio": 0.002 * BOTH_FREE},
    ),
)


def axis(*terms: Term) -> AxisModel:
    base = Term(BASE, dict(zip(PARAMETERS, (INERTIA, VISCOUS, 1.4, 0.03), strict=True)))
    return AxisModel((base, *terms))


def two_masses(load_inertia: float, rate: float, damping_ratio: float, *, shared: bool) -> tuple:
    """Motor and load; friction is on the motor, or shared alike. States are both positions and both
    speeds."""
    stiffness = load_inertia * rate**2
    damping = 2.0 * damping_ratio * load_inertia * rate
    motor = INERTIA - load_inertia
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    coupling = np.array([[-1.0, 1.0], [1.0, -1.0]])
    mass = np.array([[motor], [load_inertia]])
    a[2:, :2] = stiffness * coupling / mass
    friction = [VISCOUS / INERTIA] * 2 if shared else [VISCOUS / motor, 0.0]
    a[2:, 2:] = damping * coupling / mass - np.diag(friction)
    b = np.array([[0.0], [0.0], [1.0 / motor], [0.0]])
    return a, b, np.eye(4), np.zeros((4, 1))


def after_a_push(
    gains: AxisGains, encoder: int = 0, gain: float = 1.0, samples: int = 8000
) -> np.ndarray:
    """Position of motor (0) or load (1), where the encoder is, under the sampled law."""
    a, b, *_ = scipy.signal.cont2discrete(
        two_masses(**SPRUNG[encoder], shared=encoder == 1), PERIOD_S
    )
    state, filtered, last = np.array([0.1, 0.1, 0.0, 0.0]), 0.0, 0.1
    smoothing = PERIOD_S / (gains.velocity_filter_s + PERIOD_S)
    trace = np.empty(samples)
    for k in range(samples):
        filtered += smoothing * ((state[encoder] - last) / PERIOD_S - filtered)
        last = state[encoder]
        effort = -gain * (gains.proportional * state[encoder] + gains.derivative * filtered)
        state = a @ state + b[:, 0] * effort
        trace[k] = state[encoder]
    return trace


@pytest.mark.parametrize("encoder", [0, 1])
def test_a_resonance_that_breaks_rigid_gains_is_designed_around(encoder: int) -> None:
    rigid, known = design(axis(), HARDWARE), design(axis(SOFT[encoder]), HARDWARE)
    broken = after_a_push(rigid.gains, encoder, samples=1500)  # longer, and it overflows
    assert np.max(np.abs(broken[-500:])) > 10 * np.max(np.abs(broken[:500]))
    calm = after_a_push(known.gains, encoder)
    assert np.max(np.abs(calm[-500:])) < 0.05 * np.max(np.abs(calm[:500]))
    assert known.bandwidth_rad_s < rigid.bandwidth_rad_s
    assert known.phase_margin_rad >= PHASE_MARGIN_RAD
    assert known.gain_margin >= GAIN_MARGIN


def test_the_gain_margin_is_where_both_masses_begin_to_ring_for_ever() -> None:
    known = design(axis(SOFT[0]), HARDWARE)
    stable = after_a_push(known.gains, 0, 0.9 * known.gain_margin, 20_000)
    unstable = after_a_push(known.gains, 0, 1.1 * known.gain_margin, 20_000)
    assert np.ptp(stable[-1000:]) < 0.5 * np.ptp(stable[4000:5000])
    assert np.ptp(unstable[-1000:]) > 2.0 * np.ptp(unstable[4000:5000])


def test_a_load_on_a_stiff_spring_is_a_rigid_one() -> None:
    gains = design(axis(), HARDWARE).gains
    stiff = Plant(INERTIA, VISCOUS, (SprungLoad(0.2, 1e5, 0.05),))
    np.testing.assert_allclose(
        margins_of(gains, (stiff,), HARDWARE),
        margins_of(gains, (Plant(INERTIA, VISCOUS),), HARDWARE),
        rtol=0.01,
    )


def test_heavier_means_all_parts_heavier() -> None:
    plant = Plant(0.4, 0.9, (SprungLoad(0.1, 50.0, 0.1),)).with_inertia(0.5)
    assert (plant.inertia, plant.loads[0].inertia) == (0.5, pytest.approx(0.125))

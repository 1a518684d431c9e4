"""Loops around a load on a spring, checked against a two-mass simulation that shares no formula."""

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
SPRUNG = {"load_inertia": 0.38, "rate": 100.0, "damping_ratio": 0.002}


def axis(**sprung: float) -> AxisModel:
    base = Term(BASE, dict(zip(PARAMETERS, (INERTIA, VISCOUS, 1.4, 0.03), strict=True)))
    return AxisModel((base, *([Term("coupling_compliance", sprung)] if sprung else [])))


def two_masses(load_inertia: float, rate: float, damping_ratio: float) -> tuple:
    """Motor and load in bearings of their own: states are both positions and both speeds."""
    stiffness = load_inertia * rate**2
    damping = 2.0 * damping_ratio * load_inertia * rate
    motor = INERTIA - load_inertia
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    coupling = np.array([[-1.0, 1.0], [1.0, -1.0]])
    mass = np.array([[motor], [load_inertia]])
    a[2:, :2] = stiffness * coupling / mass
    a[2:, 2:] = damping * coupling / mass - np.diag([VISCOUS / motor, 0.0])
    b = np.array([[0.0], [0.0], [1.0 / motor], [0.0]])
    return a, b, np.eye(4), np.zeros((4, 1))


def after_a_push(gains: AxisGains, gain: float = 1.0, samples: int = 8000) -> np.ndarray:
    """Motor position of the sampled law around both masses."""
    a, b, *_ = scipy.signal.cont2discrete(two_masses(**SPRUNG), PERIOD_S)
    state, filtered, last = np.array([0.1, 0.1, 0.0, 0.0]), 0.0, 0.1
    smoothing = PERIOD_S / (gains.velocity_filter_s + PERIOD_S)
    trace = np.empty(samples)
    for k in range(samples):
        filtered += smoothing * ((state[0] - last) / PERIOD_S - filtered)
        last = state[0]
        effort = -gain * (gains.proportional * state[0] + gains.derivative * filtered)
        state = a @ state + b[:, 0] * effort
        trace[k] = state[0]
    return trace


def test_a_resonance_that_breaks_rigid_gains_is_designed_around() -> None:
    rigid, known = design(axis(), HARDWARE), design(axis(**SPRUNG), HARDWARE)
    broken = after_a_push(rigid.gains)
    assert np.max(np.abs(broken[-500:])) > 10 * np.max(np.abs(broken[:500]))
    calm = after_a_push(known.gains)
    assert np.max(np.abs(calm[-500:])) < 0.05 * np.max(np.abs(calm[:500]))
    assert known.bandwidth_rad_s < rigid.bandwidth_rad_s
    assert known.phase_margin_rad >= PHASE_MARGIN_RAD
    assert known.gain_margin >= GAIN_MARGIN


def test_the_gain_margin_is_where_both_masses_begin_to_ring_for_ever() -> None:
    known = design(axis(**SPRUNG), HARDWARE)
    stable = after_a_push(known.gains, 0.9 * known.gain_margin, 20_000)
    unstable = after_a_push(known.gains, 1.1 * known.gain_margin, 20_000)
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

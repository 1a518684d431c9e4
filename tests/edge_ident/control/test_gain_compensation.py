"""Gains that know a drive's effects: what is fed forward, what margins bear, what is left out."""

import math
from collections.abc import Mapping

import numpy as np
import pytest

from edge_ident.control.compensation import loop_delay_s
from edge_ident.control.gain_design import design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.loop import Sampling, closed_loop, recorded_references
from edge_ident.simulation.machine import Machine
from edge_ident.simulation.simulate import DELAY_SHARE
from firmware_interface.gains import AxisGains

PERIOD_S = 0.0025
COUNT_RAD = 2 * math.pi / 8400
HARDWARE = LoopHardware(PERIOD_S, DELAY_SHARE * PERIOD_S, COUNT_RAD, 12.0)
BASE_TERM = Term(BASE, dict(zip(PARAMETERS, (0.43, 0.9, 1.4, 0.03), strict=True)))
STRIBECK = Term("stribeck_friction", {"level": 1.5, "speed": 0.5})
DIRECTION = Term("asymmetric_friction", {"difference": -0.3})


def ripple(cosine: float, sine: float, period: float) -> Term:
    return Term("torque_ripple", {"cosine": cosine, "sine": sine, "period": period})


def delay(delay_s: float) -> Term:
    return Term("time_delay", {"delay": delay_s})


def axis(*effects: Term) -> AxisModel:
    return AxisModel((BASE_TERM, *effects))


EFFECTS = {
    "stribeck": (STRIBECK,),
    "direction": (DIRECTION,),
    "ripple": (ripple(0.3, 0.1, 0.9), ripple(0.0, 0.1, 0.3)),
}


def tracking_variances(plants: dict[str, AxisModel], gains: dict[str, AxisGains]) -> Mapping:
    """Mean square miss of simulated axes behind the board's law, all on the same motion."""
    time = PERIOD_S * np.arange(1600)
    position = np.sin(1.5 * time) + 0.3 * np.sin(3.1 * time)
    record = AxisRecord(position, 0 * time, "rad", "N*m")
    references = recorded_references(
        Recording(time, dict.fromkeys(plants, record), "test"), dict.fromkeys(plants, "rad")
    )
    top_speed = np.max(np.abs(references.velocity), axis=1)
    start = references.position[:, :1]
    machine = Machine(plants, start, top_speed, PERIOD_S, HARDWARE.control_delay_s)
    counts = np.ones((2, len(plants))) * [[COUNT_RAD], [0.004]]
    laws = {name: [of_axis] for name, of_axis in gains.items()}
    found = closed_loop(machine, references, laws, Sampling(*counts, 0.0), seed=0)
    miss = found.true_position[:, 0] - references.recorded
    return dict(zip(plants, np.mean(miss**2, axis=-1), strict=True))


def test_feed_forward_takes_what_an_effect_adds_out_of_the_tracking_error() -> None:
    ignorant = design(axis(), HARDWARE)
    plants, gains = {"none": axis()}, {"none": ignorant.gains}
    for name, effects in EFFECTS.items():
        knowing = design(axis(*effects), HARDWARE)
        assert knowing.bandwidth_rad_s == ignorant.bandwidth_rad_s
        plants |= {f"{name}, ignorant": axis(*effects), f"{name}, knowing": axis(*effects)}
        gains |= {f"{name}, ignorant": ignorant.gains, f"{name}, knowing": knowing.gains}
    found = tracking_variances(plants, gains)
    floor = found["none"]
    for name in EFFECTS:
        before, after = (found[f"{name}, {who}"] - floor for who in ("ignorant", "knowing"))
        print(name, before / floor, after / floor)
        assert before > 0.05 * floor, name
        assert abs(after) < 0.1 * before, name


def test_the_four_largest_ripples_go_to_the_board_and_the_others_are_named() -> None:
    sizes = (0.1, 0.5, 0.2, 0.4, 0.3, 0.05)
    found = design(axis(*(ripple(0.0, -s, s) for s in sizes)), HARDWARE)
    assert found.gains.ripple_sine == (-0.5, -0.4, -0.3, -0.2)
    assert found.gains.ripple_period_rad == (0.5, 0.4, 0.3, 0.2)
    assert [unused.effect for unused in found.unused] == ["torque_ripple"] * 2
    assert "takes 4" in found.unused[0].reason


def test_what_the_law_has_no_term_for_is_named() -> None:
    backlash = Term("backlash", {"gap": 0.01, "load_inertia": 0.1, "deceleration": 1.0})
    found = design(axis(STRIBECK, backlash, delay(0.001)), HARDWARE)
    assert [unused.effect for unused in found.unused] == ["backlash"]
    assert design(axis(), HARDWARE).unused == ()


def test_a_delay_costs_what_as_much_delay_of_the_board_costs() -> None:
    late = LoopHardware(PERIOD_S, HARDWARE.control_delay_s + 0.008, COUNT_RAD, 12.0)
    of_the_board = design(axis(), late)
    for sign in (-1, 1):
        found = design(axis(delay(sign * 0.008)), HARDWARE)
        assert found.bandwidth_rad_s == pytest.approx(of_the_board.bandwidth_rad_s, rel=1e-9)
        assert found.phase_margin_rad == pytest.approx(of_the_board.phase_margin_rad, rel=1e-9)
    assert of_the_board.bandwidth_rad_s < 0.8 * design(axis(), HARDWARE).bandwidth_rad_s
    assert loop_delay_s(axis(delay(0.003), delay(-0.001))) == pytest.approx(0.002)


def test_without_effects_the_boards_law_is_that_of_the_base_model() -> None:
    gains = design(axis(), HARDWARE).gains
    assert gains.stribeck_feedforward == gains.viscous_difference_feedforward == 0.0
    assert not any(gains.ripple_cosine + gains.ripple_sine)
    assert min(gains.ripple_period_rad) > 0.0

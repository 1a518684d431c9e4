"""What gains leave out, and why: the board, the range, the limits; what the margins bear."""

import math
from dataclasses import replace

import pytest

from edge_ident.control.gain_design import design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.model.model import Term
from firmware_interface.board import Board
from firmware_interface.gains import AxisGains
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.settings import DEFAULT_LIMITS
from tests.edge_ident.control.cured import BACKLASH, CURED, HARDWARE, RANGE, WAVES, axis, term


def test_what_is_not_known_to_hold_somewhere_is_left_out() -> None:
    for effect in ("nonlinear_viscous", "position_dependent_load", "position_dependent_friction"):
        (unused,) = design(axis(term(effect, CURED[effect][0], None)), HARDWARE).unused
        assert unused.reason == "the model does not say in which range it is supported"


def test_waves_that_the_table_cannot_hold_are_left_out() -> None:
    fine = {"gradient": 0.0, "cosine": 0.0, "sine": 0.3, "period": 0.2}
    found = design(axis(term("position_dependent_friction", fine)), HARDWARE)
    assert found.unused[0].reason.startswith("24 entries over the supported range leave")
    assert not any(found.gains.local_friction_table)


def test_a_board_of_map_3_has_what_its_law_has_and_says_what_it_lacks() -> None:
    effects = {**{name: values for name, (values, _) in CURED.items()}, "backlash": BACKLASH}
    model = axis(*(term(name, values) for name, values in effects.items()))
    old = replace(HARDWARE, map_version=3)
    found = design(model, old)
    assert {used.effect for used in found.used} == {
        "stribeck_friction",
        "asymmetric_friction",
        "torque_ripple",
    }
    reasons = {unused.effect: unused.reason for unused in found.unused}
    assert reasons["position_dependent_load"] == (
        "the board's register map 3 has no table over position"
    )
    assert set(reasons) == set(effects) - {used.effect for used in found.used}
    plain = design(axis(), old).gains
    assert found.gains.viscous_feedforward > plain.viscous_feedforward  # of what is left out
    new = {name for name in vars(plain) if getattr(found.gains, name) != getattr(plain, name)}
    assert new <= old.law


def test_what_is_beyond_the_boards_largest_gains_is_left_out_with_its_number() -> None:
    largest = replace(DEFAULT_LIMITS.gain_maximum, stribeck_feedforward=0.5)
    bounded = replace(HARDWARE, gain_maximum=largest)
    found = design(axis(term("stribeck_friction", {"level": 0.7, "speed": 0.2})), bounded)
    assert found.gains.stribeck_feedforward == 0.0
    assert found.unused[0].reason == (
        "its stribeck_feedforward would be 0.7, and the board takes 0.5"
    )


def test_what_would_exceed_the_effort_limit_at_constant_speed_is_left_out() -> None:
    weak = replace(HARDWARE, effort_limit_nm=4.0)  # the base model takes 3.5 N·m at 2 rad/s
    strong = term("stribeck_friction", {"level": 3.0, "speed": 1.0})
    found = design(axis(strong, term("asymmetric_friction", {"difference": 0.1})), weak)
    assert [used.effect for used in found.used] == ["asymmetric_friction"]
    assert "of the 4 N·m that there are" in found.unused[0].reason


def test_a_saturated_actuator_says_which_motion_fits() -> None:
    found = design(axis(term("actuator_saturation", {"limit": 6.0})), HARDWARE)
    assert found.used[0].sentence == (
        "feed-forward stays below 6 N·m; motions fit that accelerate by up to 5.81 rad/s² at any "
        "speed up to 2 rad/s"
    )  # (6 - 0.9·2 - 1.4 - 0.3) N·m / 0.43 kg·m²


def test_margins_that_bear_an_effect_are_named() -> None:
    sprung = {"load_inertia": 0.1, "rate": 200.0, "damping_ratio": 0.1}
    found = design(
        axis(term("coupling_compliance", sprung), term("time_delay", {"delay": -0.004})), HARDWARE
    )
    assert [used.sentence for used in found.used] == [
        "the margins bear its resonance at 31.8 Hz",
        "the margins bear its 4 ms",
    ]


def test_another_axis_angle_is_left_to_feedback() -> None:
    arm = {"inertia": 0.1, "viscous_friction": 0.0, "coulomb_friction": 0.0, "inertia_cosine": 0.1}
    lever = Term(
        "position_dependent_load", {**WAVES, "sum_sine": 0.3}, source_axis="z", supported=RANGE
    )
    found = design(axis(term("cross_axis_coupling", arm), lever), HARDWARE)
    assert found.used == ()
    assert "the angle between the axes" in found.unused[0].reason
    assert "another axis's position" in found.unused[1].reason


def test_a_friction_curve_that_is_not_the_boards_is_left_out() -> None:
    curve = {"level": 0.7, "speed": 0.2, "exponent": 1.0}
    found = design(axis(term("stribeck_friction", curve)), HARDWARE)
    assert found.gains.stribeck_feedforward == 0.0
    assert found.unused[0].reason == "it falls otherwise than the board's curve does"


def test_gains_of_the_law_are_all_numbers_that_a_board_takes() -> None:
    effects = {**{name: values for name, (values, _) in CURED.items()}, "backlash": BACKLASH}
    model = axis(*(term(name, values) for name, values in effects.items()))
    gains: AxisGains = design(model, HARDWARE).gains
    assert all(math.isfinite(value) for value in gains.numbers().values())


def test_what_is_left_out_goes_to_the_base_model_as_far_as_it_can() -> None:
    """A drag that is viscous friction by another name."""
    almost = {"level": 0.4, "exponent": 1.001}
    found = design(axis(term("nonlinear_viscous", almost)), replace(HARDWARE, map_version=3)).gains
    plain = design(axis(), HARDWARE).gains
    assert found.viscous_feedforward == pytest.approx(0.9 + 0.4, rel=1e-3)
    assert found.coulomb_feedforward == pytest.approx(plain.coulomb_feedforward, abs=1e-3)
    assert found.proportional == plain.proportional


def test_a_weight_that_is_left_out_is_an_offset_in_the_mean() -> None:
    load = {**WAVES, "cosine": 0.0, "sine": 0.0, "stiffness": 0.2}
    old = replace(HARDWARE, map_version=3)
    found = design(axis(term("position_dependent_load", load)), old).gains
    assert found.offset_feedforward == pytest.approx(0.3 + 0.2 * 1.0, rel=0.02)  # at mid-range


@pytest.mark.parametrize("version", [3, 4])
def test_a_board_says_which_law_and_which_largest_gains_it_has(version: int) -> None:
    identity = replace(Board.connect(VirtualBoard()).identity, map_version=version)
    hardware = LoopHardware.of_board(identity, DEFAULT_LIMITS)
    assert hardware.law == set(identity.gain_fields)
    assert hardware.gain_maximum == DEFAULT_LIMITS.gain_maximum

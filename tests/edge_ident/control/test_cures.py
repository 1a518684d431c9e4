"""Each effect that gains cure: feed-forward against the model's own inverse direction."""

import math
from dataclasses import replace

import numpy as np
import pytest

from edge_ident.control.gain_design import GainDesign, Ground, design
from edge_ident.control.law_terms import table_fade_speed, wave_fade_speed
from edge_ident.model.effects import catalogue, named
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.model.motion import Motion
from firmware_interface.control_law import Memory, deadband_nm, exact_effort_nm, feedforward_nm
from firmware_interface.motion import Reference
from tests.edge_ident.control.cured import BACKLASH, CURED, HARDWARE, LATE_S, RANGE, axis, term

PERIOD_S = HARDWARE.sample_period_s


def swing(rate: float, middle: float, size: float) -> Motion:
    time = PERIOD_S * np.arange(6000)
    sine, cosine = np.sin(rate * time), np.cos(rate * time)
    return Motion.known(time, middle + size * sine, size * rate * cosine, -size * rate**2 * sine)


OWN, OTHER = swing(0.8, 1.0, 1.8), swing(1.3, 0.0, 1.0)


def way(motion: Motion) -> Reference:
    return Reference(motion.position, motion.velocity, motion.acceleration)


def fed_forward(found: GainDesign) -> np.ndarray:
    return exact_effort_nm(found.gains, way(OWN), way(OTHER))[0]


EVERY = [(effect, values, share) for effect, (values, share) in CURED.items()]
BENT = ("asymmetric_friction", {"difference": 0.3, "bend": -0.1}, 0.02)
"""It fits in no field, and is sampled over the speed."""


@pytest.mark.parametrize(("effect", "values", "share"), [*EVERY, BENT])
def test_feed_forward_is_the_effort_that_the_effect_takes(
    effect: str, values: dict[str, float], share: float
) -> None:
    models = axis(term(effect, values)), axis()
    found, plain = (design(model, HARDWARE) for model in models)
    assert [used.effect for used in found.used] == [effect]
    assert found.unused == ()
    needed, without = (inverse_effort(model, OWN, {"z": OTHER}) for model in models)
    added = fed_forward(found) - fed_forward(plain)
    smoothed = 8.0 * found.gains.coulomb_smoothing_rad_s
    sliding = (np.abs(OWN.velocity) > smoothed) & (np.abs(OTHER.velocity) > smoothed)
    begun = np.arange(len(sliding)) > 2000  # the memory starts without knowing the past
    error = (added - (needed - without))[sliding & begun]
    size = np.sqrt(np.mean((needed - without)[sliding & begun] ** 2))
    assert np.sqrt(np.mean(error**2)) < share * size


def test_every_effect_of_the_catalogue_is_cured_or_says_why_not() -> None:
    for name, effect in catalogue().items():
        compensation = effect.compensation
        assert compensation.used != bool(compensation.without), name
        if compensation.feedforward or compensation.over:
            assert name in {*CURED, "backlash", "actuator_deadband"}


@pytest.mark.parametrize("effect", ["position_dependent_load", "position_dependent_friction"])
def test_tables_end_with_the_supported_positions(effect: str) -> None:
    found, plain = (
        design(model, HARDWARE).gains for model in (axis(term(effect, CURED[effect][0])), axis())
    )
    cell = 4.0 / 23.0
    beyond = np.array([-1.0 - 1.01 * cell, 3.0 + 1.01 * cell, -6.0, 8.0])
    slow = Reference(beyond, np.full(4, 0.5), np.zeros(4))
    np.testing.assert_array_equal(feedforward_nm(found, slow, np), feedforward_nm(plain, slow, np))


def test_friction_curves_end_with_the_supported_speeds() -> None:
    found = design(axis(term("nonlinear_viscous", {"level": 0.3, "exponent": 2.0})), HARDWARE).gains
    assert found.friction_top_speed_rad_s == 2.0
    assert found.friction_forward[-1] == pytest.approx(0.3 * 2.0**2, rel=0.01)
    # backwards only 1.5 rad/s were supported: √(1.5/2) is between entries 9 and 10 of 11
    assert found.friction_backward[9] == pytest.approx(0.3 * (2.0 * (9 / 11) ** 2) ** 2, rel=0.02)
    assert found.friction_backward[11] == 0.0


def test_presliding_friction_leaves_the_coulomb_friction() -> None:
    found = design(axis(term("presliding_hysteresis", {"level": 0.8, "distance": 0.02})), HARDWARE)
    assert found.gains.coulomb_feedforward == pytest.approx(0.6)
    assert found.gains.presliding_feedforward == 0.8


def test_the_motor_leads_by_half_the_gap_and_the_design_says_what_that_means() -> None:
    found = design(axis(term("backlash", BACKLASH)), HARDWARE)
    (used,) = found.used
    assert "an encoder on the motor cannot show whether the load does" in used.sentence
    gains = found.gains
    rows = Memory().along(gains, OWN.position)
    away = np.abs(np.abs(OWN.velocity[1:]) - 1.0) < 0.2
    np.testing.assert_allclose(
        rows.backlash_rad[away], 0.01 * np.sign(OWN.velocity[1:])[away], atol=2e-4
    )


def test_a_load_that_its_weight_holds_on_one_side_has_no_play_to_make_up_for() -> None:
    found = design(axis(term("backlash", {**BACKLASH, "weight": -2.5})), HARDWARE)
    assert found.gains.backlash_offset_rad == 0.0
    assert found.unused[0].reason == "its weight keeps the load on one side of the gap"
    viscous = {**BACKLASH, "weight": -2.5, "damping_rate": 1.0}  # 1 rad/s² more at 1 rad/s
    assert design(axis(term("backlash", viscous)), HARDWARE).gains.backlash_offset_rad == 0.01


def test_the_inverse_gives_what_the_deadband_takes_and_never_more() -> None:
    values = {"width": np.array(0.5)}
    found = design(axis(term("actuator_deadband", {"width": 0.5})), HARDWARE)
    effort = np.linspace(-3.0, 3.0, 601)
    command = deadband_nm(found.gains, effort, np)
    given = named("actuator_deadband").torque(command, effort, values)
    sure = np.abs(effort) > 4.0 * found.gains.deadband_smoothing
    np.testing.assert_allclose(given[sure], effort[sure], atol=1e-3)
    assert np.all(np.abs(given) <= np.abs(effort) + 1e-12)  # never more gain than was designed


def test_a_width_in_doubt_is_smoothed_until_it_takes_half_of_the_gain_margin() -> None:
    doubtful = replace(term("actuator_deadband", {"width": 0.5}), std={"width": 0.2})
    smoothing = design(axis(doubtful), HARDWARE).gains.deadband_smoothing
    doubt = math.hypot(2.0 * 0.2, 0.1 * 0.5)  # the effect's own discrepancy is a tenth
    assert 1.0 + doubt / smoothing == pytest.approx(math.sqrt(2.5))


def test_a_late_wave_never_leaves_more_than_there_was() -> None:
    fade = wave_fade_speed(0.7, LATE_S)
    speed = np.linspace(0.01, 3.0, 300) * fade
    phase = 2.0 * np.pi * speed * LATE_S / 0.7
    share = np.clip(2.0 - speed / fade, 0.0, 1.0)
    assert np.max(np.abs(np.exp(1j * phase) - share)) < 1.0 + 1e-9
    assert np.degrees(np.max(phase[share > 0.0])) == pytest.approx(60.0, abs=1.0)


def test_a_table_with_a_wave_fades_as_the_wave_does_and_a_level_one_never() -> None:
    at = 0.01 * np.arange(401)
    table = 0.3 * np.sin(2.0 * np.pi * at / 0.5)
    assert table_fade_speed(table, 0.01, LATE_S) == pytest.approx(
        wave_fade_speed(0.5, LATE_S), rel=0.01
    )
    assert table_fade_speed(np.full(24, 0.4), 0.1, LATE_S) == math.inf


@pytest.mark.parametrize(
    ("effect", "values", "at_end"),
    [
        (
            "warm_up",
            {"excess": 0.5, "time_constant": 10.0},
            (0.43, 0.9 + 0.5 * math.exp(-2), 1.4, 0.3),
        ),
        ("offset_drift", {"rate": 0.01, "curvature": 0.001}, (0.43, 0.9, 1.4, 0.9)),
        ("gain_drift", {"rate": 0.01}, tuple(1.2 * p for p in (0.43, 0.9, 1.4, 0.3))),
        (
            "payload_change",
            {"time": 12.0, "inertia": 0.1, "coulomb_friction": 0.2, "offset": -0.1},
            (0.53, 0.9, 1.6, 0.2),
        ),
    ],
)
def test_gains_fit_the_end_of_the_recording(
    effect: str, values: dict[str, float], at_end: tuple[float, ...]
) -> None:
    model = axis(term(effect, values))
    then = Term(BASE, dict(zip(PARAMETERS, at_end, strict=True)), supported=RANGE)
    found = design(model, HARDWARE, ground=Ground(20.0))
    assert found.gains.numbers() == pytest.approx(
        design(AxisModel((then,)), HARDWARE).gains.numbers(), rel=1e-6
    )
    assert "end of the recording" in found.used[0].sentence
    assert "which time" in design(model, HARDWARE).unused[0].reason

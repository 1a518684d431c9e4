"""Whether an effort can be that of the motion beside it."""

import numpy as np
import pytest

from edge_ident.estimation.effort_checks import check_effort, unbounded, unphysical
from edge_ident.estimation.least_squares import estimation_part
from edge_ident.estimation.trust import Finding
from edge_ident.signals.conditioning import condition
from firmware_interface.plant import (
    Motion,
    Noise,
    draw,
    draw_drives,
    multisine,
    paper,
    simulate,
    staircase,
)

PERIOD_S = 0.0025


def findings(time_s: np.ndarray, position: np.ndarray, effort: np.ndarray) -> list[Finding]:
    signals = condition(time_s, position, effort)
    return check_effort(signals, estimation_part(signals))


def codes(time_s: np.ndarray, position: np.ndarray, effort: np.ndarray) -> list[str]:
    return [found.code for found in findings(time_s, position, effort)]


def sound(
    samples: int = 4000, rates: tuple[float, ...] = (1.1, 3.3, 8.1)
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    time_s = PERIOD_S * np.arange(samples)
    position, velocity, acceleration = np.zeros((3, samples))
    for amplitude, rate in zip((2.0, 0.6, 0.15), rates, strict=False):
        position += amplitude * np.sin(rate * time_s + rate)
        velocity += amplitude * rate * np.cos(rate * time_s + rate)
        acceleration -= amplitude * rate**2 * np.sin(rate * time_s + rate)
    noise = 0.02 * np.random.default_rng(2).standard_normal(samples)
    effort = 0.5 * acceleration + 0.8 * velocity + 0.6 * np.sign(velocity) + 0.2 + noise
    return time_s, position + 1e-5 * noise, effort


@pytest.mark.parametrize(
    "motion",
    [multisine(3000), pytest.param(staircase(3000), marks=pytest.mark.thorough)],
    ids=lambda m: m.name,
)
def test_no_fault_of_a_drive_is_taken_for_a_wrong_recording(motion: Motion) -> None:
    drives = draw_drives(2, 5)
    for name in ("backlash", "time_delay", "position_dependent_load"):
        effects = draw([name], drives, motion, 5)
        made = simulate(
            drives, motion, effects=effects, noise=Noise(0.02), seed=5, steps_per_sample=5
        )
        for position, effort in zip(made.position[0], made.effort[0], strict=True):
            assert codes(made.time_s, position, effort) == [], name


def test_a_spring_makes_inertia_negative_and_has_the_right_sign() -> None:
    time_s, position, effort = sound(rates=(1.1,))
    assert codes(time_s, position, effort + 3.0 * position) == []
    assert codes(time_s, position, -effort) == ["effort_sign"]


@pytest.mark.parametrize("samples", [-40, -20, 24, 40])
def test_an_effort_from_another_time_is_told_with_its_shift(samples: int) -> None:
    time_s, position, effort = sound()
    (found,) = findings(time_s, position, np.roll(effort, samples))
    assert found.code == "effort_late"
    assert found.blocks
    acted_s = float(found.next_step.split()[-1])
    assert acted_s == pytest.approx(-samples * PERIOD_S, abs=0.003)
    assert f"{abs(acted_s):.2g} s {'before' if samples > 0 else 'after'} its pos" in found.message
    assert ("or what lies between motor and encoder is soft" in found.message) is (samples < 0)


@pytest.mark.parametrize("motion", [multisine(4000), staircase(4000)], ids=lambda m: m.name)
def test_a_late_effort_of_a_drive_that_reverses_blocks(motion: Motion) -> None:
    made = simulate(draw_drives(2, 3), motion, noise=Noise(0.01), seed=3, steps_per_sample=5)
    late = np.roll(made.effort, 20, axis=-1)
    for drive, axis in np.ndindex(2, 2):
        (found,) = findings(made.time_s, made.position[drive, axis], late[drive, axis])
        assert found.code == "effort_late"
        assert found.blocks


def test_a_loop_that_answers_the_noise_of_its_encoder_is_not_late() -> None:
    """On so slow a motion the noise has a good part of the acceleration."""
    motion = paper(phase_rad=np.linspace(0.0, 2.0 * np.pi, 40))
    made = simulate(draw_drives(40, 1), motion, noise=Noise(0.01), seed=1, steps_per_sample=5)
    for drive, axis in np.ndindex(40, 2):
        assert codes(made.time_s, made.position[drive, axis], made.effort[drive, axis]) == []


def late_friction(rates: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Friction that reverses 50 ms after the motion, and nothing else that is late."""
    time_s, position, _ = sound(rates=rates)
    velocity = np.gradient(position, PERIOD_S)
    noise = 0.005 * np.random.default_rng(4).standard_normal(len(time_s))
    friction = 0.6 * np.sign(np.roll(velocity, 20)) + 0.2 * velocity
    return time_s, position, 0.02 * np.gradient(velocity, PERIOD_S) + friction + noise


def test_friction_that_reverses_late_is_no_late_recording() -> None:
    assert codes(*late_friction((0.7, 1.9))) == []


def test_where_all_is_near_a_reversal_a_shift_is_told_and_does_not_block() -> None:
    time_s, position, effort = sound(rates=(26.0, 61.0))
    (found,) = findings(time_s, position, np.roll(effort, 18))
    assert found.code == "effort_late"
    assert not found.blocks
    assert "or the axis sticks where it turns" in found.message


def test_a_delay_of_a_few_samples_is_no_defect_of_the_recording() -> None:
    time_s, position, effort = sound()
    assert codes(time_s, position, np.roll(effort, 12)) == []


def test_at_one_frequency_a_shift_is_any_phase() -> None:
    time_s, position, _ = sound(rates=(6.0,))
    effort = np.cos(6.0 * (time_s - 0.1) + 6.0) + 0.001 * np.random.default_rng(1).normal(size=4000)
    assert "effort_late" not in codes(time_s, position, effort)


def test_an_effort_that_is_the_velocity_and_one_that_is_noise() -> None:
    time_s, position, _ = sound()
    assert codes(time_s, position, 2.0 * np.gradient(position, PERIOD_S)) == ["effort_is_velocity"]
    for seed in range(5):
        noise = np.random.default_rng(seed).standard_normal(len(time_s))
        assert codes(time_s, position, noise) == ["unrelated_effort"]


def test_an_optimum_is_unphysical_where_a_sign_is_certain() -> None:
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((400, 4))
    noise = 0.1 * rng.standard_normal(400)
    negative = unphysical(unbounded(columns, columns @ [1.0, -0.5, 0.2, 0.0] + noise))
    assert [(found.code, found.blocks) for found in negative] == [
        ("negative_viscous_friction", False)
    ]
    assert unphysical(unbounded(columns, columns @ [1.0, -0.001, 0.2, -3.0] + noise)) == []

"""Whether an effort can be that of the motion beside it."""

import numpy as np
import pytest

from edge_ident.estimation.effort_checks import check_effort, unbounded, unphysical
from edge_ident.estimation.least_squares import estimation_part
from edge_ident.signals.conditioning import condition
from tests.plant import Motion, Noise, draw, draw_drives, multisine, simulate, staircase

PERIOD_S = 0.0025


def codes(time_s: np.ndarray, position: np.ndarray, effort: np.ndarray) -> list[str]:
    signals = condition(time_s, position, effort)
    return [found.code for found in check_effort(signals, estimation_part(signals))]


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


@pytest.mark.parametrize("motion", [multisine(3000), staircase(3000)], ids=lambda m: m.name)
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
    signals = condition(time_s, position, np.roll(effort, samples))
    (found,) = check_effort(signals, estimation_part(signals))
    assert found.code == "effort_late"
    assert float(found.next_step.split()[5]) == pytest.approx(-samples * PERIOD_S, abs=0.01)


def test_a_delay_of_a_few_samples_is_no_defect_of_the_recording() -> None:
    time_s, position, effort = sound()
    assert codes(time_s, position, np.roll(effort, 6)) == []


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
        ("negative_viscous_friction", True)
    ]
    assert unphysical(unbounded(columns, columns @ [1.0, -0.001, 0.2, -3.0] + noise)) == []

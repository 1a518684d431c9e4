"""The benchmark's ideal test: what it may know, what it may not, and how noise is counted."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded, solve_banded

from firmware_interface.plant import COUNT_RAD, SAMPLE_S
from firmware_interface.plant.plant import STEPS_PER_SAMPLE
from tests.test_evaluation import outcome
from tools.diagnosis_benchmark.outcome import REACH
from tools.diagnosis_benchmark.reach import MeasurementNoise, Trace

Array = NDArray[np.float64]

INERTIA, VISCOUS, COULOMB, OFFSET = 0.5, 0.8, 1.0, 0.2
FINE = MeasurementNoise(0.02, 1e-9, INERTIA, VISCOUS)
COARSE = replace(FINE, count_rad=7.5e-4)
SAMPLES, LEAD = 4000, 40 * STEPS_PER_SAMPLE
CLOCK_S = SAMPLE_S / STEPS_PER_SAMPLE * np.arange(-LEAD, SAMPLES * STEPS_PER_SAMPLE + LEAD + 1)
VELOCITY = 1.5 * np.sin(2 * np.pi * 0.7 * CLOCK_S + 0.4) + 0.5 * np.sin(2 * np.pi * 1.9 * CLOCK_S)
BETWEEN_S, SPEED = (CLOCK_S[1:] + CLOCK_S[:-1]) / 2, (VELOCITY[1:] + VELOCITY[:-1]) / 2
SOUND = (
    INERTIA * np.diff(VELOCITY) / np.diff(CLOCK_S)
    + VISCOUS * SPEED
    + COULOMB * np.sign(SPEED)
    + OFFSET
)


def trace(
    added: Array, noise: MeasurementNoise = FINE, late: int = 0, chain: Array | float = 0.0
) -> Trace:
    """A drive that needs `added` (M,) more in every step, recorded so many steps late; `chain` is
    what the twin's chain takes."""
    first = LEAD - STEPS_PER_SAMPLE // 2 - late
    steps = (SOUND + added)[first : first + SAMPLES * STEPS_PER_SAMPLE]
    effort = steps.reshape(SAMPLES, STEPS_PER_SAMPLE).mean(axis=1)
    return Trace(effort, SOUND + chain, VELOCITY, LEAD, noise)


def wave(frequency_hz: float, size: float = 0.05) -> Array:
    return size * np.sin(2 * np.pi * frequency_hz * BETWEEN_S)


@pytest.mark.parametrize("late", [0, 7, -15])
def test_what_the_base_model_expresses_is_nothing(late: int) -> None:
    """Other base parameters, and a shift of up to 1.5 periods."""
    other = 0.1 * (SOUND - COULOMB * np.sign(SPEED)) + 0.3 * np.sign(SPEED) - 0.2
    seen = trace(other, late=late)
    assert seen.share < 1e-9
    assert seen.detectability < 1e-6


def test_what_a_chain_between_rigid_and_the_twins_takes_is_nothing() -> None:
    """A drive as sound as its twin, a rigid one, and one between; no chain takes the opposite."""
    chain = wave(5.3)
    for like_twin in (0.0, 0.4, 1.0):
        assert trace(like_twin * chain, chain=chain).share < 1e-9
    assert trace(-0.4 * chain, chain=chain).share == trace(-0.4 * chain).share
    softer = trace(1.4 * chain, chain=chain)
    assert softer.share * np.linalg.norm(softer.effort) == pytest.approx(
        0.4 * trace(chain).share * np.linalg.norm(trace(chain).effort), rel=0.01
    )


def test_a_longer_shift_is_something() -> None:
    assert trace(0.0 * SOUND, late=25).detectability > REACH


@pytest.mark.parametrize("late", [0, 7, -15])
def test_what_is_added_is_the_waveform_itself(late: int) -> None:
    """In step with the record, and but for what other base parameters and a chain take of it."""
    swing = wave(5.3)
    seen = trace(swing, late=late, chain=wave(3.1))
    first = LEAD - STEPS_PER_SAMPLE // 2 - late
    steps = swing[first : first + SAMPLES * STEPS_PER_SAMPLE]
    true = steps.reshape(SAMPLES, STEPS_PER_SAMPLE).mean(axis=1)
    assert np.std(seen.added - true) < 0.05 * np.std(true)


def test_in_white_noise_it_is_the_energy_over_the_variance() -> None:
    """A wave that no base parameter resembles keeps its energy, but for the turning points."""
    seen = trace(wave(5.3))
    length = 0.05 / np.sqrt(2.0) * np.sqrt(np.count_nonzero(seen.known))
    assert seen.share * np.linalg.norm(seen.effort) == pytest.approx(length, rel=0.05)
    assert seen.detectability == pytest.approx(length / FINE.effort_nm, rel=0.05)


def test_a_coarse_encoder_hides_what_is_fast() -> None:
    slow, fast = (
        trace(wave(hz), COARSE).detectability / trace(wave(hz)).detectability for hz in (0.3, 12.0)
    )
    assert slow > 0.8
    assert fast < 0.1


def test_nothing_above_the_band_counts() -> None:
    assert trace(wave(40.0)).share < 0.1 * trace(wave(12.0)).share


def test_nobody_knows_friction_where_the_direction_is_not_shown() -> None:
    """Neither within a count of a turning point, nor while a sound chain winds up; three counts
    away it is known."""
    angle = np.append(0.0, np.cumsum(SPEED)) * np.diff(CLOCK_S)[0]
    turns = np.flatnonzero(np.diff(np.sign(VELOCITY)))
    away = np.min(np.abs(angle[:-1, None] - angle[turns]), axis=1) / COUNT_RAD
    slow = np.abs(SPEED) < 0.2
    near, far = slow & (away < 1.0), slow & (away > 3.0)
    assert np.count_nonzero(near) > 100
    assert np.count_nonzero(far) > 100
    assert trace(1.0 * near).share < 1e-9
    assert trace(1.0 * far, COARSE).share > 0.001


def test_rounding_errors_become_white() -> None:
    """Those of a motion that crosses several counts a sample, seen as efforts."""
    rng = np.random.default_rng(8)
    noise = replace(COARSE, effort_nm=0.001)
    angle = np.cumsum(SAMPLE_S * (1.0 + rng.random(20_000)))
    error = noise.count_rad * np.round(angle / noise.count_rad) - angle
    second, first = np.diff(error, 2) / SAMPLE_S**2, (error[2:] - error[:-2]) / (2 * SAMPLE_S)
    effort = INERTIA * second + VISCOUS * first + 0.001 * rng.standard_normal(len(second))
    bands = np.tile(noise.covariance(np.arange(3))[:, None], len(effort))
    white = solve_banded((2, 0), cholesky_banded(bands, lower=True), effort)
    assert np.var(white) == pytest.approx(1.0, abs=0.04)
    for half in np.split(np.abs(np.fft.rfft(white)[:-1]) ** 2 / len(white), [len(white) // 20]):
        assert np.mean(half) == pytest.approx(1.0, abs=0.15)


def test_a_case_is_within_reach_where_it_counts_and_the_test_tells_it() -> None:
    assert replace(outcome(share=0.02), detectability=(6.1,)).within_reach
    assert not replace(outcome(share=0.02), detectability=(5.9,)).within_reach
    assert not replace(outcome(share=0.009), detectability=(60.0,)).within_reach

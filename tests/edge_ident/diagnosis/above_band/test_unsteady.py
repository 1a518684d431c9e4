"""What lasts above the band and keeps no frequency is found; what a sound motion makes is not."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.content import above_band
from edge_ident.diagnosis.above_band.unsteady import Disturbance
from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import TOLERANCE, Verdict
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.signals.recording import AxisRecord, Recording
from tests.repetitions import a_few

Array = NDArray[np.float64]

PERIOD_S, SAMPLES, FINER = 0.004, 11_000, 8
LAP_S = 11.0
EFFORT_RMS, NOISE = 1.5, 0.02
TURN = 2.0 * np.pi


def wandering(rng: np.random.Generator, lasts_s: float) -> Array:
    """Noise of variance one through a lag (an Ornstein-Uhlenbeck process)."""
    keep = math.exp(-PERIOD_S / lasts_s)
    values = rng.standard_normal(SAMPLES)
    for k in range(1, SAMPLES):
        values[k] = keep * values[k - 1] + math.sqrt(1.0 - keep**2) * values[k]
    return values


def vibration(rng: np.random.Generator) -> Array:
    """0.06 to 0.2 N·m at 2.3 to 4.1 Hz, whose frequency wanders by 5 to 20 %, and its amplitude by
    30 to 80 %."""
    amplitude, frequency_hz = rng.uniform(0.06, 0.2), rng.uniform(2.3, 4.1)
    bends, swells = rng.uniform(0.05, 0.2), rng.uniform(0.3, 0.8)
    bent = np.clip(wandering(rng, rng.uniform(1.0, 4.0)), -2.0, 2.0)
    swollen = np.clip(1.0 + swells * wandering(rng, rng.uniform(1.0, 4.0)) / 1.4, 0.0, 3.0)
    turns = np.cumsum(frequency_hz * (1.0 + bends * bent)) * PERIOD_S
    return np.asarray(amplitude * swollen * np.sin(TURN * turns))


def ringing(rng: np.random.Generator, speed: Array) -> Array:
    """What a chain of 12 to 25 Hz adds after each reversal, as a share of Coulomb friction."""
    after_s = np.arange(0.0, 0.6, PERIOD_S / FINER)
    ring = np.exp(-8.0 * after_s) * np.cos(TURN * rng.uniform(12.0, 25.0) * after_s)
    jumps = np.diff(np.sign(speed), prepend=np.sign(speed[0]))
    return np.convolve(jumps, ring)[: len(speed)]


def recorded(seed: int, *, vibrates: bool = False, rings: bool = False) -> Recording:
    """A heavy axis on four laps of a slow multisine: the comparison ends at 3 to 8 Hz."""
    rng = np.random.default_rng([seed, 8])
    rates = TURN * np.arange(1, int(LAP_S * rng.uniform(0.35, 1.2)) + 1)[:, None] / LAP_S
    time_s = PERIOD_S / FINER * np.arange(SAMPLES * FINER)
    angles = rates * time_s + rng.uniform(0.0, TURN, rates.shape)
    speeds = 2.0 / np.max(np.abs(np.sum(rates**-0.5 * np.cos(angles), axis=0))) * rates**-0.5
    speed = np.sum(speeds * np.cos(angles), axis=0)
    acceleration = np.sum(-speeds * rates * np.sin(angles), axis=0)
    friction = rng.uniform(0.3, 0.8) * np.sign(speed) + rng.uniform(0.2, 0.5) * speed
    effort = rng.uniform(0.4, 0.8) * acceleration / np.std(acceleration) + friction
    effort += 0.05 * ringing(rng, speed) if rings else 0.0
    effort = effort.reshape(SAMPLES, FINER).mean(axis=1)
    effort *= EFFORT_RMS / np.sqrt(np.mean(effort**2))
    count = TURN / round(10 ** rng.uniform(3.0, 3.7))
    shown = np.sum(speeds / rates * np.sin(angles), axis=0)[FINER // 2 :: FINER]
    effort += vibration(rng) if vibrates else 0.0
    effort += NOISE * EFFORT_RMS * rng.standard_normal(SAMPLES)
    axis = AxisRecord(count * np.round(shown / count), effort, "rad", "N*m")
    return Recording(PERIOD_S * np.arange(SAMPLES), {"x": axis}, f"seed {seed}")


def found(recording: Recording) -> tuple[Disturbance, ...]:
    """What is worth naming."""
    every = above_band([recording], "x", prepare_axis([recording], "x")).unsteady
    return tuple(one for one in every if one.share >= TOLERANCE)


@pytest.mark.parametrize("seed", a_few(range(20), range(4)))
def test_a_vibration_that_wanders_is_found_and_a_sound_axis_has_none(seed: int) -> None:
    (one,) = found(recorded(seed, vibrates=True))
    assert 1.5 < one.lowest_hz < one.highest_hz < 7.0
    assert 0.04 < one.amplitude < 0.35
    assert found(recorded(seed)) == ()


@pytest.mark.parametrize("seed", [1, 2])
def test_what_rings_at_reversals_is_of_the_motion(seed: int) -> None:
    assert found(recorded(seed, rings=True)) == ()


def test_a_vibration_that_wanders_forbids_adequate() -> None:
    """What does not repeat with the motion was noise, below the end of the band and above it."""
    assert diagnose([recorded(3)]).axes["x"].verdict is Verdict.ADEQUATE
    axis = diagnose([recorded(3, vibrates=True)]).axes["x"]
    assert axis.verdict is Verdict.UNEXPLAINED
    assert axis.causes == ()

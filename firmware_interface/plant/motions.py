"""Reference motions: the paper's sinusoid, a random-phase multisine, a staircase of speeds.

Each begins `LEAD` samples before the recording does, so that the recording starts in full swing,
and goes on for `TAIL` samples after it.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from firmware_interface.plant.drives import Array

SAMPLE_S = 2.5e-3
LEAD, TAIL = 800, 20
_PAPER_RATE = 0.2875
PAPER_SAMPLES = 8742
_PERIOD_S = 10.0
"""Period of a multisine."""
_ORDERS = np.arange(1, 26)
"""Orders of a multisine: 0.1 to 2.5 Hz."""
_TOP_SPEED_RAD_S = 2.0
_LEVELS = 5
"""Speeds of a staircase."""


@dataclass(frozen=True)
class Motion:
    """Reference of every axis, the same for all drives or one for each.

    Attributes
    ----------
    name : str
    position, velocity, acceleration : (LEAD + N + TAIL, 1 or B, A) arrays
        rad, rad/s, rad/s².
    """

    name: str
    position: Array
    velocity: Array
    acceleration: Array

    @property
    def samples(self) -> int:
        """Length of the recording, N."""
        return len(self.position) - LEAD - TAIL

    @property
    def clock_s(self) -> Array:
        """Time of every reference sample; 0 is where the recording starts."""
        return np.asarray(SAMPLE_S * np.arange(-LEAD, self.samples + TAIL), dtype=np.float64)

    @property
    def recorded(self) -> slice:
        """The part of the reference that is recorded."""
        return slice(LEAD, LEAD + self.samples)


def _clock(samples: int) -> Array:
    return np.asarray(SAMPLE_S * np.arange(-LEAD, samples + TAIL)[:, None, None], dtype=np.float64)


def paper(samples: int = PAPER_SAMPLES, phase_rad: float | Array = 0.0) -> Motion:
    """x = 2π·sin(0.2875 t), z = 2π·cos(0.2875 t): the method paper's trajectory.

    Parameters
    ----------
    samples : int
        A quarter period has 2186.
    phase_rad : float or (B,) array
        Where in the period the recording starts.
    """
    start = np.reshape(phase_rad, (1, -1, 1)) + np.array([0.0, np.pi / 2])
    angle = _PAPER_RATE * _clock(samples) + start
    swing = 2 * np.pi * np.sin(angle)
    speed = 2 * np.pi * _PAPER_RATE * np.cos(angle)
    return Motion("paper", swing, speed, -(_PAPER_RATE**2) * swing)


def multisine(samples: int = 8000, seed: int = 0) -> Motion:
    """Sinusoids of random phase, 0.1 to 2.5 Hz, speeds as 1/√frequency; 2 rad/s at the peak."""
    rng = np.random.default_rng([seed, 2])
    rate = 2 * np.pi * _ORDERS / _PERIOD_S
    phase = rng.uniform(0, 2 * np.pi, (2, len(_ORDERS)))
    wave = np.exp(1j * phase) * _ORDERS**-0.5
    peak = abs(_sums(_over_a_period(), wave)).max(axis=0)
    speed = _TOP_SPEED_RAD_S / peak[:, None] * wave
    parts = np.concatenate([speed / (1j * rate), speed, 1j * rate * speed])
    return Motion("multisine", *np.split(_sums(_waves(samples), parts)[:, None], 3, -1))


def _sums(waves: Array, amplitude: NDArray[np.complex128]) -> Array:
    """Sums (T, A) of cosines and sines (T, 2·K) with complex amplitudes (A, K)."""
    return np.asarray(waves @ np.concatenate([amplitude.real, -amplitude.imag], axis=1).T)


@cache
def _waves(samples: int) -> Array:
    """Cosine and sine of each order of a multisine at each sample."""
    return _harmonics(_clock(samples)[:, 0] / _PERIOD_S)


@cache
def _over_a_period() -> Array:
    return _harmonics(np.linspace(0, 1, 2000)[:, None])


def _harmonics(turns: Array) -> Array:
    angle = 2 * np.pi * turns * _ORDERS
    return np.concatenate([np.cos(angle), np.sin(angle)], axis=1)


def staircase(samples: int = 8000) -> Motion:
    """Constant speeds, to and fro, each faster than the one before; z starts half a step later."""
    hold = samples // (2 * _LEVELS)
    ramp = hold // 2
    speeds = np.repeat(_TOP_SPEED_RAD_S * np.arange(1, _LEVELS + 1) / _LEVELS, 2)
    speeds[1::2] *= -1
    axes = [_stairs(speeds, hold, ramp, samples, late) for late in (0, hold // 2)]
    velocity, acceleration = (np.stack(part, axis=-1)[:, None] for part in zip(*axes, strict=True))
    position = SAMPLE_S * np.cumsum(velocity, axis=0)
    return Motion("staircase", position, velocity, acceleration)


def _stairs(
    speeds: Array, hold: int, ramp: int, samples: int, late: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Speed and acceleration of one axis; raised-cosine ramps between the levels."""
    at = np.arange(-LEAD, samples + TAIL) - late + ramp
    level = np.clip(at // hold, -1, len(speeds) - 1)
    padded = np.append(speeds, [0.0])  # index -1: at rest before the first step
    before = np.where(level >= 0, padded[level - 1], 0.0)
    before[level == 0] = 0.0
    share = np.clip((at - level * hold) / ramp, 0, 1)
    rise = padded[level] - before
    speed = before + rise * (1 - np.cos(np.pi * share)) / 2
    acceleration = rise * np.pi / (2 * ramp * SAMPLE_S) * np.sin(np.pi * share)
    return speed, np.where((share > 0) & (share < 1), acceleration, 0.0)

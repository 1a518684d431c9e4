"""The position loop in the frequency domain: margins, and what encoder quantization does to it.

The board's sampled law acts on a continuous axis, held over a period and late by the delay. The
encoder is on the motor's side. Part of the inertia may hang on springs:

axis(s) = 1 / (s·(M(s)·s + viscous_friction)),
M(s) = inertia - Σ J + Σ J·(2·ζ·ω·s + ω²)/(s² + 2·ζ·ω·s + ω²)

with J, ω and ζ of each `SprungLoad`.
Sources: Franklin, Powell and Workman, Digital Control of Dynamic Systems, ch. 4 (hold and delay);
Ellis, Control System Design Guide, ch. 16 (two-mass drive).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from firmware_interface.board_types import AxisLimits, BoardIdentity
from firmware_interface.gains import GAIN_FIELDS, AxisGains

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_FREQUENCIES: Final = 400
_LOWEST_RAD_S: Final = 1e-2
_HIGHEST: Final = 0.999
"""In Nyquist frequencies."""
_ALIASES: Final = np.arange(-2, 3)
_AROUND_RESONANCE: Final = np.geomspace(0.05, 300.0, 60)
"""Distances from a resonance, in its half widths, at which the loop is looked at."""
_SHARPEST: Final = 1e-3
"""Damping ratio below which a resonance is taken to be this sharp."""


@dataclass(frozen=True)
class LoopHardware:
    """What the board and its encoder do to the loop.

    Attributes
    ----------
    sample_period_s, control_delay_s : float
        The delay is measured by the board, encoder latch to effort.
    encoder_resolution_rad : float
    effort_limit_nm : float
    gain_maximum : AxisGains or None
        Largest value of each number of the law; None where nobody says it.
    map_version : int
        Of the board's register map, which decides what its law has.
    """

    sample_period_s: float
    control_delay_s: float
    encoder_resolution_rad: float
    effort_limit_nm: float
    gain_maximum: AxisGains | None = None
    map_version: int = max(GAIN_FIELDS)

    @property
    def law(self) -> frozenset[str]:
        """Fields of `AxisGains` that the board's law has."""
        return frozenset(GAIN_FIELDS[self.map_version])

    @classmethod
    def of_board(cls, identity: BoardIdentity, limits: AxisLimits) -> "LoopHardware":
        """What a board says of itself and of one axis."""
        return cls(
            identity.sample_period_s,
            identity.control_delay_s,
            identity.encoder_resolution_rad,
            limits.effort_nm,
            limits.gain_maximum,
            identity.map_version,
        )

    @classmethod
    def of_axes(
        cls, identity: BoardIdentity, limits: Mapping[str, AxisLimits]
    ) -> "dict[str, LoopHardware]":
        """The same of every axis, by name."""
        return {axis: cls.of_board(identity, of_axis) for axis, of_axis in limits.items()}


@dataclass(frozen=True)
class SprungLoad:
    """Inertia behind a spring and damper; its resonance with the encoder's side held."""

    inertia: float
    rate_rad_s: float
    damping_ratio: float


@dataclass(frozen=True)
class Plant:
    """An axis as the loop meets it.

    Attributes
    ----------
    inertia : float
        All of it, what hangs on springs included.
    viscous_friction : float
    loads : tuple of SprungLoad
    """

    inertia: float
    viscous_friction: float
    loads: tuple[SprungLoad, ...] = ()

    def with_inertia(self, inertia: float) -> "Plant":
        """Heavier or lighter, all parts alike."""
        share = inertia / self.inertia
        loads = tuple(replace(load, inertia=load.inertia * share) for load in self.loads)
        return Plant(inertia, self.viscous_friction, loads)

    def response(self, s: Complex) -> Complex:
        """Position over effort."""
        felt = np.full_like(s, self.inertia)
        for load in self.loads:
            rate, damping = load.rate_rad_s, 2.0 * load.damping_ratio * load.rate_rad_s * s
            felt += load.inertia * ((damping + rate**2) / (s**2 + damping + rate**2) - 1.0)
        return np.asarray(1.0 / (s * (felt * s + self.viscous_friction)))


def margins_of(gains: AxisGains, plant: Plant, hardware: LoopHardware) -> tuple[float, float]:
    """Phase margin (rad) and gain margin (factor) of a loop.

    The phase margin is the smallest over all frequencies at which the loop's gain passes one; the
    gain margin is that at the loudest frequency at which it lags by more than 180°. A resonance
    is thus kept quiet, not trusted to come back in phase after a full turn.

    Zero phase margin stands for an unstable loop; an infinite gain margin for a phase that
    never reaches -180° below the Nyquist frequency.
    """
    _, loop = open_loop(gains, plant, hardware)
    level, phase = np.log(np.abs(loop)), np.unwrap(np.angle(loop))
    crossing = np.flatnonzero((level[:-1] >= 0.0) != (level[1:] >= 0.0))
    if not len(crossing):
        return 0.0, 0.0
    part = level[crossing] / (level[crossing] - level[crossing + 1])
    at_one = phase[crossing] + part * (phase[crossing + 1] - phase[crossing])
    late = level[1:][phase[1:] <= -np.pi]
    gain_margin = math.exp(-float(np.max(late))) if len(late) else math.inf
    return max(float(np.min(at_one)) + np.pi, 0.0), gain_margin


def open_loop(gains: AxisGains, plant: Plant, hardware: LoopHardware) -> tuple[Array, Complex]:
    """Frequency response of the opened loop.

    Returns
    -------
    omega, response : (N,) arrays
        Frequencies in rad/s, increasing, up to nearly the Nyquist frequency.
    """
    period = hardware.sample_period_s
    omega = _frequencies(plant, math.pi / period)
    # what the sampler sees is the sum over its aliases
    s = 1j * (omega + 2.0 * np.pi / period * _ALIASES[:, None])
    hold = (1.0 - np.exp(-s * period)) / (s * period)
    delay = np.exp(-s * hardware.control_delay_s)
    axis = np.sum(hold * delay * plant.response(s), axis=0)
    return omega, law_response(gains, omega, period) * axis


def quantization_effort_nm(gains: AxisGains, hardware: LoopHardware) -> float:
    """Rms effort from white quantization noise of one twelfth of a count squared."""
    omega = np.linspace(1e-3, np.pi, _FREQUENCIES) / hardware.sample_period_s
    response = np.abs(law_response(gains, omega, hardware.sample_period_s))
    noise = hardware.encoder_resolution_rad / math.sqrt(12.0)
    return float(noise * np.sqrt(np.mean(response**2)))


def _frequencies(plant: Plant, nyquist_rad_s: float) -> Array:
    """A grid that misses no resonance; those above the Nyquist frequency show at their aliases."""
    parts = [np.geomspace(_LOWEST_RAD_S, _HIGHEST * nyquist_rad_s, _FREQUENCIES)]
    for load in plant.loads:
        width = max(load.damping_ratio, _SHARPEST)
        steps = width * np.concatenate([-_AROUND_RESONANCE, [0.0], _AROUND_RESONANCE])
        both_free = load.rate_rad_s / math.sqrt(1.0 - load.inertia / plant.inertia)
        for rate in (load.rate_rad_s, both_free):
            near = rate * (1.0 + steps[np.abs(steps) < 0.5])
            parts.append(np.abs((near + nyquist_rad_s) % (2.0 * nyquist_rad_s) - nyquist_rad_s))
    grid = np.unique(np.concatenate(parts))
    return grid[(grid >= _LOWEST_RAD_S) & (grid <= _HIGHEST * nyquist_rad_s)]


def law_response(gains: AxisGains, omega: Array, period: float) -> Complex:
    """Frequency response of the board's law from position error to effort."""
    back = np.exp(-1j * omega * period)
    smoothing = period / (gains.velocity_filter_s + period)
    filtered = smoothing / (1.0 - (1.0 - smoothing) * back)
    return np.asarray(
        gains.proportional
        + gains.derivative * (1.0 - back) / period * filtered
        + gains.integral * period / (1.0 - back)
    )

"""The position loop in the frequency domain: margins, and what encoder quantization does to it.

The board's sampled law acts on a continuous axis (`edge_ident.control.position_loop`), held over a
period and late by the delay.
Source: Franklin, Powell and Workman, Digital Control of Dynamic Systems, ch. 4 (hold and delay).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import GainError
from edge_ident.model.model import BOARD_UNITS
from edge_ident.support.words import listed
from firmware_interface.board_types import AxisLimits, BoardIdentity
from firmware_interface.gains import GAIN_FIELDS, AxisGains

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_FREQUENCIES: Final = 400
_LOWEST_RAD_S: Final = 1e-2
_HIGHEST: Final = 0.999  # highest frequency of the grid, in Nyquist frequencies
_ALIASES: Final = np.arange(-2, 3)
# Distances from a resonance, in its half widths, at which the loop is looked at.
_AROUND_RESONANCE: Final = np.geomspace(0.05, 300.0, 60)
# One sample's delay up to the Nyquist frequency, at even distances.
_ROUND: Final = np.exp(-1j * np.linspace(1e-3, np.pi, _FREQUENCIES))
# Axes and boards whose responses are kept: a design asks for the same ones at each bandwidth, and a
# forecast again.
_KEPT: Final = 16


# An axis as the position loop meets it: inertia, friction, and what is soft.
#
# Where the encoder is on the motor's side, part of the inertia may hang on springs:
#
# axis(s) = 1 / (s·(M(s)·s + viscous_friction)),
# M(s) = inertia - Σ J + Σ J·(2·ζ·ω·s + ω²)/(s² + 2·ζ·ω·s + ω²)
#
# with J, ω and ζ of each `SprungLoad`. Where it is on the load, the effort passes a `SeriesSpring`
# first: a factor of ω²/(s² + 2·ζ·ω·s + ω²).
# Source: Ellis, Control System Design Guide, ch. 16 (two-mass drive).

_SHARPEST: Final = 1e-3  # damping ratio below which a resonance is taken to be this sharp


@dataclass(frozen=True)
class SprungLoad:
    """Inertia behind a spring and damper; its resonance with the encoder's side fixed."""

    inertia: float
    rate_rad_s: float
    damping_ratio: float


@dataclass(frozen=True)
class SeriesSpring:
    """Spring and damper between motor and encoder; their resonance with both sides free."""

    rate_rad_s: float
    damping_ratio: float

    def response(self, s: Complex) -> Complex:
        """What passes the spring of what the motor gives."""
        damping = 2.0 * self.damping_ratio * self.rate_rad_s * s
        return np.asarray(self.rate_rad_s**2 / (s**2 + damping + self.rate_rad_s**2))


@dataclass(frozen=True)
class Plant:
    """An axis as the loop meets it.

    Attributes
    ----------
    inertia : float
        All of it, what hangs on springs included.
    viscous_friction : float
    loads : tuple of SprungLoad
    springs : tuple of SeriesSpring
    """

    inertia: float
    viscous_friction: float
    loads: tuple[SprungLoad, ...] = ()
    springs: tuple[SeriesSpring, ...] = ()

    def with_inertia(self, inertia: float) -> "Plant":
        """Heavier or lighter, all parts alike."""
        share = inertia / self.inertia
        loads = tuple(replace(load, inertia=load.inertia * share) for load in self.loads)
        return Plant(inertia, self.viscous_friction, loads, self.springs)

    @property
    def resonances(self) -> tuple[tuple[float, float], ...]:
        """Where the response turns quickly: frequency in rad/s, and width as a share of it.

        Heavier or lighter, they are the same.
        """
        found = [(x.rate_rad_s, max(x.damping_ratio, _SHARPEST)) for x in self.springs]
        for load in self.loads:
            width = max(load.damping_ratio, _SHARPEST)
            both_free = load.rate_rad_s / math.sqrt(1.0 - load.inertia / self.inertia)
            found += [(load.rate_rad_s, width), (both_free, width)]
        return tuple(found)

    def response(self, s: Complex) -> Complex:
        """Position over effort."""
        felt = np.full_like(s, self.inertia)
        for load in self.loads:
            rate, damping = load.rate_rad_s, 2.0 * load.damping_ratio * load.rate_rad_s * s
            felt += load.inertia * ((damping + rate**2) / (s**2 + damping + rate**2) - 1.0)
        response = np.asarray(1.0 / (s * (felt * s + self.viscous_friction)))
        for spring in self.springs:
            response *= spring.response(s)
        return response


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
        """The loop hardware of every axis, by name."""
        return {axis: cls.of_board(identity, of_axis) for axis, of_axis in limits.items()}


def margins_of(
    gains: AxisGains, plants: tuple[Plant, ...], hardware: LoopHardware
) -> tuple[float, float]:
    """Smallest phase margin (rad) and gain margin (factor) of a loop around any of the plants.

    The phase margin is the smallest over all frequencies at which the loop's gain passes one; the
    gain margin is that at the loudest frequency at which it lags by more than 180°. A resonance
    is thus kept quiet, not trusted to come back in phase after a full turn.

    Zero phase margin stands for an unstable loop; an infinite gain margin for a phase that
    never reaches -180° below the Nyquist frequency.

    Parameters
    ----------
    gains : AxisGains
    plants : tuple of Plant
        One axis, heavier or lighter (`Plant.with_inertia`).
    hardware : LoopHardware
    """
    seen = _sampled(plants, hardware.sample_period_s, hardware.control_delay_s)
    law = _law(gains, seen.sampler.back, hardware.sample_period_s)
    level = seen.level + np.log(np.abs(law))
    # neither the law's phase nor that of the axis jumps; the sum begins within half a turn
    phase = seen.phase + np.angle(law)
    phase -= 2.0 * np.pi * np.round(phase[:, :1] / (2.0 * np.pi))
    passes, at_one = _where_zero(level, phase)
    if not np.all(np.any(passes, axis=1)):
        return 0.0, 0.0
    beyond = -np.pi - phase
    _, at_turn = _where_zero(beyond, level)
    late = np.concatenate([level[:, 1:][beyond[:, 1:] >= 0.0], at_turn])
    gain_margin = math.exp(-float(np.max(late))) if len(late) else math.inf
    return max(float(np.min(at_one)) + np.pi, 0.0), gain_margin


def _where_zero(of: Array, asked: Array) -> tuple[NDArray[np.bool_], Array]:
    """Between which frequencies each row passes zero, and what is asked for there."""
    above = of >= 0.0
    passes = above[:, :-1] != above[:, 1:]
    axis, at = np.nonzero(passes)
    part = of[axis, at] / (of[axis, at] - of[axis, at + 1])
    return passes, asked[axis, at] + part * (asked[axis, at + 1] - asked[axis, at])


def check_units(units: tuple[str, str]) -> None:
    """Check that gains can be designed from positions and efforts in these units.

    Raises
    ------
    GainError
        They are not the board's.
    """
    if units != BOARD_UNITS:
        raise GainError(
            f"the axis is in {listed(units)}, and gains of a board are in rad and N*m of its motor",
            "give what a unit of each column is at the motor: with a lead of 40 mm, --column "
            "x_position_m=x_position_rad --unit 'x_position_m=25 turn' --column "
            "x_force_n=x_torque_nm --unit 'x_force_n=0.0063662 Nm'; a current is a torque with "
            "--torque-constant",
        )


def open_loop(gains: AxisGains, plant: Plant, hardware: LoopHardware) -> tuple[Array, Complex]:
    """Frequency response of the opened loop.

    Returns
    -------
    omega, response : (N,) arrays
        Frequencies in rad/s, increasing, up to nearly the Nyquist frequency.
    """
    period = hardware.sample_period_s
    seen = _sampled((plant,), period, hardware.control_delay_s)
    return seen.sampler.omega, _law(gains, seen.sampler.back, period) * seen.response[0]


def quantization_effort_nm(gains: AxisGains, hardware: LoopHardware) -> float:
    """Rms effort from white quantization noise of one twelfth of a count squared."""
    response = _law(gains, _ROUND, hardware.sample_period_s)
    noise = hardware.encoder_resolution_rad / math.sqrt(12.0)
    return noise * math.sqrt(float(np.vdot(response, response).real) / len(response))


def law_response(gains: AxisGains, omega: Array, period: float) -> Complex:
    """Frequency response of the board's law from position error to effort."""
    return _law(gains, np.exp(-1j * omega * period), period)


def _law(gains: AxisGains, back: Complex, period: float) -> Complex:
    """The same where `back`, the response of one sample's delay, is known."""
    smoothing = period / (gains.velocity_filter_s + period)
    filtered = smoothing / (1.0 - (1.0 - smoothing) * back)
    return np.asarray(
        gains.proportional
        + gains.derivative * (1.0 - back) / period * filtered
        + gains.integral * period / (1.0 - back)
    )


@dataclass(frozen=True)
class _Sampler:
    """All of a loop's response that is neither law nor axis, at (N,) frequencies.

    Attributes
    ----------
    omega : (N,) array
        rad/s, increasing.
    back : (N,) complex array
        One sample's delay.
    s, held : (5, N) complex arrays
        The aliases of each frequency, and what hold and delay make of them.
    """

    omega: Array
    back: Complex
    s: Complex
    held: Complex


@dataclass(frozen=True)
class _Sampled:
    """Axes as the board meets them: (P, N) responses, logarithms of their size, and phases."""

    sampler: _Sampler
    response: Complex
    level: Array
    phase: Array


@lru_cache(maxsize=_KEPT)
def _sampled(plants: tuple[Plant, ...], period_s: float, delay_s: float) -> _Sampled:
    """What the sampler sees of each axis: the sum over its aliases."""
    sampler = _sampler(plants[0].resonances, period_s, delay_s)
    response = np.stack(
        [np.sum(sampler.held * plant.response(sampler.s), axis=0) for plant in plants]
    )
    return _Sampled(
        sampler, response, np.log(np.abs(response)), np.unwrap(np.angle(response), axis=1)
    )


@lru_cache(maxsize=_KEPT)
def _sampler(
    resonances: tuple[tuple[float, float], ...], period_s: float, delay_s: float
) -> _Sampler:
    """Sampling and hold of a board, the same for all axes without resonances."""
    omega = _frequencies(resonances, math.pi / period_s)
    omega.flags.writeable = False  # kept, and given away
    s = 1j * (omega + 2.0 * np.pi / period_s * _ALIASES[:, None])
    hold = (1.0 - np.exp(-s * period_s)) / (s * period_s)
    return _Sampler(omega, np.exp(-1j * omega * period_s), s, hold * np.exp(-s * delay_s))


def _frequencies(resonances: tuple[tuple[float, float], ...], nyquist_rad_s: float) -> Array:
    """A grid that misses no resonance; those above the Nyquist frequency show at their aliases."""
    parts = [np.geomspace(_LOWEST_RAD_S, _HIGHEST * nyquist_rad_s, _FREQUENCIES)]
    for rate, width in resonances:
        steps = width * np.concatenate([-_AROUND_RESONANCE, [0.0], _AROUND_RESONANCE])
        near = rate * (1.0 + steps[np.abs(steps) < 0.5])
        parts.append(np.abs((near + nyquist_rad_s) % (2.0 * nyquist_rad_s) - nyquist_rad_s))
    grid = np.sort(np.concatenate(parts))
    once = np.diff(grid, prepend=0.0) > 0.0  # numpy.unique would load numpy.ma
    return grid[once & (grid >= _LOWEST_RAD_S) & (grid <= _HIGHEST * nyquist_rad_s)]

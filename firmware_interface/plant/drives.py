"""Random feed drives: a flexible chain of three masses per axis, and its position controller."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


COUNT_RAD = 2 * np.pi / 8400
# What a drive's load may have to bear; the springs are chosen for it.
_DESIGN_SPEED, _DESIGN_ACCELERATION = 2.0, 6.0


@dataclass(frozen=True)
class Chain:
    """Masses on a line, joined by spring and damper; all angles at the gearbox output.

    Mass 0 is the motor with its gearbox (where the encoder sits), 1 the screw, 2 the table.

    Attributes
    ----------
    inertia, viscous, coulomb : (3, B, A) arrays
        kg·m², N·m·s/rad and N·m against the ground, for B drives of A axes.
    stiffness, damping_ratio : (2, B, A) arrays
        N·m/rad, and the damping of each joint as if its two sides were free.
    offset : (B, A) array
        Constant load of the table, N·m.
    play_rad : (B, A) array
        Free travel between motor and screw.
    bristle_reach_rad : (B, A) array
        Mean travel after which the table's Coulomb friction has built up; 0: at once.
    loss_s_per_rad : (B, A) array
        Torque that the first joint bears more for every rad/s with which it is wound up, over that
        of its spring: a damper that grows with the load. Source: Hunt and Crossley, J. Applied
        Mechanics 42 (1975) 440.
    """

    inertia: Array
    viscous: Array
    coulomb: Array
    stiffness: Array
    damping_ratio: Array
    offset: Array
    play_rad: Array
    bristle_reach_rad: Array
    loss_s_per_rad: Array

    @property
    def damping(self) -> Array:
        """Dampers of the joints, (2, B, A), N·m·s/rad."""
        pair = 1 / (1 / self.inertia[:-1] + 1 / self.inertia[1:])
        return 2 * self.damping_ratio * np.sqrt(self.stiffness * pair)

    @property
    def rigid_body(self) -> Array:
        """Inertia, viscous friction, Coulomb friction, offset of the locked chain, (B, A, 4)."""
        sums = [self.inertia.sum(0), self.viscous.sum(0), self.coulomb.sum(0), self.offset]
        return np.stack(sums, axis=-1)


@dataclass(frozen=True)
class Control:
    """Position controller: PD on encoder angles with a velocity filter, plus feed-forward.

    Attributes
    ----------
    position_gain, velocity_gain : (B, A) arrays
        N·m/rad and N·m·s/rad.
    filter_s : (B, A) array
        Time constant of the velocity's first-order filter.
    feedforward : (B, A, 4) array
        Rigid-body parameters that the controller believes; zeros: feedback alone.
    """

    position_gain: Array
    velocity_gain: Array
    filter_s: Array
    feedforward: Array


@dataclass(frozen=True)
class Drives:
    """B drives, each with its chain and its controller."""

    chain: Chain
    control: Control

    @property
    def shape(self) -> tuple[int, int]:
        """Number of drives and axes."""
        drives, axes = self.chain.offset.shape
        return drives, axes


def log_uniform(rng: np.random.Generator, low: float, high: float, shape: tuple[int, ...]) -> Array:
    """Random values whose logarithm is even between two bounds."""
    return np.exp(rng.uniform(np.log(low), np.log(high), shape))


def draw_drives(count: int, seed: int, axes: int = 2) -> Drives:
    """Feed drives of the paper's kind with random parameters, sound in every respect.

    The whole chain winds up by less than one encoder count under the load that it is made for.
    """
    rng = np.random.default_rng([seed, 1])
    shape = (count, axes)
    inertia = log_uniform(rng, 0.2, 0.8, shape) * _shares(rng, (0.40, 0.75), (0.08, 0.15), shape)
    viscous = log_uniform(rng, 0.3, 2.0, shape) * _shares(rng, (0.2, 0.6), (0.05, 0.1), shape)
    coulomb = log_uniform(rng, 0.3, 3.0, shape) * _shares(rng, (0.1, 0.5), (0.0, 0.0), shape)
    offset = rng.uniform(-0.4, 0.4, shape)
    load = (
        inertia[1:].sum(0) * _DESIGN_ACCELERATION
        + viscous[1:].sum(0) * _DESIGN_SPEED
        + coulomb[1:].sum(0)
        + abs(offset)
    )
    windup = COUNT_RAD * rng.uniform(0.2, 0.45, (2, *shape))
    chain = Chain(
        inertia=inertia,
        viscous=viscous,
        coulomb=coulomb,
        stiffness=load / windup,
        damping_ratio=rng.uniform(0.03, 0.15, (2, *shape)),
        offset=offset,
        play_rad=np.zeros(shape),
        bristle_reach_rad=np.zeros(shape),
        loss_s_per_rad=np.zeros(shape),
    )
    return Drives(chain, _draw_control(rng, chain))


def _shares(
    rng: np.random.Generator,
    motor: tuple[float, float],
    screw: tuple[float, float],
    shape: tuple[int, int],
) -> Array:
    """Shares of the three masses in a whole, (3, B, A)."""
    first, second = rng.uniform(*motor, shape), rng.uniform(*screw, shape)
    return np.stack([first, second, 1 - first - second])


def _draw_control(rng: np.random.Generator, chain: Chain) -> Control:
    shape = chain.offset.shape
    rigid = chain.rigid_body
    bandwidth = log_uniform(rng, 6.0, 16.0, shape)
    damping = rng.uniform(0.7, 1.0, shape)
    velocity_gain = rigid[..., 0] * bandwidth * 2 * damping - rigid[..., 1]
    believes = rng.random((shape[0], 1, 1)) < 0.5
    return Control(
        position_gain=rigid[..., 0] * bandwidth**2,
        velocity_gain=np.maximum(velocity_gain, 0.5 * rigid[..., 0] * bandwidth),
        filter_s=rng.uniform(5e-3, 10e-3, shape),
        feedforward=believes * rigid * rng.normal(1.0, 0.1, rigid.shape),
    )


# Reference motions: the paper's sinusoid, a random-phase multisine, a staircase of speeds.
#
# Each begins `LEAD` samples before the recording does, so that the recording starts in full swing,
# and goes on for `TAIL` samples after it.

SAMPLE_S = 2.5e-3
LEAD, TAIL = 800, 20
_PAPER_RATE = 0.2875
PAPER_SAMPLES = 8742
_PERIOD_S = 10.0  # period of a multisine
_ORDERS = np.arange(1, 26)  # orders of a multisine: 0.1 to 2.5 Hz
_TOP_SPEED_RAD_S = 2.0
_LEVELS = 5  # speeds of a staircase


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


# Elementary functions of one number or of an array.
#
# A formula that is made of them holds for one axis, in plain numbers, and for a batch of drives:
# numpy takes a microsecond for a single number, `math` a tenth of it.

Value: TypeAlias = Any
"""A float of one axis, or an array over drives and axes."""


def exp(value: Value) -> Value:
    """Exponential."""
    return math.exp(value) if isinstance(value, float) else np.exp(value)


def expm1(value: Value) -> Value:
    """Exponential less one."""
    return math.expm1(value) if isinstance(value, float) else np.expm1(value)


def tanh(value: Value) -> Value:
    """Hyperbolic tangent."""
    return math.tanh(value) if isinstance(value, float) else np.tanh(value)


def asinh(value: Value) -> Value:
    """Inverse hyperbolic sine."""
    return math.asinh(value) if isinstance(value, float) else np.arcsinh(value)


def sin(value: Value) -> Value:
    """Sine of an angle in rad."""
    return math.sin(value) if isinstance(value, float) else np.sin(value)


def sign(value: Value) -> Value:
    """-1, 0 or 1."""
    if isinstance(value, float):
        return math.copysign(1.0, value) if value else 0.0
    return np.sign(value)


def clip(value: Value, limit: Value) -> Value:
    """Nearest value from -limit to limit."""
    if isinstance(value, float):
        return min(max(value, -limit), limit)
    return np.minimum(np.maximum(value, -limit), limit)

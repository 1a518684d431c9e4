"""Random feed drives: a flexible chain of three masses per axis, and its position controller."""

from dataclasses import dataclass

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
    """

    inertia: Array
    viscous: Array
    coulomb: Array
    stiffness: Array
    damping_ratio: Array
    offset: Array
    play_rad: Array
    bristle_reach_rad: Array

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

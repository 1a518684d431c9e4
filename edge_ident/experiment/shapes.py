"""Motions to choose from: shapes that are drawn, changed a little, and scaled to the limits."""

import math
from dataclasses import dataclass, replace
from typing import Final, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from firmware_interface.motion import (
    MAXIMUM_COMPONENTS,
    MAXIMUM_LEVELS,
    Multisine,
    SineComponent,
    Staircase,
)

Array = NDArray[np.float64]

_STEEPEST: Final = 2.0
"""Exponent by which amplitudes of position fall with the frequency: then accelerations are equal.
"""
_FULL: Final = 0.6
"""Share of the drawn motions that use the limits; the others are smaller by up to a decade."""
_LEAST_SHARE: Final = 0.1
_SWAPPED: Final = 0.15
"""Share of the lines that a change moves to another frequency."""
_SLOWEST: Final = 0.01
"""Slowest level of a staircase, of the fastest."""


class Shape(Protocol):
    """A motion but for its size.

    Attributes
    ----------
    share : float
        Of the size that the limits allow.
    """

    @property
    def share(self) -> float: ...

    def motion(self, size: float) -> Multisine | Staircase:
        """The motion of a size."""
        ...

    def changed(self, rng: np.random.Generator, step: float) -> Self:
        """A similar shape."""
        ...


@dataclass(frozen=True)
class SineShape:
    """A multisine of whole periods in the recording.

    Attributes
    ----------
    orders : (K,) array of int
        Periods in the recording, all different.
    amplitudes, phases : (K,) arrays
    rate_rad_s : float
        Of one period in the recording.
    highest : int
        Largest order.
    share : float
    """

    orders: NDArray[np.intp]
    amplitudes: Array
    phases: Array
    rate_rad_s: float
    highest: int
    share: float = 1.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, rate_rad_s: float, highest: int) -> "SineShape":
        """Random lines, denser at low frequencies, with amplitudes along a power law."""
        wanted = min(MAXIMUM_COMPONENTS, highest)
        weights = 1.0 / np.arange(1, highest + 1)
        orders = rng.choice(highest, wanted, replace=False, p=weights / np.sum(weights)) + 1
        slope = rng.uniform(0.0, _STEEPEST)
        amplitudes = np.exp(rng.normal(0.0, 0.3, wanted) - slope * np.log(orders))
        phases = rng.uniform(-math.pi, math.pi, wanted)
        share = 1.0 if rng.random() < _FULL else float(_LEAST_SHARE ** rng.random())
        return cls(orders, amplitudes, phases, rate_rad_s, highest, share)

    @classmethod
    def of(cls, motion: Multisine, rate_rad_s: float, highest: int) -> "SineShape":
        """The shape of a multisine, its lines moved to whole periods."""
        parts: dict[int, tuple[float, float]] = {}
        for sine in motion.components:
            order = max(1, min(round(sine.angular_frequency_rad_s / rate_rad_s), highest))
            parts.setdefault(order, (sine.amplitude_rad, sine.phase_rad))
        amplitudes, phases = np.array(list(parts.values())).T
        return cls(np.array(list(parts)), amplitudes, phases, rate_rad_s, highest)

    def motion(self, size: float) -> Multisine:
        """The motion whose largest amplitude is `size`."""
        scaled = size / float(np.max(self.amplitudes)) * self.amplitudes
        return Multisine(
            tuple(
                SineComponent(float(a), float(k * self.rate_rad_s), math.remainder(p, math.tau))
                for a, k, p in zip(scaled, self.orders, self.phases, strict=True)
            )
        )

    def changed(self, rng: np.random.Generator, step: float) -> "SineShape":
        """Other amplitudes and phases, now and then another line."""
        count = len(self.orders)
        orders = self.orders.copy()
        for k in np.flatnonzero(rng.random(count) < _SWAPPED):
            free = np.setdiff1d(np.arange(1, self.highest + 1), orders)
            if len(free):
                orders[k] = rng.choice(free)
        share = min(1.0, self.share * math.exp(rng.normal(0.0, 0.5 * step)))
        return replace(
            self,
            orders=orders,
            amplitudes=self.amplitudes * np.exp(rng.normal(0.0, step, count)),
            phases=self.phases + rng.normal(0.0, 2.0 * step, count),
            share=share,
        )


@dataclass(frozen=True)
class StairShape:
    """A staircase: each level forth and back for the same time.

    Attributes
    ----------
    levels : (K,) array
        Speeds; the largest is one.
    dwell_s : float
    ramp_s : float
        In which the fastest level is reached from rest.
    share : float
    """

    levels: Array
    dwell_s: float
    ramp_s: float
    share: float = 1.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, duration_s: float) -> "StairShape":
        """Levels over a random range of speeds, and ramps of a random part of the time."""
        count = int(rng.integers(2, MAXIMUM_LEVELS // 2 + 1))
        lowest = float(_SLOWEST ** rng.random())
        levels = np.geomspace(lowest, 1.0, count)
        return cls._filling(duration_s, levels, 0.5 * rng.uniform(0.05, 0.6))

    @classmethod
    def usual(cls, duration_s: float) -> "StairShape":
        """Five levels, from a tenth to the fastest."""
        return cls._filling(duration_s, np.geomspace(0.1, 1.0, 5), 0.1)

    @classmethod
    def _filling(cls, duration_s: float, levels: Array, ramp: float) -> "StairShape":
        """Levels that fill a recording; the longest ramp takes a share of a level's time."""
        slot_s = duration_s / (2 * len(levels))
        ramp_s = ramp * slot_s
        return cls(levels, slot_s - 2.0 * ramp_s * float(np.mean(levels)), ramp_s)

    def motion(self, size: float) -> Staircase:
        """The motion whose fastest level is `size`."""
        speeds = tuple(float(sign * size * level) for level in self.levels for sign in (1, -1))
        return Staircase(speeds, self.dwell_s, size / self.ramp_s)

    def changed(self, rng: np.random.Generator, step: float) -> "StairShape":
        """Other levels; the longest time on a level that the recording has."""
        levels = self.levels * np.exp(rng.normal(0.0, step, len(self.levels)))
        return replace(self, levels=np.sort(levels) / float(np.max(levels)))


def scaled(motion: Multisine | Staircase, share: float) -> Multisine | Staircase:
    """A motion with all positions, speeds and accelerations scaled."""
    if isinstance(motion, Multisine):
        return Multisine(
            tuple(replace(c, amplitude_rad=share * c.amplitude_rad) for c in motion.components)
        )
    return replace(
        motion,
        speeds_rad_s=tuple(share * speed for speed in motion.speeds_rad_s),
        acceleration_rad_s2=share * motion.acceleration_rad_s2,
    )

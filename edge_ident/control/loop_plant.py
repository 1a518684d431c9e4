"""An axis as the position loop meets it: inertia, friction, and what is soft.

Where the encoder is on the motor's side, part of the inertia may hang on springs:

axis(s) = 1 / (s·(M(s)·s + viscous_friction)),
M(s) = inertia - Σ J + Σ J·(2·ζ·ω·s + ω²)/(s² + 2·ζ·ω·s + ω²)

with J, ω and ζ of each `SprungLoad`. Where it is on the load, the effort passes a `SeriesSpring`
first: a factor of ω²/(s² + 2·ζ·ω·s + ω²).
Source: Ellis, Control System Design Guide, ch. 16 (two-mass drive).
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]

_SHARPEST: Final = 1e-3
"""Damping ratio below which a resonance is taken to be this sharp."""


@dataclass(frozen=True)
class SprungLoad:
    """Inertia behind a spring and damper; its resonance with the encoder's side held."""

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

"""The motion of an axis as effects and estimators read it, its waves, and its timing."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import reduce
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Values = Mapping[str, Array]
"""Values of an effect's parameters by name, each of the shape of the drives."""


# The motion of an axis, as effects and estimators read it.

_NOTHING: Final = np.zeros(())


@dataclass(frozen=True)
class Motion:
    """The motion of an axis, along time or at one instant.

    Attributes
    ----------
    time_s, position, velocity, acceleration : arrays
        (N,) along a motion, evenly sampled; (D,) at one instant of D drives. Time zero is the
        first captured sample. At an instant, only `rates` may ask for the acceleration.
    direction : array
        -1, 0 or 1: where the axis slides to; 0 while it sticks.
    transmitted : array
        Effort that passes through the transmission to inertia, constant load and load along the
        stroke.
    inertia_effort, friction_effort : arrays
        Effort that inertia takes, and effort that viscous and Coulomb friction take. At an instant,
        the first includes load-dependent friction.
    memory : (M, ...) array
        States of the effect whose hook is called, at an instant.
    driven : array
        Effort that the actuator gives, at an instant.
    source : Motion or None
        The axis that acts on this one, for effects that need or take one.
    clock : int
        Of the times. Those of recordings on different clocks have nothing to do with each other.
    """

    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array
    direction: Array
    transmitted: Array = field(default_factory=lambda: _NOTHING)
    inertia_effort: Array = field(default_factory=lambda: _NOTHING)
    friction_effort: Array = field(default_factory=lambda: _NOTHING)
    memory: Array = field(default_factory=lambda: _NOTHING)
    driven: Array = field(default_factory=lambda: _NOTHING)
    source: "Motion | None" = None
    clock: int = 0

    @classmethod
    def known(
        cls, time_s: Array, position: Array, velocity: Array, acceleration: Array, *, clock: int = 0
    ) -> "Motion":
        """A measured motion: the axis slides wherever it moves."""
        return cls(time_s, position, velocity, acceleration, np.sign(velocity), clock=clock)

    @property
    def partner(self) -> "Motion":
        """The axis that acts on this one; the model makes sure that there is one."""
        assert self.source is not None
        return self.source


# Sinusoids of position or time, powers, and what acts at one place.

TURNS_RAD: Final = (2.0 * np.pi, np.pi)
"""Periods of what repeats once or twice per turn."""


def wave(angle: Array, cosine: Array, sine: Array) -> Array:
    """cosine·cos(angle) + sine·sin(angle). One without amplitude costs nothing."""
    if not (sine.any() or cosine.any()):
        return np.zeros(())
    half = np.tan(0.5 * angle)
    below = half * half
    below += 1.0
    # in place: new memory takes longer than what is computed there
    found = np.asarray(2.0 * cosine + 2.0 * sine * half)
    found /= below
    found -= cosine
    return found


def cosine_and_sine(angle: Array) -> tuple[Array, Array]:
    """Both, from the tangent of half the angle: numpy computes that several times as fast as either
    where the processor has wide vectors, and as fast as both where it has not."""
    half = np.tan(0.5 * angle)
    share = half * half
    share += 1.0
    share = 2.0 / share
    half *= share
    share -= 1.0
    return share, half


def bump(position: Array, size: Array, place: Array, width: Array) -> Array:
    """size·exp(-((position - place)/width)²)."""
    if not size.any():
        return np.zeros(())
    return np.asarray(size * np.exp(-np.square((position - place) / width)))


def polynomial(x: Array, *coefficients: Array) -> Array:
    """Powers of x from the first on. One without coefficients costs nothing."""
    if not any(one.any() for one in coefficients):
        return np.zeros(())
    *lower, found = coefficients
    for one in reversed(lower):
        found = one + found * x
    return found * x


def added(*parts: Array) -> Array:
    """Their sum. What is no more than a zero takes no pass over all samples."""
    found = [part for part in parts if part.ndim or part]
    return reduce(np.add, found) if found else np.zeros(())


# The shift that a digital controller brings into a record; part of every model.

LARGEST_SHIFT: Final = 1.5
"""Largest shift of a controller's timing, in sampling periods: one for its calculation, half a one
because its command is held."""
EVEN_SHIFT: Final = LARGEST_SHIFT / math.sqrt(3.0)
"""Standard deviation of a shift of which only its limits are known, in sampling periods."""
# Deviation, of that, from which a recording says hardly anything of the shift.
_UNKNOWN: Final = 0.9


@dataclass(frozen=True)
class Timing:
    """Shift between effort and position, part of the base model.

    Attributes
    ----------
    shift_s : float
        By which the effort is recorded late, beyond what the recording states.
    shift_samples, std_samples : float
        The same in sampling periods, and its standard deviation.
    """

    shift_s: float = 0.0
    shift_samples: float = 0.0
    std_samples: float = 0.0

    @property
    def unknown(self) -> bool:
        """Whether the recording says hardly more of the shift than its limits."""
        return self.std_samples > _UNKNOWN * EVEN_SHIFT


NO_SHIFT: Final = Timing()

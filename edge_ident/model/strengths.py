"""Random strengths of effects, in proportion to the axis that they act on."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scale:
    """What is large and small for drives on a motion; arrays of the shape of the drives.

    Attributes
    ----------
    inertia, viscous_friction, coulomb_friction : arrays
        Of the base model.
    effort, peak_effort : arrays
        Rms and peak of the base model's.
    speed, acceleration : arrays
        Peak speed and rms acceleration.
    travel : array
        From the lowest to the highest position.
    duration_s, period_s : arrays
        Of the record and between its samples.
    """

    inertia: Array
    viscous_friction: Array
    coulomb_friction: Array
    effort: Array
    peak_effort: Array
    speed: Array
    acceleration: Array
    travel: Array
    duration_s: Array
    period_s: Array


def scale_of(
    parameters: Array, time_s: Array, position: Array, velocity: Array, acceleration: Array
) -> Scale:
    """Scales of drives that all make one motion.

    Parameters
    ----------
    parameters : (..., 4) array
        Of the base model; the leading shape is that of the drives.
    time_s, position, velocity, acceleration : (N,) arrays

    Returns
    -------
    Scale
        With arrays of the shape of the drives.
    """
    inertia, viscous, coulomb, offset = (parameters[..., i] for i in range(4))
    smooth = inertia[..., None] * acceleration + viscous[..., None] * velocity + offset[..., None]
    effort = smooth + coulomb[..., None] * np.sign(velocity)

    def rms(signal: Array) -> Array:
        return np.asarray(np.sqrt(np.mean(signal**2, axis=-1)))

    def everywhere(value: float | Array) -> Array:
        return np.full(inertia.shape, value)

    return Scale(
        inertia=inertia,
        viscous_friction=viscous,
        coulomb_friction=coulomb,
        effort=rms(effort),
        peak_effort=np.max(np.abs(effort), axis=-1),
        speed=everywhere(np.max(np.abs(velocity))),
        acceleration=everywhere(rms(acceleration)),
        travel=everywhere(np.ptp(position)),
        duration_s=everywhere(time_s[-1] - time_s[0]),
        period_s=everywhere((time_s[-1] - time_s[0]) / (len(time_s) - 1)),
    )


@dataclass(frozen=True)
class Draws:
    """Random numbers of the shape of the drives."""

    rng: "np.random.Generator"  # a string: numpy.random loads when it is used
    shape: tuple[int, ...]

    def uniform(self, low: float, high: float) -> Array:
        """Evenly between two bounds."""
        return self.rng.uniform(low, high, self.shape)

    def log_uniform(self, low: float, high: float) -> Array:
        """Every decade between two positive bounds equally likely."""
        return np.exp(self.rng.uniform(np.log(low), np.log(high), self.shape))

    def sign(self) -> Array:
        """Plus or minus one."""
        return self.rng.choice(np.array([-1.0, 1.0]), self.shape)

    def strength(self) -> Array:
        """Share of the effort's rms that an effect is to have: 2 % to 30 %."""
        return self.log_uniform(0.02, 0.3)

    def phase(self) -> tuple[Array, Array]:
        """Cosine and sine of a random angle."""
        angle = self.uniform(0.0, 2.0 * np.pi)
        return np.cos(angle), np.sin(angle)


Draw = Callable[[Draws, Scale], dict[str, Array]]
"""Random values of an effect's parameters for every drive of a scale; of those that it leaves out,
the defaults count."""


def no_draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """No values: terms outside the catalogue are not drawn at random."""
    return {}

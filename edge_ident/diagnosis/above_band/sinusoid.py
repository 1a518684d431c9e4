"""A sinusoid above the band of the comparison, and which of several recordings show the same."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

_NONZERO: Final = 3.0
"""Standard deviations of a certain amplitude."""
SAME_RATE: Final = 0.02
"""Relative difference of two rates up to which two recordings show one sinusoid."""


@dataclass(frozen=True)
class Sinusoid:
    """A sinusoid above the band.

    Attributes
    ----------
    rate : float
        rad per unit of position for an order, rad/s for a line.
    cosine, sine : float
        In the unit of the effort, about position or time zero.
    std : float
        Standard deviation of either, and of the amplitude: noise, timing, and the difference
        between the halves of the recording.
    rate_std : float
        Standard deviation of the rate.
    share : float
        Rms over the rms of the recorded effort.
    found_again : bool
        Whether both halves of the recording hold it.
    gain : (float, float)
        Relative reduction of the residual of each half, by the amplitude of the other half.
    recorded : float
        Rms of what it removes from the effort above the band, less inertia where encoder noise does
        not hide the motion, over the rms of the recorded effort. The amplitude of either half is
        tried on the other half, so noise removes nothing. Of an order that is worth naming, with
        what it removes inside the band.
    of_encoder : bool
        Whether an order is rather an error of the encoder: it grows with the square of the speed,
        or is mostly inertia times a motion below the encoder's resolution.
    at_one_speed : bool
        Whether the motion has too few speeds to tell a ripple from an error of the encoder.
    """

    rate: float
    cosine: float
    sine: float
    std: float
    rate_std: float
    share: float
    found_again: bool
    gain: tuple[float, float]
    recorded: float = 0.0
    of_encoder: bool = False
    at_one_speed: bool = False

    @property
    def amplitude(self) -> float:
        """In the unit of the effort."""
        return float(np.hypot(self.cosine, self.sine))

    @property
    def certain(self) -> bool:
        """Whether its amplitude is."""
        return self.amplitude > _NONZERO * self.std

    @property
    def nameable(self) -> bool:
        """Whether a load of the axis, of a certain amplitude, is what explains it."""
        return self.certain and not self.of_encoder


def merged(found: list[list[Sinusoid]]) -> list[Sinusoid]:
    """Sinusoids of all recordings that were found again, the strongest first.

    Each counts once, from the recording that knows best what it is.
    """
    kept: list[Sinusoid] = []
    every = [(k, one) for k, sinusoids in enumerate(found) for one in sinusoids]
    for k, one in sorted(every, key=lambda pair: (not pair[1].nameable, pair[1].std)):
        again = one.found_again or any(same(one, other) for n, other in every if n != k)
        if again and not any(same(one, other) for other in kept):
            kept.append(one)
    return sorted(kept, key=lambda s: -s.share)


def same(one: Sinusoid, other: Sinusoid) -> bool:
    """Whether two sinusoids have the same rate, as far as it is known."""
    apart = abs(one.rate - other.rate)
    return apart < max(3.0 * math.hypot(one.rate_std, other.rate_std), SAME_RATE * one.rate)

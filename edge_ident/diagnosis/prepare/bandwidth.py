"""The band of a diagnosis, and the noise that it follows from.

The density of the effort's noise is the same at all frequencies; that of the encoder's, in the
inertia's torque, grows with their fourth power. Above a knee it is the larger of the two: where it
filled the residual, least squares would rather lose some inertia than explain an effort.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.conditioning import acceleration_noise, filtered_regressor
from edge_ident.signals.filters import gain, lowpass, whitening

Array = NDArray[np.float64]

_NARROWEST: Final = 0.25
"""Of the bandwidth that identification uses."""
_CUTOFF: Final = 2.1
"""Of the knee: the encoder's noise up to there would have twice the rms of the effort's."""
_MEDIAN_OF_NORMAL: Final = 0.6745
"""Of the absolute value, in standard deviations."""
_LAGS: Final = 12
"""Samples for which a controller remembers its encoder's rounding."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Band:
    """What is judged of an effort: all below the knee, from there to the cut-off less and less, so
    that its noise, with that of the encoder in the inertia's torque, is white."""

    cutoff_hz: float
    knee_hz: float

    def lowpass(self, signal: Array, period_s: float) -> Array:
        """What it passes of a signal (..., N)."""
        return lowpass(signal, self.cutoff_hz, period_s, knee_hz=self.knee_hz)

    @property
    def swing(self) -> float:
        """Acceleration that is passed of a motion of amplitude 1 at the cut-off."""
        passed = float(whitening(np.array(self.cutoff_hz / self.knee_hz)))
        return (2.0 * np.pi * self.cutoff_hz) ** 2 * passed

    def power(self, frequency_hz: Array) -> Array:
        """Squared gain."""
        passed = gain(frequency_hz / self.cutoff_hz) * whitening(frequency_hz / self.knee_hz)
        return np.asarray(passed**2)


def judged_band(
    position: Array,
    effort: Array,
    noise: float,
    density: float,
    widest_hz: float,
    period_s: float,
) -> Band:
    """The band in which noise of the encoder, of standard deviation `noise`, and of the effort, of
    power `density` (per Hz), are balanced.

    Narrower, and of the shorter stretches between reversals nothing would be left.
    """
    columns = filtered_regressor(position, widest_hz, period_s)
    smooth = lowpass(effort, widest_hz, period_s)
    inertia = abs(float(np.linalg.lstsq(columns, smooth, rcond=None)[0][0]))
    # the encoder's power, up to the widest, is a fifth of what its density there would make
    encoder = np.sqrt(5.0) * inertia * acceleration_noise(noise, widest_hz, period_s)
    ratio = np.sqrt(density * widest_hz) / max(float(encoder), _TINY)
    knee_hz = widest_hz * max(float(np.sqrt(ratio)), _NARROWEST / _CUTOFF)
    return Band(min(_CUTOFF * knee_hz, widest_hz), knee_hz)


def white_noise(effort: Array, position: Array, cutoff_hz: float, period_s: float) -> float:
    """Standard deviation of white noise in the effort, from what its highest frequencies leave.

    A controller answers the rounding of its encoder, and that answer is no noise: it really
    drives the axis. The recorded position holds the same rounding, so what follows from it by a
    short linear filter is taken off first.
    """
    above_hz = min(max(3.0 * cutoff_hz, 0.05 / period_s), 0.25 / period_s)
    high = [x - lowpass(x, above_hz, period_s) for x in (effort, position)]
    lags = np.arange(-_LAGS // 4, _LAGS)
    inside = slice(_LAGS, -_LAGS)
    answers = np.stack([np.roll(high[1], lag)[inside] for lag in lags], axis=1)
    scale = max(float(np.max(np.abs(answers))), _TINY)
    answer = answers @ np.linalg.lstsq(answers / scale, high[0][inside], rcond=1e-8)[0] / scale
    left = high[0][inside] - answer
    # jumps of friction reach up here as well, but only now and then
    deviation = float(np.median(np.abs(left))) / _MEDIAN_OF_NORMAL
    return float(deviation / np.sqrt(1.0 - 2.0 * above_hz * period_s))

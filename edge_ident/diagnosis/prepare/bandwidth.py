"""The bandwidths of the comparison, chosen from the noise of effort and encoder.

The effort noise has the same power density at all frequencies. The encoder noise, seen through the
torque of the inertia, has a density that grows with the fourth power of the frequency. Above the
knee the encoder noise dominates. In a wider band least squares would reduce the inertia, and with
it the encoder noise, rather than explain the effort.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.conditioning import acceleration_noise, filtered_regressor
from edge_ident.signals.filters import lowpass, magnitude, whitening

Array = NDArray[np.float64]

_NARROWEST: Final = 0.25
"""Lowest cut-off over that of the identification."""
_CUTOFF: Final = 2.1
"""Cut-off over knee: the encoder noise below it would have twice the rms of the effort noise."""
_MEDIAN_OF_NORMAL: Final = 0.6745
"""Median of the absolute value of a normal variable, in standard deviations."""
_MOTION_BAND: Final = 2.0
"""Bandwidth of the motion over that of the comparison. A narrower motion would reverse and stop at
other moments than the axis; a wider one brings noise that the weighting folds into the band."""
_WIDEST: Final = 0.2
"""Highest bandwidth of the motion, of the sampling rate."""
_LAGS: Final = 12
"""Samples for which a controller answers the rounding of its encoder."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Band:
    """The low-pass filter of the comparison.

    It passes everything below the knee. From there to the cut-off it attenuates with the square of
    the frequency, so that the noise of effort and encoder together is white.
    """

    cutoff_hz: float
    knee_hz: float

    def lowpass(self, signal: Array, period_s: float) -> Array:
        """Filter a signal (..., N), zero-phase."""
        return lowpass(signal, self.cutoff_hz, period_s, knee_hz=self.knee_hz)

    def motion_hz(self, sampling_s: float) -> float:
        """Bandwidth of the motion, of a recording with this sampling period."""
        return min(_MOTION_BAND * self.cutoff_hz, _WIDEST / sampling_s)

    @property
    def acceleration_gain(self) -> float:
        """Filtered acceleration, 1/s², of a motion of amplitude 1 at the cut-off."""
        passed = float(whitening(np.array(self.cutoff_hz / self.knee_hz)))
        return (2.0 * np.pi * self.cutoff_hz) ** 2 * passed

    def power(self, frequency_hz: Array) -> Array:
        """Squared magnitude of the frequency response."""
        passed = magnitude(frequency_hz / self.cutoff_hz) * whitening(frequency_hz / self.knee_hz)
        return np.asarray(passed**2)


def comparison_band(
    position: Array,
    effort: Array,
    noise: float,
    density: float,
    widest_hz: float,
    period_s: float,
) -> Band:
    """Find the band in which encoder noise and effort noise are balanced.

    A narrower band would leave nothing of the short segments between reversals.

    Parameters
    ----------
    position, effort : (N,) arrays
    noise : float
        Standard deviation of the encoder noise.
    density : float
        Power density of the effort noise, per Hz.
    widest_hz : float
        Upper limit of the cut-off.
    """
    regressor = filtered_regressor(position, widest_hz, period_s)
    smooth = lowpass(effort, widest_hz, period_s)
    inertia = abs(float(np.linalg.lstsq(regressor, smooth, rcond=None)[0][0]))
    return balanced_band(inertia, noise, density, widest_hz, period_s)


def balanced_band(
    inertia: float, noise: float, density: float, widest_hz: float, period_s: float
) -> Band:
    """The same for a known inertia, in the unit of effort per acceleration."""
    # the integral of f⁴ up to the widest frequency is a fifth of its value there
    encoder = np.sqrt(5.0) * inertia * acceleration_noise(noise, widest_hz, period_s)
    ratio = np.sqrt(density * widest_hz) / max(float(encoder), _TINY)
    knee_hz = widest_hz * max(float(np.sqrt(ratio)), _NARROWEST / _CUTOFF)
    return Band(min(_CUTOFF * knee_hz, widest_hz), knee_hz)


def white_noise(effort: Array, position: Array, cutoff_hz: float, period_s: float) -> float:
    """Standard deviation of the white noise in the effort, from its highest frequencies.

    The controller's answer to the rounding of its encoder is no noise, because it drives the axis.
    The recorded position holds the same rounding. So the part of the effort that follows from the
    position by a short linear filter is subtracted first.
    """
    above_hz = min(max(3.0 * cutoff_hz, 0.05 / period_s), 0.25 / period_s)
    high = [x - lowpass(x, above_hz, period_s) for x in (effort, position)]
    lags = np.arange(-_LAGS // 4, _LAGS)
    inside, last = slice(_LAGS, -_LAGS), len(effort) - _LAGS
    scaled = high[1] / max(float(np.max(np.abs(high[1]))), _TINY)
    answers = np.stack([scaled[_LAGS - lag : last - lag] for lag in lags])
    # normal equations take a quarter of the time, and squares of 1e-7 are resolved
    inverse = np.linalg.pinv(answers @ answers.T, rcond=1e-14, hermitian=True)
    left = high[0][inside] - (inverse @ (answers @ high[0][inside])) @ answers
    # the median ignores the steps of friction, which reach these frequencies now and then
    deviation = float(np.median(np.abs(left))) / _MEDIAN_OF_NORMAL
    return float(deviation / np.sqrt(1.0 - 2.0 * above_hz * period_s))

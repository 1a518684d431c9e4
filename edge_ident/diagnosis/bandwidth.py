"""The bandwidth of a diagnosis, and the noise that it follows from.

Encoder noise in the inertia's torque grows with the bandwidth to the power 2.5, that of the effort
to the power 0.5. The narrower the filter, the longer every reversal is faded out; the wider, the
more of the residual is noise that says nothing.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.filters import lowpass
from edge_ident.signals import acceleration_noise, filtered_regressor

Array = NDArray[np.float64]

_NARROWEST: Final = 0.25
"""Of the bandwidth that identification uses."""
_MEDIAN_OF_NORMAL: Final = 0.6745
"""Of the absolute value, in standard deviations."""
_LAGS: Final = 12
"""Samples for which a controller remembers its encoder's rounding."""
_TINY: Final = float(np.finfo(float).tiny)


def balanced_cutoff(
    position: Array,
    effort: Array,
    noise: float,
    density: float,
    widest_hz: float,
    period_s: float,
) -> float:
    """Where the encoder's noise, which grows as f^2.5, is twice that of the effort, as f^0.5.

    Narrower, and of the shorter stretches between reversals nothing would be left.
    """
    columns = filtered_regressor(position, widest_hz, period_s)
    smooth = lowpass(effort, widest_hz, period_s)
    inertia = abs(float(np.linalg.lstsq(columns, smooth, rcond=None)[0][0]))
    encoder = inertia * acceleration_noise(noise, widest_hz, period_s)
    ratio = 2.0 * np.sqrt(density * widest_hz) / max(encoder, _TINY)
    return float(widest_hz * np.clip(np.sqrt(ratio), _NARROWEST, 1.0))


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

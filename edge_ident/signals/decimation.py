"""Long recordings: fewer samples where a bandwidth needs no more, and parts that tell of the whole.

A drive is sampled at least twenty times faster than the bandwidth of its identification. Recordings
of a minute bear that. In hours at 1 kHz most samples tell nothing, and cost time and memory.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LONG: Final = 1 << 17
"""Samples from which a recording is long: two minutes at 1 kHz."""
_PARTS: Final = 16
_PART: Final = 1 << 14
"""Samples of a part, of which one long recording has 16, evenly spread."""
_REACH: Final = 22
"""Half the length of the low-pass filter, in samples of the lower rate: 100 dB of attenuation."""
_MIDDLE: Final = 0.425
"""Middle of the filter's transition, of the lower rate: flat up to 0.35 of it, nothing from 0.5 on.
"""
_KAISER: Final = 10.06
"""Parameter of Kaiser's window (1974) for 100 dB."""
_BLOCK: Final = 1 << 17
"""Samples that are filtered at once: they stay in the processor's cache."""


def parts_of(signal: Array) -> list[Array]:
    """Parts that tell the noise of a signal (N,): the whole, or 16 spread over a long one."""
    if len(signal) <= LONG:
        return [signal]
    count = min(_PARTS, len(signal) // _PART)
    starts = np.linspace(0, len(signal) - _PART, count).astype(np.intp)
    return [signal[start : start + _PART] for start in starts]


def kept(samples: int, stride: int) -> slice:
    """Samples that decimation keeps: those at which the filter reaches over neither end."""
    return slice(_REACH * stride, samples - _REACH * stride, stride)


def decimate(first: Array, second: Array, stride: int) -> tuple[Array, Array]:
    """Two signals (N,), low-passed without delay, at the samples that are `kept`.

    The filter ends after 22 samples of the lower rate, so a block is filtered like the whole.
    """
    size = max(8 * _REACH, _BLOCK // stride)
    inner, outputs = size - 2 * _REACH, len(range(len(first))[kept(len(first), stride)])
    response = np.fft.fft(_kernel(stride, size * stride))
    both = np.zeros(size * stride, dtype=np.complex128)
    result = np.empty(outputs, dtype=np.complex128)
    for at in range(0, outputs, inner):
        block = slice(at * stride, (at + size) * stride)
        here = len(first[block])
        both.real[:here], both.imag[:here] = first[block], second[block]
        # two real signals make one complex; to take every stride-th sample folds the spectrum
        spectrum = np.fft.fft(both) * response
        folded = np.fft.ifft(spectrum.reshape(stride, size).mean(axis=0))
        result[at : at + inner] = folded[_REACH : _REACH + min(inner, outputs - at)]
    return result.real.copy(), result.imag.copy()


def any_of(mask: NDArray[np.bool_], stride: int) -> NDArray[np.bool_]:
    """Whether any of the samples from one that is `kept` to the next is marked."""
    starts = np.arange(len(mask))[kept(len(mask), stride)]
    return np.logical_or.reduceat(mask, starts)


def _kernel(stride: int, length: int) -> Array:
    """Windowed sinc around index 0 of a circle."""
    lag = np.arange(-_REACH * stride, _REACH * stride + 1)
    taps = np.sinc(2.0 * _MIDDLE / stride * lag) * np.kaiser(len(lag), _KAISER)
    kernel = np.zeros(length)
    kernel[lag] = taps / np.sum(taps)
    return kernel

"""Zero-phase filtering and differentiation of evenly sampled signals. numpy alone.

A Butterworth filter run both ways is applied as a gain in the frequency domain (Gautier 1997;
Janot et al. 2014 for the practice in robot identification).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


# Cut-off periods after which the filter's impulse response is below 1e-6.
_SETTLING_PERIODS: Final = 6.0
_WHITENING_PERIODS: Final = 3.0  # periods of the knee after which that of `whitening` is
# Highest cut-off, of the sampling rate, of which that holds: it leaves little of a jump at half the
# sampling rate, where the spectrum ends.
_SLOW: Final = 0.125


def differentiate(
    position: Array, cutoff_hz: float, period_s: float, *, orders: Sequence[int] = (0, 1, 2)
) -> tuple[Array, ...]:
    """Zero-phase filtered position, velocity and acceleration, correct up to the ends.

    A quintic that shares position, slope and curvature with the data at both ends is taken out
    first and differentiated exactly; what is left starts and ends flat, so its odd reflection
    has no kink for the filter to smear. A long record is filtered in blocks, because a polynomial
    that fits both of its ends is too large between them.

    Parameters
    ----------
    position : (N,) array
    cutoff_hz, period_s : float
        Of the filter (-6 dB), and of the samples.
    orders : sequence of int
        Of the derivatives that are wanted.

    Returns
    -------
    tuple of (N,) arrays
        One for each order.
    """
    blocks = _blocks(len(position), _settled(cutoff_hz, period_s))
    if len(blocks) == 1:
        fading = _rings(cutoff_hz, period_s)
        return _differentiated(position, cutoff_hz, period_s, orders, fading=fading)
    result = tuple(np.empty(len(position)) for _ in orders)
    for begin, end, around in blocks:
        inner = slice(begin - around.start, end - around.start)
        parts = _differentiated(position[around], cutoff_hz, period_s, orders, fading=True)
        for whole, part in zip(result, parts, strict=True):
            whole[begin:end] = part[inner]
    return result


def _differentiated(
    position: Array, cutoff_hz: float, period_s: float, orders: Sequence[int], *, fading: bool
) -> tuple[Array, ...]:
    """The same in one piece."""
    samples = len(position)
    trend, powers = _end_matching_quintic(position, cutoff_hz, period_s), _powers(samples)
    per_second = 2.0 / ((samples - 1) * period_s)
    settled = _settled(cutoff_hz, period_s)
    padded, start = _pad(position - trend @ powers, settled, odd=True, fading=fading)
    spectrum, frequency = _filtered_spectrum(padded, cutoff_hz, period_s)
    rate = 2j * np.pi * frequency
    spectra, polynomials = np.tile(spectrum, (len(orders), 1)), np.zeros((len(orders), 6))
    for number, order in enumerate(orders):
        for _ in range(order):  # a power of complex numbers takes six times as long
            spectra[number] *= rate
        polynomials[number, order:] = per_second**order * _slopes(order) * trend[: 6 - order]
    # two transforms together take little longer than one
    filtered = np.fft.irfft(spectra, len(padded))[:, start : start + samples]
    filtered += polynomials @ powers
    return tuple(filtered)


@cache
def _slopes(order: int) -> Array:
    """Derivatives at 1 of the powers from the fifth down to that of the order."""
    return np.asarray(np.polyder(np.ones(6), order), dtype=np.float64)


@lru_cache(maxsize=2)
def _powers(samples: int) -> Array:
    """Powers (6, N) from the fifth to none of N numbers from -1 to 1; read-only."""
    powers, x = np.ones((6, samples)), np.linspace(-1.0, 1.0, samples)
    for lower in range(5, 0, -1):
        np.multiply(powers[lower], x, out=powers[lower - 1])
    powers.flags.writeable = False
    return powers


def lowpass(
    signal: Array,
    cutoff_hz: float,
    period_s: float,
    *,
    delay_s: float | Sequence[float] = 0.0,
    knee_hz: float = np.inf,
) -> Array:
    """Zero-phase fourth-order Butterworth filter, run both ways, with even reflection.

    Parameters
    ----------
    signal : (..., N) array
    delay_s : float, or sequence of float for each of (D, N) signals
        Moves them to later times by this much, a fraction of a sample included.
    knee_hz : float
        See `whitening`.
    """
    blocks = _blocks(signal.shape[-1], _settled(cutoff_hz, period_s, knee_hz))
    if len(blocks) == 1:
        fading = _rings(cutoff_hz, period_s)
        return _lowpassed(signal, cutoff_hz, period_s, delay_s, knee_hz, fading=fading)
    result = np.empty(signal.shape)
    for begin, end, around in blocks:
        part = _lowpassed(signal[..., around], cutoff_hz, period_s, delay_s, knee_hz, fading=True)
        result[..., begin:end] = part[..., begin - around.start : end - around.start]
    return result


def _lowpassed(
    signal: Array,
    cutoff_hz: float,
    period_s: float,
    delay_s: float | Sequence[float],
    knee_hz: float,
    *,
    fading: bool,
) -> Array:
    """The same in one piece."""
    settled = _settled(cutoff_hz, period_s, knee_hz)
    padded, start = _pad(signal, settled, odd=False, fading=fading)
    spectrum, frequency = _filtered_spectrum(padded, cutoff_hz, period_s)
    if np.isfinite(knee_hz):
        spectrum *= whitening(frequency / knee_hz)
    if delay_s:
        angles = -2.0 * np.pi * frequency[1] * np.asarray(delay_s)
        spectrum *= _turning(angles, len(frequency))
    samples = slice(start, start + signal.shape[-1])
    return np.asarray(np.fft.irfft(spectrum, padded.shape[-1])[..., samples])


def _settled(cutoff_hz: float, period_s: float, knee_hz: float = np.inf) -> int:
    """Samples after which the filter no longer feels a change."""
    periods_s = max(_SETTLING_PERIODS / cutoff_hz, _WHITENING_PERIODS / knee_hz)
    return int(np.ceil(periods_s / period_s))


def _rings(cutoff_hz: float, period_s: float) -> bool:
    """Whether the filter rings where the padded record closes on itself, so that it has to fade."""
    return cutoff_hz * period_s > _SLOW


def magnitude(frequency: Array) -> Array:
    """Magnitude response of the filter run both ways, at frequencies in cut-offs."""
    return np.asarray(1.0 / (1.0 + ((frequency**2) ** 2) ** 2))  # squares take a tenth of the time


def whitening(frequency: Array) -> Array:
    """Magnitude that makes white noise of noise whose density grows with the fourth power of the
    frequency on top of a constant one, at frequencies in knees: there both are the same."""
    return np.asarray(1.0 / np.sqrt(1.0 + (frequency**2) ** 2))


def _filtered_spectrum(
    padded: Array, cutoff_hz: float, period_s: float
) -> tuple[NDArray[np.complex128], Array]:
    frequency, response = _response(padded.shape[-1], cutoff_hz, period_s)
    spectrum = np.fft.rfft(padded)
    spectrum *= response
    return spectrum, frequency


def _turning(angles: Array, count: int) -> NDArray[np.complex128]:
    """Powers (..., count), from none on, of complex numbers (...) of magnitude 1, as products of
    few."""
    few = math.isqrt(count) + 1
    steps = 1j * angles[..., None] * np.arange(few)
    powers = np.exp(few * steps)[..., None] * np.exp(steps)[..., None, :]
    return np.asarray(powers.reshape(*angles.shape, -1)[..., :count])


@lru_cache(maxsize=8)
def _response(samples: int, cutoff_hz: float, period_s: float) -> tuple[Array, Array]:
    """Frequencies of a spectrum in Hz, and the filter's magnitude there; read-only."""
    frequency = np.asarray(np.fft.rfftfreq(samples, period_s), dtype=np.float64)
    response = magnitude(frequency / cutoff_hz)
    frequency.flags.writeable = response.flags.writeable = False
    return frequency, response


def _blocks(samples: int, settled: int) -> list[tuple[int, int, slice]]:
    """Begin and end of the blocks of a long record, and what to filter for each.

    Their neighbours at both sides settle the filter.
    """
    margin = 2 * settled
    length = max(LONG // 2, 2 * margin)
    if samples <= 2 * length:
        return [(0, samples, slice(0, samples))]
    begins = range(0, samples, length)
    ends = [*begins[1:], samples]
    return [
        (begin, end, slice(max(0, begin - margin), end + margin))
        for begin, end in zip(begins, ends, strict=True)
    ]


def _pad(signal: Array, settled: int, *, odd: bool, fading: bool) -> tuple[Array, int]:
    """Reflect both ends until the wrap-around cannot be felt, to a length that the FFT likes."""
    margin = 2 * settled if fading else settled
    samples = signal.shape[-1]
    total = fast_length(samples + 2 * margin)
    padded = _reflected(signal, margin, total - samples - margin, odd=odd)
    if fading:
        fade = np.cos(np.linspace(0.0, 0.5 * np.pi, settled)) ** 2
        end = margin + samples + settled
        padded[..., :settled] *= fade[::-1]
        padded[..., end : end + settled] *= fade
        padded[..., end + settled :] = 0.0
    return padded, margin


def _reflected(signal: Array, before: int, after: int, *, odd: bool) -> Array:
    """A signal with reflections at both ends."""
    if max(before, after) >= signal.shape[-1]:  # more than once
        widths = [(0, 0)] * (signal.ndim - 1) + [(before, after)]
        return np.pad(signal, widths, mode="reflect", reflect_type="odd" if odd else "even")
    first, last = signal[..., before:0:-1], signal[..., -2 : -2 - after : -1]
    if odd:
        first, last = 2.0 * signal[..., :1] - first, 2.0 * signal[..., -1:] - last
    return np.concatenate([first, signal, last], axis=-1)


@lru_cache(maxsize=64)
def fast_length(minimum: int) -> int:
    """Smallest product of 2, 3 and 5 that is not below the minimum."""
    best = 1 << (minimum - 1).bit_length()
    for threes in range(8):
        for fives in range(6):
            odd = 3**threes * 5**fives
            quotient = -(-minimum // odd)
            best = min(best, odd << max(quotient - 1, 0).bit_length())
    return best


def _end_matching_quintic(position: Array, cutoff_hz: float, period_s: float) -> Array:
    """Coefficients (6,) on [-1, 1], the highest power first, of the polynomial with the data's
    value, slope and curvature at both ends.

    The three are read from a cubic fitted over one and a half cut-off periods.
    """
    samples = len(position)
    window = min(max(int(1.5 / (cutoff_hz * period_s)), 8), samples // 2)
    parts = np.stack([position[:window], position[samples - window :]], axis=1)
    cubics = _to_cubic(window) @ parts
    stretch = ((samples - 1) / (window - 1)) ** np.arange(3)
    first, last = _at_ends(3)
    values = np.concatenate([stretch * (first @ cubics[:, 0]), stretch * (last @ cubics[:, 1])])
    return np.asarray(_from_ends() @ values)


@lru_cache(maxsize=32)
def _to_cubic(samples: int) -> Array:
    """Matrix (4, N) of a least-squares cubic on [-1, 1]; read-only."""
    powers = np.vander(np.linspace(-1.0, 1.0, samples), 4)
    matrix = np.asarray(np.linalg.pinv(powers), dtype=np.float64)
    matrix.flags.writeable = False
    return matrix


@cache
def _from_ends() -> Array:
    """Coefficients (6, 6) of the quintics that have one of the three at one end, and no other."""
    return np.linalg.inv(np.concatenate(_at_ends(5)))


@cache
def _at_ends(degree: int) -> tuple[Array, Array]:
    """Value, slope and curvature (3, degree + 1) of every power of x at -1, and at 1."""
    powers = np.eye(degree + 1)
    first, last = (
        np.array([[np.polyval(np.polyder(p, order), end) for p in powers] for order in range(3)])
        for end in (-1.0, 1.0)
    )
    return first, last


# Long recordings: fewer samples where a bandwidth needs no more, and parts that tell of the whole.
#
# A drive is sampled at least twenty times faster than the bandwidth of its identification.
# Recordings of a minute bear that. In hours at 1 kHz most samples tell nothing, and cost time and
# memory.

LONG: Final = 1 << 17
"""Samples from which a recording is long: two minutes at 1 kHz."""
_PARTS: Final = 16
_PART: Final = 1 << 14  # samples of a part, of which one long recording has 16, evenly spread
# Half the length of the low-pass filter, in samples of the lower rate: 100 dB of attenuation.
_REACH: Final = 22
# Middle of the filter's transition, of the lower rate: flat up to 0.35 of it, nothing from 0.5 on.
_MIDDLE: Final = 0.425
_KAISER: Final = 10.06  # parameter of Kaiser's window (1974) for 100 dB
_BLOCK: Final = 1 << 17  # samples that are filtered at once: they stay in the processor's cache


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


# Lines in the spectrum of a motion: its frequencies, where it is a sum of a few sinusoids.

Mask = NDArray[np.bool_]

ONE_LINE: Final = 0.9
"""Share of a velocity's variance in one line, from which the other frequencies together move an
axis by less than a third as much."""
# Frequencies tried in each step of the record's resolution: a peak is lower by 3 % at most.
_FINER: Final = 4
# Share of a signal's power from which a line belongs to the motion. What shakes an axis from
# outside moves it far less than its drive does.
_STRONG: Final = 0.01
_MOST: Final = 40  # lines that are looked for
_ORDERS: Final = 3  # harmonics of each line that friction and play add: even ones and odd ones
# Share of the power from which a line's harmonics and combinations are considered.
_DOMINANT: Final = 0.1
_NARROW: Final = 0.5  # distance from any line that belongs to it, of the resolution of the record
_WIDE: Final = 1.5  # the same for strong lines, whose feet are wide, and what friction adds
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Line:
    """A line of a spectrum.

    Attributes
    ----------
    frequency_hz : float
    share : float
        Of the signal's variance that a sinusoid of this frequency explains.
    """

    frequency_hz: float
    share: float


def strongest_line(signal: Array, period_s: float, highest_hz: float) -> Line:
    """The strongest line, up to a frequency, of an evenly sampled signal (N,)."""
    return _strongest(signal - np.mean(signal), period_s, highest_hz)[0]


def motion_lines(signal: Array, period_s: float, highest_hz: float) -> tuple[Line, ...]:
    """Lines that hold a hundredth of the power of an even signal (N,), strongest first."""
    left = signal - np.mean(signal)
    power = float(left @ left)
    found: list[Line] = []
    while len(found) < _MOST:
        before = float(left @ left)
        line, left = _strongest(left, period_s, highest_hz)
        share = line.share * before / max(power, _TINY)
        if share < _STRONG:
            break
        found.append(Line(line.frequency_hz, share))
    return tuple(found)


def driven(frequency_hz: Array, lines: tuple[Line, ...], resolution_hz: float) -> Mask:
    """Frequencies (F,) at which a motion of these lines has an effort of its own.

    These are the lines. Friction and play add low harmonics of the strong ones, and their sums and
    differences.

    Parameters
    ----------
    resolution_hz : float
        One over the length of the record.
    """
    every = np.array([line.frequency_hz for line in lines])
    strong = np.array([line.frequency_hz for line in lines if line.share > _DOMINANT])
    combined = [np.add.outer(strong, strong), np.abs(np.subtract.outer(strong, strong))]
    answers = np.concatenate(
        [*(order * strong for order in range(1, _ORDERS + 1)), *(c.ravel() for c in combined)]
    )
    near = np.zeros(len(frequency_hz), dtype=np.bool_)
    for place_hz, width in ((every, _NARROW), (answers[answers > 0.0], _WIDE)):
        apart = np.abs(frequency_hz[:, None] - place_hz)
        near |= np.any(apart < width * resolution_hz, axis=1)
    return near


def _strongest(left: Array, period_s: float, highest_hz: float) -> tuple[Line, Array]:
    """The strongest line of what is left (N,) of a signal, and what is left without it."""
    bins = _FINER * len(left)
    power = np.abs(np.fft.rfft(left, bins))
    power[: _FINER // 2] = 0.0  # less than half a period in the record
    highest = max(_FINER, int(highest_hz * bins * period_s))
    frequency_hz = int(np.argmax(power[: highest + 1])) / (bins * period_s)
    angle = 2.0 * np.pi * frequency_hz * period_s * np.arange(len(left))
    columns = np.stack([np.cos(angle), np.sin(angle), np.ones(len(angle))], axis=1)
    without = left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    share = 1.0 - float(without @ without) / max(float(left @ left), _TINY)
    return Line(frequency_hz, share), without

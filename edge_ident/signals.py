"""From measured samples to smooth signals: filter, differentiate, subsample. numpy alone.

One code path serves training and run time, so the network never sees two kinds of preprocessing.

Sources: zero-phase Butterworth filtering and the order 'filter, differentiate, decimate' are the
practice of robot identification (Gautier 1997; Janot et al. 2014); subsampling by the DCT-II is
the paper's, with the orthonormal scaling as a reconstruction.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from edge_ident.model import regressor

Array = NDArray[np.float64]

POINTS: Final = 100
"""Length that the paper subsamples every signal to."""

_ORDER: Final = 4
_SETTLING_PERIODS: Final = 6
"""Cut-off periods after which the filter's impulse response is below 1e-6."""
_SAMPLES_PER_CUTOFF_PERIOD: Final = 20
"""Gautier's rule: sample at least 100 times faster than the dynamics, filter at 5 times."""
_ACCELERATION_NOISE_SHARE: Final = 0.05
"""Encoder noise allowed in the acceleration; its square biases the inertia, by 0.25 %."""
_TINY: Final = float(np.finfo(float).tiny)
_DECAY_PERIODS: Final = 1.5
"""Cut-off periods after which 3 % of the filter's response are left."""
_STANDSTILL_NOISE: Final = 8.0
"""Range of the position, in standard deviations of its noise, up to which the axis stands."""
_JITTER_LIMIT: Final = 0.05
"""Deviation from an even grid, in sampling periods, above which samples are interpolated."""


@dataclass(frozen=True)
class Signals:
    """One axis, smooth and evenly sampled, all columns filtered alike.

    Attributes
    ----------
    period_s : float
        Sampling period of the even grid.
    cutoff_hz : float
        -6 dB frequency of the zero-phase filter.
    effort : (N,) array
    regressor : (N, 4) array
        Columns of `edge_ident.model.regressor`, low-passed like the effort.
    moving : (N,) array of bool
        False where the axis stood still for longer than the filter can resolve. Friction is
        not determined by the motion there; effort and regressor are bridged by straight lines,
        alike, so that what is linear between them stays so.
    acceleration_noise : float
        Encoder noise in the acceleration over its rms value; the square of it is the share by
        which least squares underestimates the inertia (errors in variables).
    jitter : float
        Largest deviation of a time stamp from an even grid, in sampling periods.
    """

    period_s: float
    cutoff_hz: float
    effort: Array
    regressor: Array
    moving: NDArray[np.bool_]
    acceleration_noise: float
    jitter: float

    @property
    def interpolated(self) -> bool:
        """Whether the sampling was too uneven to be taken for even."""
        return self.jitter > _JITTER_LIMIT


def condition(
    time_s: Array, position: Array, effort: Array, *, effort_shift_s: float = 0.0
) -> Signals:
    """Filter and differentiate one axis.

    Parameters
    ----------
    time_s, position, effort : (N,) arrays
        Uneven sampling is interpolated to an even grid of the mean period.
    effort_shift_s : float
        Time from a row's stamp to the middle of the interval in which its effort acted.
    """
    period_s = float((time_s[-1] - time_s[0]) / (len(time_s) - 1))
    even = time_s[0] + period_s * np.arange(len(time_s))
    deviation = time_s - even
    jitter = float(np.max(np.abs(deviation - np.mean(deviation)))) / period_s
    if jitter > _JITTER_LIMIT:
        position = interpolate(even, time_s, position)
        effort = interpolate(even, time_s, effort)
    cutoff_hz = choose_cutoff(position, period_s)
    _, velocity, acceleration = differentiate(position, cutoff_hz, period_s)
    smooth_effort = lowpass(effort, cutoff_hz, period_s, delay_s=effort_shift_s)
    columns = regressor(velocity, acceleration)
    columns[:, 2] = lowpass(columns[:, 2], cutoff_hz, period_s)
    moving = ~standing(position, cutoff_hz, period_s)
    noise = acceleration_noise(position_noise(position), cutoff_hz, period_s)
    return Signals(
        period_s=period_s,
        cutoff_hz=cutoff_hz,
        effort=bridge(smooth_effort, moving),
        regressor=bridge(columns, moving),
        moving=moving,
        acceleration_noise=noise / max(float(np.std(acceleration)), _TINY),
        jitter=jitter,
    )


def choose_cutoff(position: Array, period_s: float) -> float:
    """Widest cut-off at which encoder noise spoils the acceleration little.

    The narrower the filter, the longer every reversal and standstill is smeared; the wider, the
    more noise. It ends where the noise reaches 5 % of the rms acceleration, and never above a
    twentieth of the sampling rate.

    Returns
    -------
    float
        In Hz.
    """
    ceiling_hz = 1.0 / (_SAMPLES_PER_CUTOFF_PERIOD * period_s)
    noise = position_noise(position)
    cutoff_hz = ceiling_hz
    for _ in range(8):  # the rms acceleration itself depends, weakly, on the cut-off
        _, _, acceleration = differentiate(position, cutoff_hz, period_s)
        allowed = _ACCELERATION_NOISE_SHARE * float(np.std(acceleration))
        excess = acceleration_noise(noise, cutoff_hz, period_s) / max(allowed, _TINY)
        wanted_hz = min(ceiling_hz, cutoff_hz * float(max(excess, _TINY) ** -0.4))
        if abs(wanted_hz - cutoff_hz) < 0.01 * cutoff_hz:
            break
        cutoff_hz = wanted_hz
    return max(cutoff_hz, 4.0 / (period_s * len(position)))


def acceleration_noise(position_noise: float, cutoff_hz: float, period_s: float) -> float:
    """Standard deviation that white position noise has in the filtered second derivative.

    Noise of deviation s, sampled at f_s, has density 2s²/f_s; differentiated twice and cut off
    at f_c its variance is (2π)⁴·f_c⁵/5 · 2s²/f_s.
    """
    variance = (2.0 * np.pi) ** 4 * cutoff_hz**5 / 5.0 * 2.0 * position_noise**2 * period_s
    return float(np.sqrt(variance))


def standing(position: Array, cutoff_hz: float, period_s: float) -> NDArray[np.bool_]:
    """Samples in or near a standstill of at least one cut-off period.

    A standstill is a stretch in which the encoder shows nothing but its own noise. It spoils
    filtered signals to either side, until the filter's response has decayed. A shorter reversal
    is left in: there the filtered sign of the velocity describes what the filter leaves of the
    friction.

    Returns
    -------
    (N,) array of bool
    """
    width = int(np.ceil(1.0 / (cutoff_hz * period_s)))
    margin = int(np.ceil(_DECAY_PERIODS * width))
    if width >= len(position):
        return np.zeros(len(position), dtype=np.bool_)
    windows = np.lib.stride_tricks.sliding_window_view(position, width)
    still = np.ptp(windows, axis=1) <= _STANDSTILL_NOISE * position_noise(position)
    # from the windows' first samples to all of their samples and the margins at both sides
    spread = np.convolve(still, np.ones(width + 2 * margin))[margin : margin + len(position)]
    return np.asarray(spread > 0.5)


def bridge(signal: Array, moving: NDArray[np.bool_]) -> Array:
    """Replace an (N, ...) signal by straight lines where the axis does not move."""
    if moving.all() or not moving.any():
        return signal
    index = np.arange(len(signal))
    bridged = signal.copy().reshape(len(signal), -1)
    for column in bridged.T:
        column[~moving] = np.interp(index[~moving], index[moving], column[moving])
    return bridged.reshape(signal.shape)


def position_noise(position: Array) -> float:
    """Standard deviation of white noise in a position, at least that of its quantization.

    Third differences remove the motion and multiply white noise by √20.
    """
    third = np.diff(position, 3)
    steps = np.diff(np.unique(position))
    count = float(np.min(steps, initial=np.inf, where=steps > 1e-9 * np.ptp(position)))
    quantization = count / np.sqrt(12.0) if np.isfinite(count) else 0.0
    return max(float(np.sqrt(np.mean(third**2) / 20.0)), quantization)


def differentiate(position: Array, cutoff_hz: float, period_s: float) -> tuple[Array, Array, Array]:
    """Zero-phase filtered position, velocity and acceleration, correct up to the ends.

    A quintic that shares position, slope and curvature with the data at both ends is taken out
    first and differentiated exactly; what is left starts and ends flat, so its odd reflection
    has no kink for the filter to smear.

    Parameters
    ----------
    position : (N,) array

    Returns
    -------
    position, velocity, acceleration : (N,) arrays
    """
    samples = len(position)
    trend = _end_matching_quintic(position, cutoff_hz, period_s)
    x = np.linspace(-1.0, 1.0, samples)
    per_second = 2.0 / ((samples - 1) * period_s)
    rest = position - trend(x)
    padded, start = _pad(rest, cutoff_hz, period_s, reflect_type="odd")
    spectrum, frequency = _filtered_spectrum(padded, cutoff_hz, period_s)
    result = []
    for order in range(3):
        filtered = np.fft.irfft(spectrum * (2j * np.pi * frequency) ** order, len(padded))
        polynomial = (trend.deriv(order) if order else trend)(x) * per_second**order
        result.append(filtered[start : start + samples] + polynomial)
    return result[0], result[1], result[2]


def lowpass(signal: Array, cutoff_hz: float, period_s: float, *, delay_s: float = 0.0) -> Array:
    """Zero-phase fourth-order Butterworth filter, run both ways, with even reflection.

    Parameters
    ----------
    signal : (N,) array
    delay_s : float
        Moves the signal to later times by this much, a fraction of a sample included.
    """
    padded, start = _pad(signal, cutoff_hz, period_s, reflect_type="even")
    spectrum, frequency = _filtered_spectrum(padded, cutoff_hz, period_s)
    spectrum = spectrum * np.exp(-2j * np.pi * frequency * delay_s)
    return np.asarray(np.fft.irfft(spectrum, len(padded))[start : start + len(signal)])


def interpolate(at: Array, time: Array, signal: Array) -> Array:
    """Cubic Lagrange interpolation on an uneven grid.

    Parameters
    ----------
    at : (M,) array
        Times wanted, inside the span of `time`.
    time, signal : (N,) arrays, N at least 4
    """
    first = np.clip(np.searchsorted(time, at) - 2, 0, len(time) - 4)
    nodes = first[:, None] + np.arange(4)
    t = time[nodes]
    result = np.zeros_like(at)
    for i in range(4):
        others = [j for j in range(4) if j != i]
        weight = np.prod((at[:, None] - t[:, others]) / (t[:, [i]] - t[:, others]), axis=1)
        result += weight * signal[nodes[:, i]]
    return result


def subsample(signal: Array, points: int = POINTS) -> Array:
    """Fewer points along the first axis, by truncating the orthonormal DCT-II.

    Keep the first `points` coefficients, transform back at that length, scale by √(points/N)
    (the paper's DCT-II subsampling; scaling reconstructed).

    Parameters
    ----------
    signal : (N, ...) array, N at least `points`

    Returns
    -------
    (points, ...) array
    """
    if len(signal) < points:
        raise ValueError(f"cannot subsample {len(signal)} samples to {points}")
    return np.asarray(idct2(dct2(signal)[:points]) * np.sqrt(points / len(signal)))


def dct2(signal: Array) -> Array:
    """Orthonormal DCT-II along the first axis."""
    n = len(signal)
    mirrored = np.concatenate([signal, signal[::-1]])
    spectrum = np.fft.rfft(mirrored, axis=0)[:n]
    twiddle = _along_first(np.exp(-0.5j * np.pi * np.arange(n) / n), signal.ndim)
    result = np.real(spectrum * twiddle) / np.sqrt(2.0 * n)
    result[0] /= np.sqrt(2.0)
    return np.asarray(result)


def idct2(coefficients: Array) -> Array:
    """Inverse of `dct2` along the first axis."""
    n = len(coefficients)
    scaled = coefficients * np.sqrt(2.0 * n)
    scaled[0] *= np.sqrt(2.0)
    twiddle = _along_first(np.exp(0.5j * np.pi * np.arange(n) / n), coefficients.ndim)
    # the mirrored signal's spectrum is zero at its Nyquist frequency
    spectrum = np.concatenate([scaled * twiddle, np.zeros_like(scaled[:1])])
    return np.asarray(np.fft.irfft(spectrum, 2 * n, axis=0)[:n])


def _along_first(vector: NDArray[np.complex128], ndim: int) -> NDArray[np.complex128]:
    return vector.reshape(-1, *([1] * (ndim - 1)))


def _filtered_spectrum(
    padded: Array, cutoff_hz: float, period_s: float
) -> tuple[NDArray[np.complex128], Array]:
    frequency = np.asarray(np.fft.rfftfreq(len(padded), period_s), dtype=np.float64)
    gain = 1.0 / (1.0 + (frequency / cutoff_hz) ** (2 * _ORDER))
    return np.fft.rfft(padded) * gain, frequency


def _pad(
    signal: Array, cutoff_hz: float, period_s: float, *, reflect_type: Literal["even", "odd"]
) -> tuple[Array, int]:
    """Reflect both ends until the wrap-around cannot be felt; a length that the FFT likes."""
    margin = int(np.ceil(_SETTLING_PERIODS / (cutoff_hz * period_s)))
    total = _fast_length(len(signal) + 2 * margin)
    widths = (margin, total - len(signal) - margin)
    return np.pad(signal, widths, mode="reflect", reflect_type=reflect_type), margin


def _fast_length(minimum: int) -> int:
    """Smallest product of 2, 3 and 5 that is not below the minimum."""
    best = 1 << (minimum - 1).bit_length()
    for threes in range(8):
        for fives in range(6):
            odd = 3**threes * 5**fives
            quotient = -(-minimum // odd)
            best = min(best, odd << max(quotient - 1, 0).bit_length())
    return best


def _end_matching_quintic(
    position: Array, cutoff_hz: float, period_s: float
) -> "np.polynomial.Polynomial":
    """Polynomial on [-1, 1] with the data's value, slope and curvature at both ends.

    The three are read from a cubic fitted over one and a half cut-off periods.
    """
    samples = len(position)
    window = int(np.clip(1.5 / (cutoff_hz * period_s), 8, samples // 2))
    x = np.linspace(-1.0, 1.0, samples)
    conditions, values = [], []
    for part, end in ((slice(0, window), -1.0), (slice(samples - window, samples), 1.0)):
        local = np.polynomial.Polynomial.fit(x[part], position[part], 3)
        for order in range(3):
            powers = [
                np.prod(np.arange(p, p - order, -1)) * end ** (p - order) if p >= order else 0.0
                for p in range(6)
            ]
            conditions.append(powers)
            values.append((local.deriv(order) if order else local)(end))
    return np.polynomial.Polynomial(np.linalg.solve(np.array(conditions), np.array(values)))

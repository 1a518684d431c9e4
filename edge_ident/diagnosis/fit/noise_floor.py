"""What noise alone would leave: the measure of every residual.

The larger of two: where the motion repeats, half the variance of what does not repeat (an encoder's
rounding repeats as well); and the noise of effort and encoder, both known from frequencies that no
motion reaches, through the filter. The latter is rather too much of the encoder's, whose rounding
is not all random: where the quickest changes of the base model's residual, second differences from
sample to sample, are smaller than those of such noise, the encoder's share is lowered to them. The
floor is never raised by a residual.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import Fitted
from edge_ident.diagnosis.prepare.masks import widened
from edge_ident.diagnosis.prepare.view import Stretch, View

Array = NDArray[np.float64]

_MISMATCH: Final = 0.01
"""Rms deviation of a repeated motion from itself, over its own rms, that counts as none."""
_FEWEST_PAIRS: Final = 30
_PEAKS: Final = 3
"""Of the autocorrelation, the shortest lags, that are looked at for a period."""
_LEAST_FREEDOM: Final = 0.2
_DOUBT: Final = 0.2
"""Relative uncertainty of noise that is not measured in the band itself."""
_TINY: Final = float(np.finfo(float).tiny)
_LOWEST_SHARE: Final = 0.05
"""Of the record: a shorter lag compares neighbours, not repeats."""


@dataclass(frozen=True)
class Floor:
    """Rms of the noise in the clear samples of the filtered effort.

    Attributes
    ----------
    rms : float
    uncertainty : float
        Relative standard deviation of it.
    source : str
        How it was found, in words.
    """

    rms: float
    uncertainty: float
    source: str


def noise_floor(view: View, start: Fitted, inertia: float = 0.0) -> Floor:
    """Find the noise floor.

    Parameters
    ----------
    start : Fitted
        The base model.
    inertia : float, optional
        By which the encoder's noise becomes effort, where the base model has none.
    """
    inertia = float(start.base[0]) or inertia
    repeated, measured = _from_repetition(view), _from_instruments(view, start, inertia)
    return repeated if repeated is not None and repeated.rms > measured.rms else measured


def _from_instruments(view: View, start: Fitted, inertia: float) -> Floor:
    """From the noise of effort and encoder, through the filter."""
    clear = view.clear
    left = (view.effort - start.predicted)[clear]
    freedom = max(1.0 - start.jacobian.shape[1] / len(left), _LEAST_FREEDOM)
    expected, quick, quick_expected, count = np.zeros(2), 0.0, np.zeros(2), 0
    for stretch, values in _parts(view, left / np.sqrt(freedom)):
        covariance = _noise_covariance(stretch, inertia)
        expected += covariance[:, 0] * np.count_nonzero(stretch.clear)
        three = stretch.clear[2:] & stretch.clear[1:-1] & stretch.clear[:-2]
        three &= np.diff(stretch.picks, 2) == 0
        bends = np.diff(values, 2)[three]
        quick += float(bends @ bends)
        quick_expected += len(bends) * (covariance @ [6.0, -8.0, 2.0])
        count += len(bends)
    encoder, uncertainty = 1.0, _DOUBT
    if count >= _FEWEST_PAIRS:
        share = (quick - quick_expected[0]) / max(float(quick_expected[1]), _TINY)
        encoder, uncertainty = float(np.clip(share, 0.0, 1.0)), 1.0 / np.sqrt(count)
    rms = float(np.sqrt((expected[0] + encoder * expected[1]) / np.count_nonzero(clear)))
    return Floor(rms, uncertainty, "from the noise of effort and encoder")


def _noise_covariance(stretch: Stretch, inertia: float) -> Array:
    """Covariance (2, 3) of the noise of effort and encoder in the filtered effort less model, at
    lags of 0, 1 and 2 picks."""
    share = np.linspace(0.0, 3.0, 601)
    encoder = 5.0 * share**4 * (inertia * stretch.acceleration_noise) ** 2
    density = np.stack([np.full_like(share, stretch.effort_noise**2), encoder])
    frequency_hz = share * stretch.cutoff_hz
    step_s = float(np.min(np.diff(stretch.picks))) * stretch.period_s
    waves = np.cos(np.arange(3)[:, None] * 2.0 * np.pi * frequency_hz * step_s)
    seen = density[:, None] * stretch.band.power(frequency_hz) * waves
    return np.asarray(np.trapezoid(seen, share, axis=-1))


def _parts(view: View, values: Array) -> list[tuple[Stretch, Array]]:
    """Values at the clear samples, recording by recording, with zeros where it is not clear."""
    whole = np.zeros(len(view.effort))
    whole[view.clear] = values
    ends = np.cumsum([len(s.picks) for s in view.stretches])[:-1]
    return list(zip(view.stretches, np.split(whole, ends), strict=True))


def _from_repetition(view: View) -> Floor | None:
    """From lap to lap, where a stretch repeats its motion."""
    sums, pairs = 0.0, 0
    for s in view.stretches:
        lag = _period(s)
        if lag is None:
            continue
        usable = np.zeros(len(s.effort), dtype=np.bool_)
        usable[s.picks[s.far]] = True
        both = np.flatnonzero(usable[:-lag] & _near(usable[lag:]))
        difference = s.effort[both + lag] - s.effort[both]
        sums += 0.5 * float(difference @ difference)
        pairs += len(both)
    if pairs < _FEWEST_PAIRS:
        return None
    uncertainty = 1.0 / np.sqrt(2.0 * pairs)
    return Floor(float(np.sqrt(sums / pairs)), uncertainty, "from the motion's repetition")


def _near(usable: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Samples between usable ones."""
    places = np.flatnonzero(usable)
    if len(places) < 2:
        return usable
    return widened(usable, int(np.median(np.diff(places))))


def _period(stretch: Stretch) -> int | None:
    """Lag, in samples, after which position and velocity come back."""
    motion = stretch.motion
    samples = len(motion.position)
    scale = [float(np.std(x)) for x in (motion.position, motion.velocity)]
    if min(scale) <= 0.0:
        return None
    best: tuple[float, int] | None = None
    for lag in _lags(motion.position, samples):
        off = max(
            float(np.sqrt(np.mean((x[lag:] - x[:-lag]) ** 2))) / deviation
            for x, deviation in zip((motion.position, motion.velocity), scale, strict=True)
        )
        if off < _MISMATCH and (best is None or off < best[0]):
            best = (off, lag)
    return best[1] if best else None


def _lags(position: Array, samples: int) -> NDArray[np.intp]:
    """Peaks of the autocorrelation, between a twentieth and three quarters of the record."""
    x = position - np.mean(position)
    correlation = scipy.signal.correlate(x, x, "full", "fft")[samples - 1 :]
    overlap = np.arange(samples, 0, -1)
    peaks, _ = scipy.signal.find_peaks(correlation / overlap)
    peaks = peaks[(peaks > _LOWEST_SHARE * samples) & (peaks < 0.75 * samples)]
    # the peaks of what is but a few laps lie a little beside the period
    nearby = [np.arange(int(0.97 * peak), int(1.03 * peak) + 1) for peak in peaks[:_PEAKS]]
    return np.unique(np.concatenate(nearby)) if nearby else peaks

"""The noise floor: the residual that noise alone leaves, against which every residual is judged.

It is the larger of two estimates. Where the motion repeats: half the variance of the difference
between laps, less what drifts, because encoder rounding repeats as well. Otherwise: the noise of
effort and encoder through the filter, both known from frequencies that no motion reaches. The
second estimate overstates the encoder noise, because rounding is not entirely random. So the
encoder's part is lowered where the second differences of the base model's residual are smaller than
it predicts. A residual never raises the floor. Noise is no more than what a model leaves: laps
differ also by what another axis does, and stamps that jitter look like noise of the effort.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment, once
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.conditioning import unit_length, widened
from edge_ident.signals.filters import fast_length

Array = NDArray[np.float64]

_MISMATCH: Final = 0.01
"""Rms deviation between laps, over the rms of the motion, below which the motion repeats."""
_FEWEST_PAIRS: Final = 30
_PEAKS: Final = 3
"""Peaks of the autocorrelation, at the shortest lags, that are tried as a period."""
_LEAST_FREEDOM: Final = 0.2
_UNMEASURED: Final = 0.2
"""Relative uncertainty of noise that is not measured inside the band."""
_STANDS_OUT: Final = 6.0
"""Energy of a block of time, of the median's, beyond which it is no noise: of noise so slow that a
block holds two independent samples, one block in sixty."""
_CORNERS: Final = 2.0
"""Corners of a drift in a lap."""
_ROUNDS: Final = 4
"""Fits of what drifts, each without the blocks that stood out in the one before."""
_RANK: Final = 1e-7
_TINY: Final = float(np.finfo(float).tiny)
_LOWEST_SHARE: Final = 0.05
"""Shortest lag, of the record: a shorter one compares neighbours, not laps."""


@dataclass(frozen=True)
class NoiseFloor:
    """Rms of the noise in the valid samples of the filtered effort.

    Attributes
    ----------
    uncertainty : float
        Relative standard deviation of the rms.
    source : str
        How it was determined, in words.
    """

    rms: float
    uncertainty: float
    source: str

    def at_most(self, left: float) -> "NoiseFloor":
        """The floor, or the rms that a model leaves where that is less."""
        if left >= self.rms:
            return self
        return replace(self, rms=left, source="from what the model leaves")


def noise_floor(data: AxisData, start: FittedModel, inertia: float = 0.0) -> NoiseFloor:
    """Estimate the noise floor of the filtered effort.

    Parameters
    ----------
    inertia : float, optional
        Inertia that turns encoder noise into effort, where the base model has none.
    """
    inertia = float(start.base[0]) or inertia
    repeated, measured = _from_repetition(data, start), _from_instruments(data, start, inertia)
    return repeated if repeated is not None and repeated.rms > measured.rms else measured


def rms_left(data: AxisData, model: FittedModel, samples: float) -> float:
    """Rms that a model would leave of independent samples, so many, to which it was not fitted."""
    freedom = max(1.0 - model.jacobian.shape[1] / samples, _LEAST_FREEDOM)
    return float(np.sqrt(model.error / freedom / np.count_nonzero(data.valid)))


def _from_instruments(data: AxisData, start: FittedModel, inertia: float) -> NoiseFloor:
    """Estimate from the noise of effort and encoder, through the filter."""
    valid = data.valid
    left = (data.effort - start.predicted)[valid]
    freedom = max(1.0 - start.jacobian.shape[1] / len(left), _LEAST_FREEDOM)
    expected, energy, predicted_energy, count = np.zeros(2), 0.0, np.zeros(2), 0
    for segment, values in _parts(data, left / np.sqrt(freedom)):
        covariance = _noise_covariance(segment, inertia)
        expected += covariance[:, 0] * np.count_nonzero(segment.valid)
        three = segment.valid[2:] & segment.valid[1:-1] & segment.valid[:-2]
        three &= np.diff(segment.sample_index, 2) == 0
        second_differences = np.diff(values, 2)[three]
        energy += float(second_differences @ second_differences)
        predicted_energy += len(second_differences) * (covariance @ [6.0, -8.0, 2.0])
        count += len(second_differences)
    encoder, uncertainty = 1.0, _UNMEASURED
    if count >= _FEWEST_PAIRS:
        most = max(float(predicted_energy[1]), _TINY)
        encoder = float(np.clip(energy - predicted_energy[0], 0.0, most)) / most
        uncertainty = 1.0 / np.sqrt(count)
    rms = float(np.sqrt((expected[0] + encoder * expected[1]) / np.count_nonzero(valid)))
    return NoiseFloor(rms, uncertainty, "from the noise of effort and encoder")


def _noise_covariance(segment: Segment, inertia: float) -> Array:
    """Covariance (2, 3) of the noise of effort and encoder in the filtered residual, at lags of 0,
    1 and 2 compared samples."""
    share = np.linspace(0.0, 3.0, 601)
    encoder = 5.0 * share**4 * (inertia * segment.acceleration_noise) ** 2
    density = np.stack([np.full_like(share, segment.effort_noise**2), encoder])
    frequency_hz = share * segment.cutoff_hz
    step_s = float(np.min(np.diff(segment.sample_index))) * segment.period_s
    waves = np.cos(np.arange(3)[:, None] * 2.0 * np.pi * frequency_hz * step_s)
    seen = density[:, None] * segment.band.power(frequency_hz) * waves
    return np.asarray(np.trapezoid(seen, share, axis=-1))


def _parts(data: AxisData, values: Array) -> list[tuple[Segment, Array]]:
    """Values at the valid samples, recording by recording, with zeros at the others."""
    whole = np.zeros(len(data.effort))
    whole[data.valid] = values
    return list(zip(data.segments, data.by_segment(whole), strict=True))


def _from_repetition(data: AxisData, start: FittedModel) -> NoiseFloor | None:
    """Estimate from the difference between laps, where a recording repeats its motion.

    Drift, warm-up and a changing payload differ between laps as well, and are no noise: they move
    the base model's coefficients steadily, so that is fitted and taken out lap by lap. An event is
    in few blocks of time: blocks that stand out do not count.
    """
    energy, count = 0.0, 0
    columns = data.by_segment(start.jacobian[:, : len(PARAMETERS)])
    blocks = data.by_segment(data.block)
    for s, column, block in zip(data.segments, columns, blocks, strict=True):
        lag = kept_period(s)
        if lag is None or not len(places := _paired(s, lag)):
            continue
        here = s.sample_index[places]
        difference = s.effort[here + lag] - s.effort[here]
        left = _unsteady(difference, column[places], here / lag, block[places])
        energy += 0.5 * float(left @ left)
        count += len(left)
    if count < _FEWEST_PAIRS:
        return None
    uncertainty = 1.0 / np.sqrt(2.0 * count)
    return NoiseFloor(float(np.sqrt(energy / count)), uncertainty, "from the motion's repetition")


def _paired(segment: Segment, lag: int) -> NDArray[np.intp]:
    """Compared samples, far from reversals here and a lap later."""
    usable = np.zeros(len(segment.effort), dtype=np.bool_)
    usable[segment.sample_index[segment.far]] = True
    both = np.zeros(len(usable), dtype=np.bool_)
    both[:-lag] = usable[:-lag] & _near(usable[lag:])
    return np.flatnonzero(both[segment.sample_index])


def _unsteady(difference: Array, columns: Array, laps: Array, block: NDArray[np.intp]) -> Array:
    """What no drift explains of a difference (m,) between laps, at the blocks that are alike.

    Parameters
    ----------
    columns : (m, P) array
        Their coefficients may change: broken lines over time, with a corner every half lap.
    laps : (m,) array
        Laps since the start.
    block : (m,) array of int
        Numbers of the blocks of time.
    """
    corners = np.arange(np.floor(_CORNERS * laps[0]), _CORNERS * laps[-1] + 1.0)
    hats = np.maximum(1.0 - np.abs(_CORNERS * laps[:, None] - corners), 0.0)
    moving = (columns[:, :, None] * hats[:, None]).reshape(len(difference), -1)
    alike = np.ones(len(difference), dtype=np.bool_)
    left = difference
    for _ in range(_ROUNDS):
        left = _without(difference, moving, alike)
        energy = np.bincount(block, left**2) / np.maximum(np.bincount(block), 1)
        limit = _STANDS_OUT * float(np.median(energy[np.unique(block[alike])]))
        alike = energy[block] <= limit
    return np.asarray(left[alike])


def _without(difference: Array, columns: Array, alike: NDArray[np.bool_]) -> Array:
    """A difference (m,) without columns (m, P) that are fitted where samples are alike.

    It is as large as if no degree of freedom had been fitted.
    """
    unit = unit_length(columns)[0]
    solution, _, rank, _ = np.linalg.lstsq(unit[alike], difference[alike], rcond=_RANK)
    freedom = max(1.0 - float(rank) / max(int(np.count_nonzero(alike)), 1), _LEAST_FREEDOM)
    return np.asarray((difference - unit @ solution) / np.sqrt(freedom))


def _near(usable: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Usable samples and those between them."""
    places = np.flatnonzero(usable)
    if len(places) < 2:
        return usable
    return widened(usable, int(np.median(np.diff(places))))


def kept_period(segment: Segment) -> int | None:
    """The period of a motion, looked for once."""
    return once(segment.cache, _period, lambda: _period(segment))


def _period(segment: Segment) -> int | None:
    """Lag, in samples, after which position and velocity repeat."""
    motion = segment.motion
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
    correlation = lagged_products(position - np.mean(position)) / np.arange(samples, 0, -1)
    rises = np.diff(correlation) > 0.0
    peaks = np.flatnonzero(rises[:-1] & ~rises[1:]) + 1
    peaks = peaks[(peaks > _LOWEST_SHARE * samples) & (peaks < 0.75 * samples)]
    # with few laps the peaks lie a little beside the period
    nearby = [np.arange(int(0.97 * peak), int(1.03 * peak) + 1) for peak in peaks[:_PEAKS]]
    return np.unique(np.concatenate(nearby)) if nearby else peaks


def lagged_products(signal: Array) -> Array:
    """Products (N,) of a signal (N,) with itself so many samples later."""
    size = fast_length(2 * len(signal))
    power = np.abs(np.fft.rfft(signal, size)) ** 2
    return np.asarray(np.fft.irfft(power, size)[: len(signal)])

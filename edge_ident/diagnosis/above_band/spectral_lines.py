"""Periodograms over time and over position, and the peaks that noise does not reach.

The ordinates of a periodogram of noise are exponentially distributed about the local power density
(Brillinger 1981, Time Series, theorem 5.2.6). So the highest of n ordinates exceeds ln(n/p) times
that density with probability p. The density is measured beside the peak, by a running median.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray

Array = NDArray[np.float64]

FALSE_ALARM: Final = 1e-3
"""Probability that noise alone makes a line anywhere in a spectrum."""
_OVERSAMPLED: Final = 2
"""Ordinates per resolution cell."""
CELLS: Final = 48
"""Resolution cells in a block of the running median. Its density is then known to 20 %."""
REPEATED: Final = 4.0
"""Factor on the noise level at harmonics of the motion: what repeats with it is not exponentially
distributed, and a second lap is no second look."""
_FEWEST_HARMONICS: Final = 24
"""Harmonics of the motion among which their level is measured."""
_BINS_PER_WAVE: Final = 8
"""Bins of position in the shortest wave: they lose 3 % of its amplitude."""
_REFINED: Final = 81
"""Places about an ordinate at which a peak is computed."""
_PARTS: Final = 256
"""Parts of the record over which the phase of a peak is followed."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Periodogram:
    """Power of the sinusoids in a signal.

    Attributes
    ----------
    rate : (F,) array
        Angular: rad/s over time, rad per unit of position over position.
    power : (F,) array
        Energy that a sinusoid of that rate explains.
    level : (F,) array
        Mean power of the noise about it.
    cell : float
        Resolution of the rate.
    """

    rate: Array
    power: Array
    level: Array
    cell: float

    @property
    def prominence(self) -> Array:
        """Power over the highest that noise reaches, (F,); a line exceeds one."""
        highest = np.log(max(len(self.rate), 1) / FALSE_ALARM)
        return np.asarray(self.power / (np.maximum(self.level, _TINY) * highest))

    def beside_harmonics(self, fundamental: float) -> "Periodogram":
        """The same with the noise at harmonics of a rate measured at harmonics alone.

        What repeats with the motion is no line beside it. Often half of the harmonics are
        empty, so their upper quartile is taken.
        """
        step = self.rate[1] - self.rate[0]
        numbers = np.arange(np.ceil(self.rate[0] / fundamental), self.rate[-1] // fundamental + 1)
        at = np.clip(np.round((numbers * fundamental - self.rate[0]) / step), 0, len(self.rate) - 1)
        harmonics = self.power[at.astype(np.intp)]
        if not len(harmonics):
            return self
        half = int(np.ceil(CELLS * self.cell / fundamental / 2.0))
        half = min(max(half, _FEWEST_HARMONICS // 2), (len(harmonics) - 1) // 2)
        windows = np.lib.stride_tricks.sliding_window_view(
            np.pad(harmonics, half, mode="reflect"), 2 * half + 1
        )
        level = np.quantile(windows, 0.75, axis=1) / np.log(4.0)
        off = np.abs(self.rate / fundamental - np.round(self.rate / fundamental)) * fundamental
        on = np.interp(self.rate, numbers * fundamental, level)
        raised = np.where(off < self.cell, REPEATED * np.maximum(self.level, on), self.level)
        return replace(self, level=raised)

    def rate_std(self, power: float, level: float) -> float:
        """Standard deviation of the rate of a peak: Cramér-Rao (Rife and Boorstyn, IEEE Trans.
        Information Theory 20 (1974) 591)."""
        return float(np.sqrt(1.5 * level / power) * self.cell / np.pi)


def over_time(
    signal: Array, weight: Array, period_s: float, lowest: float, highest: float
) -> Periodogram:
    """Periodogram over time.

    Parameters
    ----------
    signal, weight : (N,) arrays
        The weight is that of the samples in the signal: a sinusoid in it is multiplied by it.
    lowest, highest : float
        Range of the rate, rad/s.
    """
    cell = 2.0 * np.pi / (period_s * len(signal))
    length = scipy.fft.next_fast_len(_OVERSAMPLED * len(signal), real=True)
    spectrum = np.fft.rfft(weight * signal, length)
    rate = 2.0 * np.pi / (period_s * length) * np.arange(len(spectrum))
    power = np.abs(spectrum) ** 2 / max(float(weight @ weight), _TINY)
    inside = (rate >= lowest) & (rate <= highest)
    found = _of(rate[inside], power[inside], cell)
    # noise that falls steeply is no line where it is highest
    return replace(found, level=np.maximum(found.level, local_level(found.power, CELLS // 2)))


def over_position(signal: Array, position: Array, energy_at: tuple[Array, Array]) -> Periodogram:
    """Periodogram over position, of a signal that need not move evenly or one way.

    Parameters
    ----------
    signal : (N,) array
        Multiplied by the conjugate of what multiplies a sinusoid in it.
    position : (N,) array
    energy_at : two (F,) arrays
        Rates, and the energy of a sinusoid of amplitude one at them; zero where none is searched.
    """
    highest = float(energy_at[0][-1])
    start, travel = float(np.min(position)), max(float(np.ptp(position)), _TINY)
    cell = 2.0 * np.pi / travel
    bins = int(np.ceil(_BINS_PER_WAVE * highest / cell)) + 1
    index = np.minimum(((position - start) * (bins / travel)).astype(np.intp), bins - 1)
    binned = np.bincount(index, signal, bins)
    length = scipy.fft.next_fast_len(_OVERSAMPLED * bins, real=True)
    spectrum = np.fft.rfft(binned, length)
    rate = cell * bins / length * np.arange(len(spectrum))
    energy = np.interp(rate, *energy_at, left=0.0, right=0.0)
    inside = energy > 0.0
    power = np.abs(spectrum[inside]) ** 2 / energy[inside]
    return _of(rate[inside], power, cell)


def local_level(power: Array, cells: int = CELLS) -> Array:
    """Mean of exponentially distributed ordinates (F,), by a running median over so many cells."""
    half = cells * _OVERSAMPLED // 2
    blocks = len(power) // half
    if blocks < 2:
        return np.full(len(power), np.median(power) / np.log(2.0) if len(power) else 0.0)
    whole = power[: blocks * half].reshape(blocks, half)
    medians = np.median(np.hstack([whole[:-1], whole[1:]]), axis=1) / np.log(2.0)
    centres = half * np.arange(1, blocks)
    return np.asarray(np.interp(np.arange(len(power)), centres, medians))


def refined(signal: Array, along: Array, rate: float, cell: float) -> float:
    """The rate (rad per unit of `along`) of a peak, between the ordinates beside it."""
    start, length = float(np.min(along)), max(float(np.ptp(along)), _TINY)
    index = ((along - start) * (_PARTS / length)).astype(np.intp)
    turned = signal * np.exp(-1j * rate * along)
    parts = np.bincount(index, turned.real) + 1j * np.bincount(index, turned.imag)
    centre = length / _PARTS * np.arange(len(parts))
    off = cell / _OVERSAMPLED * np.linspace(-1.0, 1.0, _REFINED)
    power = np.abs(np.exp(-1j * np.outer(off, centre)) @ parts)
    return rate + float(off[np.argmax(power)])


def _of(rate: Array, power: Array, cell: float) -> Periodogram:
    return Periodogram(rate, power, local_level(power), cell)

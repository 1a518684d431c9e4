"""A sinusoid above the band whose frequency moves, found window by window.

The spectrum of a whole recording spreads a sweep over every frequency that it passes, so no
ordinate stands out. In a window that is short beside the sweep, one does. The ordinates of noise in
a window are exponentially distributed about the local power density (`spectral_lines`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.sinusoid_search import Peak, columns
from edge_ident.diagnosis.above_band.spectrum import (
    FALSE_ALARM,
    WIDEST,
    WideSignals,
    least_squares,
    local_level,
    over_time,
)
from edge_ident.diagnosis.measures import SpectralLine
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.model import AxisModel, Model
from edge_ident.signals.filters import lowpass
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]


_SHORTEST: Final = 64
"""Samples in the shortest window; each longer one is twice as long."""
_FEWEST: Final = 12
"""Windows, and ordinates in each: fewer do not show what is usual."""
_KNOWN: Final = 0.75
"""Share of a window in which the direction of motion is known."""
_FROM: Final = 1.25
"""Lowest frequency, of the cut-off: just above it, what the comparison passes is not noise."""
_BESIDE: Final = 24
"""Ordinates on either side that give the level of the noise in a window, as over a whole record."""
_LOBE: Final = 2
"""Ordinates on either side of a peak that its window spreads it over."""
_MEMORY: Final = 16
"""Samples by which a controller's answer to the position may come early or late."""
_SEEN: Final = (1 / 3, 1 / 8)
"""Shares of all windows, and of either half of them, that must show the sinusoid."""
_HARMONICS: Final = 3
"""Of an order, whose tones windows may show by turns."""
_TRIED: Final = 100
"""Windows from which an order is guessed; if half keep to one, some of these do."""
_MOST: Final = 0.5
"""Share of the windows that show the sinusoid, which decides what it is."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class MovingLine:
    """A sinusoid in time that moves in frequency.

    Attributes
    ----------
    lowest_hz, highest_hz : float
        Between which it was seen; one window in twenty is beyond either.
    amplitude, std : float
        Where it was seen, in the unit of the effort. The standard deviation is that of its mean
        over the windows.
    share : float
        Rms over the rms of the recorded effort.
    """

    lowest_hz: float
    highest_hz: float
    amplitude: float
    std: float
    share: float


def moving_line(wide: WideSignals, peaks: list[Peak], without_inertia: Array) -> MovingLine | None:
    """The strongest sinusoid of moving frequency; None where there is none.

    It changes from one window to the next by no more than its width, and does not keep to the
    speed: what does is an order of the mechanics, or of an encoder.

    Parameters
    ----------
    wide : WideSignals
    peaks : list of Peak
        Orders and lines that were found before; they are taken out.
    without_inertia : (N,) array
        Effort above the band, as the first of `accounts.accounts`.
    """
    left = _left(wide, peaks, without_inertia)
    found = []
    samples = _SHORTEST
    while len(left) // samples >= _FEWEST:
        one = _in_windows(wide, left, samples)
        if one is not None:
            found.append(one)
        samples *= 2
    return max(found, key=lambda one: one.share, default=None)


def _left(wide: WideSignals, peaks: list[Peak], without_inertia: Array) -> Array:
    """Effort above the band (N,) without inertia, peaks, and what follows from the position.

    A controller answers the noise of an encoder with tones that move with the speed.
    """
    fast = wide.position - lowpass(wide.position, wide.cutoff_hz, wide.period_s)
    ends = math.ceil(1.0 / (wide.cutoff_hz * wide.period_s))
    fast[:ends] = fast[-ends:] = 0.0
    shifted = np.lib.stride_tricks.sliding_window_view(np.pad(fast, _MEMORY), len(fast))
    rows = np.concatenate([wide.above(columns(wide, peaks)), wide.weight * shifted])
    return np.asarray(without_inertia - least_squares(rows, without_inertia) @ rows)


def _in_windows(wide: WideSignals, left: Array, samples: int) -> MovingLine | None:
    """The sinusoid that windows of so many samples show."""
    known = _windows(wide.weight, samples).mean(axis=1) > _KNOWN
    taper = np.hanning(samples)
    spectrum = np.fft.rfft(_windows(left, samples)[known] * taper, axis=1)
    frequency = np.asarray(np.fft.rfftfreq(samples, wide.period_s), dtype=np.float64)
    inside = (frequency > _FROM * wide.cutoff_hz) & (frequency < WIDEST / wide.period_s)
    frequency, power = frequency[inside], np.abs(spectrum[:, inside]) ** 2
    if min(power.shape) < _FEWEST:
        return None
    level = _level(power)
    place = np.argmax(power / level, axis=1)
    ratio = np.max(power / level, axis=1)
    seen = ratio > np.log(len(frequency) / FALSE_ALARM)
    halves = np.array_split(seen, 2)
    if np.mean(seen) < _SEEN[0] or min(np.mean(half) for half in halves) < _SEEN[1]:
        return None
    speed = np.abs(_windows(wide.velocity, samples)[known]).mean(axis=1)
    if not _moves_alone(frequency[place[seen]], speed[seen], frequency[1] - frequency[0]):
        return None
    energy = np.array([_energy(power[k] - level[k], place[k]) for k in np.flatnonzero(seen)])
    # energy of a sinusoid of amplitude one, under the taper
    unit = samples * float(taper @ taper) / 4.0
    amplitude = float(np.sqrt(max(float(np.mean(energy)), 0.0) / unit))
    spread = float(np.std(energy)) / math.sqrt(len(energy)) / unit
    lowest_hz, highest_hz = np.quantile(frequency[place[seen]], [0.05, 0.95])
    return MovingLine(
        lowest_hz=float(lowest_hz),
        highest_hz=float(highest_hz),
        amplitude=amplitude,
        std=0.5 * spread / max(amplitude, _TINY),
        share=amplitude / math.sqrt(2.0) / max(rms(wide.effort), _TINY),
    )


def _windows(signal: Array, samples: int) -> Array:
    """A signal (N,) cut into windows (W, samples)."""
    whole = len(signal) // samples * samples
    return signal[:whole].reshape(-1, samples)


def _level(power: Array) -> Array:
    """Power density of the noise in every window (W, F).

    That of its frequency in most windows, and more where a window is louder about it.
    """
    usual = np.maximum(np.median(power, axis=0) / np.log(2.0), _TINY)
    reach = min(_BESIDE, power.shape[1] // 2 - 1)
    padded = np.pad(power / usual, ((0, 0), (reach, reach)), mode="reflect")
    beside = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1, axis=1)
    return np.asarray(np.maximum(np.median(beside, axis=2) / np.log(2.0), 1.0) * usual)


def _moves_alone(frequency: Array, speed: Array, width: float) -> bool:
    """Whether frequencies of successive windows go on, and are no harmonics of one order."""
    goes_on = np.mean(np.abs(np.diff(frequency)) < (_LOBE + 0.5) * width)
    return bool(goes_on > _MOST) and not any(
        _kept(frequency, speed, order, width) >= _MOST for order in _orders(frequency, speed)
    )


def _orders(frequency: Array, speed: Array) -> Array:
    """Orders of which a window may show a harmonic, for some windows spread over all."""
    some = np.linspace(0, len(frequency) - 1, min(len(frequency), _TRIED)).astype(np.intp)
    moving = np.maximum(speed[some], _TINY)
    return np.ravel(frequency[some] / np.outer(np.arange(1, _HARMONICS + 1), moving))


def _kept(frequency: Array, speed: Array, order: float, width: float) -> float:
    """Share of the windows that show a harmonic of an order."""
    harmonics = np.outer(np.arange(1, _HARMONICS + 1), order * speed)
    return float(np.mean(np.any(np.abs(frequency - harmonics) < width, axis=0)))


def _energy(above: Array, place: int) -> float:
    """Energy of a peak beyond the noise."""
    return float(np.sum(above[max(place - _LOBE, 0) : place + _LOBE + 1]))


# Whether another motion of the same machine holds a line above the band that one recording showed.
#
# What shakes the machine from outside does so during any motion, and a wave over the position is
# there whenever the axis passes it. What comes from the motion itself, such as the controller's
# answer to friction at its reversals, is gone in another one.


_HALF: Final = 0.5
"""Of its amplitude, which a line must have in the other recording."""
_CERTAIN: Final = 3.0
"""Standard deviations of an amplitude by which it must miss that."""
_CELLS: Final = 48
"""Resolution cells to either side of an order, among which its noise is measured."""


def held(
    recording: Recording, name: str, lines: Sequence[SpectralLine], axis: AxisModel
) -> tuple[SpectralLine, ...]:
    """Those of the lines that another recording showed which this one may hold, too.

    Parameters
    ----------
    recording : Recording
    name : str
        Of the axis.
    lines : sequence of SpectralLine
        Of constant frequency.
    axis : AxisModel
        What both recordings agree on.

    Returns
    -------
    tuple of SpectralLine
        Without those of which half of the amplitude would stand out of the noise, and does not.
    """
    if not lines:
        return ()
    [segment] = prepare_axis([recording], name).segments
    wide = WideSignals.of(recording, name, segment, Model({name: axis}))
    left = wide.weight * (wide.effort - axis.parameters[0] * wide.clean_acceleration)
    rows = wide.weight * wide.base[1:]
    left = left - least_squares(rows, left) @ rows
    limits = math.tau * segment.band.cutoff_hz, math.tau * WIDEST / wide.period_s
    found = over_time(left, wide.weight, wide.period_s, *limits)
    energy = 0.5 * float(wide.weight @ wide.weight)
    power, level = np.asarray(found.power / energy), np.asarray(found.level / energy)
    seen = _Seen(found.rate, power, level, found.cell)
    rates = [math.tau * (line.frequency_hz or 0.0) for line in lines]
    return tuple(
        line for line, rate in zip(lines, rates, strict=True) if seen.may_hold(rate, line.amplitude)
    )


def may_hold_order(wide: WideSignals, above: Array, rate: float, amplitude: float) -> bool:
    """Whether a recording may hold an order that another one showed.

    Parameters
    ----------
    wide : WideSignals
    above : (N,) array
        What is left of its effort above the band.
    rate : float
        rad per unit of position.
    amplitude : float
    """
    cell = math.tau / float(np.ptp(wide.position))
    steps = np.arange(-2 * _CELLS, 2 * _CELLS + 1, dtype=np.float64)
    rates = np.asarray(rate + 0.5 * cell * steps, dtype=np.float64)
    rates = rates[rates > 0.0]
    near = rates[np.abs(rates - rate) < cell]
    without_noise = _Seen(near, _powers(wide, above, near), np.zeros(len(near)), cell)
    if without_noise.may_hold(rate, amplitude):  # whatever the noise is
        return True
    power = _powers(wide, above, rates)
    return _Seen(rates, power, local_level(power), cell).may_hold(rate, amplitude)


def _powers(wide: WideSignals, above: Array, rates: Array) -> Array:
    """Squared amplitudes (F,) of the orders that fit an effort above the band (N,) best."""
    waves = (wide.above(wide.waves(wide.position, float(rate))) for rate in rates)
    return np.array([np.sum(least_squares(pair, above) ** 2) for pair in waves])


@dataclass(frozen=True)
class _Seen:
    """Squared amplitudes of the sinusoids in a recording, and those of noise: (F,) each."""

    rate: Array
    power: Array
    level: Array
    cell: float

    def may_hold(self, rate: float, amplitude: float) -> bool:
        """Whether half of that amplitude may be there.

        Half of the power of noise is in phase with a sinusoid and changes its amplitude.
        """
        near = np.abs(self.rate - rate) < self.cell
        if not np.any(near):
            return True
        seen, std = np.sqrt([np.max(self.power[near]), 0.5 * np.max(self.level[near])])
        return bool(seen + _CERTAIN * std > _HALF * amplitude)

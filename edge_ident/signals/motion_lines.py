"""Lines in the spectrum of a motion: its frequencies, where it is a sum of a few sinusoids."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ONE_LINE: Final = 0.9
"""Share of a velocity's variance in one line, from which the other frequencies together move an
axis by less than a third as much."""
_FINER: Final = 4
"""Frequencies tried in each step of the record's resolution: a peak is lower by 3 % at most."""
_STRONG: Final = 0.01
"""Share of a signal's power from which a line belongs to the motion. What shakes an axis from
outside moves it far less than its drive does."""
_MOST: Final = 40
"""Lines that are looked for."""
_ORDERS: Final = 3
"""Harmonics of each line that friction and play add: even ones and odd ones."""
_DOMINANT: Final = 0.1
"""Share of the power from which a line's harmonics and combinations are considered."""
_NARROW: Final = 0.5
"""Distance from any line that belongs to it, of the resolution of the record."""
_WIDE: Final = 1.5
"""The same for strong lines, whose feet are wide, and what friction adds."""
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

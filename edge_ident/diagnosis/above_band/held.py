"""Whether another motion of a machine holds a line above the band that one recording showed.

What shakes the machine from outside does so during any motion, and a wave over the position is
there whenever the axis passes it. What comes from the motion itself, such as the controller's
answer to friction at its reversals, is gone in another one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.spectrum import (
    NONZERO,
    WIDEST,
    WideSignals,
    least_squares,
    local_level,
    over_time,
)
from edge_ident.diagnosis.measures import SpectralLine
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.model import AxisModel, Model
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]

_HALF: Final = 0.5
"""Of its amplitude, which a line must have in the other recording."""
_CELLS: Final = 48
"""Resolution cells to either side of an order, among which its noise is measured."""


def held(
    recording: Recording, name: str, lines: Sequence[SpectralLine], axis: AxisModel
) -> tuple[SpectralLine, ...]:
    """Those of the lines that another recording showed which this one may hold, too.

    Parameters
    ----------
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
    above : (N,) array
        What is left of its effort above the band.
    rate : float
        rad per unit of position.
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
        return bool(seen + NONZERO * std > _HALF * amplitude)

"""Whether another motion of the same machine holds a line above the band that one recording showed.

What shakes the machine from outside does so during any motion, and a wave over the position is
there whenever the axis passes it. What comes from the motion itself, such as the controller's
answer to friction at its reversals, is gone in another one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.spectral_lines import local_level, over_time
from edge_ident.diagnosis.fit.wide_search import least_squares
from edge_ident.diagnosis.fit.wide_signals import WIDEST, WideSignals
from edge_ident.diagnosis.measures import SpectralLine
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.model import AxisModel, Model
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]

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
        Orders, or of constant frequency.
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
    per_order = 1.0 if axis.position_unit == "rad" else math.tau
    over = _Seen.over_time(wide, left, segment.band.cutoff_hz)

    def may_hold(line: SpectralLine) -> bool:
        if line.order is not None:
            rate = per_order * line.order
            return _Seen.over_position(wide, left, rate).may_hold(rate, line.amplitude)
        assert line.frequency_hz is not None
        return over.may_hold(math.tau * line.frequency_hz, line.amplitude)

    return tuple(filter(may_hold, lines))


@dataclass(frozen=True)
class _Seen:
    """Amplitudes of the sinusoids in a recording, and their standard deviations: (F,) each.

    Half of the power of noise is in phase with a sinusoid and changes its amplitude.
    """

    rate: Array
    amplitude: Array
    std: Array
    cell: float

    @classmethod
    def over_time(cls, wide: WideSignals, left: Array, cutoff_hz: float) -> Self:
        """Above the cut-off of the comparison."""
        limits = math.tau * cutoff_hz, math.tau * WIDEST / wide.period_s
        found = over_time(left, wide.weight, wide.period_s, *limits)
        energy = 0.5 * float(wide.weight @ wide.weight)
        seen, std = np.sqrt(np.stack([found.power, 0.5 * found.level]) / energy)
        return cls(found.rate, seen, std, found.cell)

    @classmethod
    def over_position(cls, wide: WideSignals, left: Array, rate: float) -> Self:
        """About a rate, rad per unit of position."""
        cell = math.tau / float(np.ptp(wide.position))
        rates = rate + 0.5 * cell * np.arange(-2 * _CELLS, 2 * _CELLS + 1)
        rates = rates[rates > 0.0]
        effort = wide.above(left)
        power = np.empty(len(rates))
        for n, one in enumerate(rates):
            waves = wide.above(wide.waves(wide.position, float(one)))
            power[n] = np.sum(least_squares(waves, effort) ** 2)
        std = np.asarray(np.sqrt(0.5 * local_level(power)))
        return cls(np.asarray(rates), np.asarray(np.sqrt(power)), std, cell)

    def may_hold(self, rate: float, amplitude: float) -> bool:
        """Whether half of that amplitude may be there."""
        near = np.abs(self.rate - rate) < self.cell
        if not np.any(near):
            return True
        seen, std = np.max(self.amplitude[near]), np.max(self.std[near])
        return bool(seen + _CERTAIN * std > _HALF * amplitude)

"""Whether another motion of the same machine holds a line above the band that one recording showed.

What shakes the machine from outside does so during any motion. What comes from the motion itself,
such as the controller's answer to friction at its reversals, is gone in another one.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from edge_ident.diagnosis.fit.spectral_lines import Periodogram, over_time
from edge_ident.diagnosis.fit.wide_search import least_squares
from edge_ident.diagnosis.fit.wide_signals import WIDEST, WideSignals
from edge_ident.diagnosis.measures import SpectralLine
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.model import AxisModel, Model
from edge_ident.signals.recording import Recording

_HALF: Final = 0.5
"""Of its amplitude, which a line must have in the other recording."""
_CERTAIN: Final = 3.0
"""Noise levels by which it must miss that."""


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
    return tuple(line for line in lines if _may_hold(found, line, energy))


def _may_hold(found: Periodogram, line: SpectralLine, energy: float) -> bool:
    """Whether a periodogram may hold a line; `energy` is that of a sinusoid of amplitude one."""
    assert line.frequency_hz is not None
    near = np.abs(found.rate - math.tau * line.frequency_hz) < found.cell
    if not np.any(near):
        return True
    seen, noise = np.sqrt([np.max(found.power[near]), np.max(found.level[near])])
    return bool(seen + _CERTAIN * noise > _HALF * line.amplitude * np.sqrt(energy))

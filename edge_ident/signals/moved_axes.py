"""Which axes of a recording move, and which rest."""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.encoder import position_noise
from edge_ident.signals.recording import AxisRecord, PassiveAxis, Recording

MINIMUM_COUNTS: Final = 50
"""Travel, in encoder counts, below which a motion cannot be told from quantization."""
MINIMUM_NOISES: Final = 20.0
"""Travel, in standard deviations of white position noise, below which there is no motion."""


def resting_as_passive(recording: Recording) -> Recording:
    """A recording whose axes at rest are passive, where another one moves.

    Friction holds an axis at rest against any effort up to its level, so its effort tells nothing.
    Its position does: nothing comes from there. An axis that was told to move is kept: a check then
    says that it did not.
    """
    passive = {
        name: PassiveAxis(axis.position, axis.position_unit)
        for name, axis in recording.axes.items()
        if _rests(axis)
    }
    axes = {name: axis for name, axis in recording.axes.items() if name not in passive}
    if not axes:
        return recording
    return replace(recording, axes=axes, passive={**recording.passive, **passive})


def _rests(axis: AxisRecord) -> bool:
    if axis.reference is not None and np.ptp(axis.reference) > 0.0:
        return False
    return not moves(axis.position) or only_noise(axis.position)


def moves(position: NDArray[np.float64]) -> bool:
    """Whether a position (N,) goes through enough counts of its encoder."""
    steps = np.abs(np.diff(position))
    count = np.min(steps, initial=np.inf, where=steps > 1e-9 * np.ptp(position))
    return bool(np.isfinite(count) and np.ptp(position) >= MINIMUM_COUNTS * count)


def only_noise(position: NDArray[np.float64]) -> bool:
    """Whether a position (N,) goes no farther than its noise."""
    return bool(np.ptp(position) < MINIMUM_NOISES * position_noise(position))

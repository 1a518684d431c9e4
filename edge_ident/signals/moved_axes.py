"""Which axes of a recording move, and which were commanded to rest."""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.recording import AxisRecord, Recording

MINIMUM_COUNTS: Final = 50
"""Travel, in encoder counts, below which a motion cannot be told from quantization."""


def without_resting(recording: Recording) -> Recording:
    """A recording without the axes that were commanded to rest, and did.

    All axes are kept where none moves. An axis without a reference is kept: its encoder may be
    stuck, which a check then says.
    """
    axes = {name: axis for name, axis in recording.axes.items() if not _rests(axis)}
    return replace(recording, axes=axes) if axes else recording


def _rests(axis: AxisRecord) -> bool:
    if axis.reference is None or np.ptp(axis.reference) > 0.0:
        return False
    return not moves(axis.position)


def moves(position: NDArray[np.float64]) -> bool:
    """Whether a position (N,) goes through enough counts of its encoder."""
    steps = np.abs(np.diff(position))
    count = np.min(steps, initial=np.inf, where=steps > 1e-9 * np.ptp(position))
    return bool(np.isfinite(count) and np.ptp(position) >= MINIMUM_COUNTS * count)

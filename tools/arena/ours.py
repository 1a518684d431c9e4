"""What this project makes of a half, and what one does by hand."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.agreement import curves_beside, fitted_beside
from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.fit.summary import timing
from edge_ident.diagnosis.prepare.preparation import as_diagnosed, prepare_axis
from edge_ident.diagnosis.select.selection import fitted_base
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import AxisModel, Estimate, base_axis
from edge_ident.model.motion import Motion
from edge_ident.signals.filters import differentiate, lowpass
from tools.arena.signals import Half, Model
from tools.real_machines.scores import lasting

Array = NDArray[np.float64]

_WIDER: Final = 4.0
"""Band of the motion over that of the effort: what a filter takes off both is taken off once."""


def base_model(half: Half) -> Model:
    """Inertia, viscous and Coulomb friction, offset, by least squares."""
    return _linear(half, lambda h: np.column_stack([h.columns[:, 1:], np.ones(len(h.effort))]))


def by_direction(half: Half) -> Model:
    """The same with a viscous friction of each direction, as EMPS's authors do."""

    def columns(h: Half) -> Array:
        forward, backward = np.maximum(h.velocity, 0.0), np.minimum(h.velocity, 0.0)
        others = (h.acceleration, h.direction, np.ones(len(h.effort)))
        return np.column_stack([forward, backward, *others])

    return _linear(half, columns)


def _linear(half: Half, columns: Callable[[Half], Array]) -> Model:
    values = np.linalg.lstsq(columns(half)[half.scored], half.effort[half.scored])[0]
    return lambda other: np.asarray(columns(other) @ values)


def diagnosed(half: Half) -> Model:
    """`edge_ident.diagnose`: named causes, and curves that agree."""
    found = diagnose([half.recording]).axes[half.axis]
    data = prepare_axis(as_diagnosed([half.recording], half.axis), half.axis)
    return _extended(lasting(data, found.model), found.timing.shift_s)


def curves(half: Half) -> Model:
    """The error budget's curves that agree, without a name."""
    data = prepare_axis(as_diagnosed([half.recording], half.axis), half.axis)
    axis = half.recording.axes[half.axis]
    template = base_axis(Estimate(np.zeros(4), np.zeros(4)), *axis.units)
    base = fitted_base(data, template)
    found = curves_beside(data, base, noise_floor(data, base))
    model = fitted_beside(data, base, found)
    return _extended(model.axis, timing(data, model).shift_s)


def _extended(model: AxisModel, shift_s: float) -> Model:
    """A model of this project along another half's motion, filtered as its effort is."""

    def predicted(other: Half) -> Array:
        axis, period_s = other.recording.axes[other.axis], other.period_s
        moved = differentiate(axis.position, _WIDER * other.cutoff_hz, period_s)
        time_s = np.arange(len(axis.position), dtype=np.float64) * period_s
        motion = Motion.known(time_s, *moved)
        effort = inverse_effort(model, motion)
        return lowpass(effort, other.cutoff_hz, period_s, delay_s=shift_s)[other.index]

    return predicted

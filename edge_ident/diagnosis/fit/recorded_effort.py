"""The size of a cause: what it takes off the effort as it was recorded.

The comparison attenuates from the knee on, and fades out around reversals, where play, presliding
and impacts act most of all. So whether a cause is worth naming is judged on the effort as it is, up
to the cut-off of the comparison and wherever the encoder resolves the direction. Above the cut-off
the cause's formula was not compared with anything.

The size is what the cause reduces the residual by, and no extrapolation. An effort s beside a
residual r takes off ‖r + s‖² - ‖r‖² = 2·s·(r + s) - ‖s‖². So an s that is not in the record counts
against the cause, and so does the noise that it has from the encoder.
"""

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.projection import orthonormal
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.fit.term_effort import reduced_axis
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.segment import Segment
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion
from edge_ident.model.model import AxisModel, regressor_rows
from edge_ident.signals.filters import lowpass

Array = NDArray[np.float64]


def recorded_sizes(data: AxisData, model: FittedModel) -> list[float]:
    """What each added term, with the others of its effect, takes off the recorded effort.

    Parameters
    ----------
    data : AxisData
    model : FittedModel

    Returns
    -------
    list of float
        One for each term: root of the mean square that the residual has more without it, after
        projection on the base model's columns, over the rms of the effort. Negative where the
        residual has less without it.
    """
    together = [model.of_effect(model.terms[place]) for place in range(len(model.terms))]
    seen = [s.direction_known for s in data.segments]
    places = list(zip(data.segments, seen, strict=True))
    effort = np.concatenate([_compared(s, measured(s), at) for s, at in places])
    motions = [
        _compared(s, regressor_rows(s.motion.velocity, s.motion.acceleration), at).T
        for s, at in places
    ]
    basis = orthonormal(np.vstack(motions))

    def left(axis: AxisModel) -> float:
        """Mean square of the residual of a model."""
        made = [_compared(s, along(s, axis), at) for s, at in places]
        residual = effort - np.concatenate(made)
        residual = residual - basis @ (basis.T @ residual)
        return float(residual @ residual) / len(residual)

    whole, scale = left(model.axis), nonzero_rms(effort)
    sizes = {}
    for terms in set(together):
        more = left(reduced_axis(data, model, terms)) - whole
        sizes[terms] = float(np.sign(more) * np.sqrt(np.abs(more))) / scale
    return [sizes[terms] for terms in together]


def _compared(segment: Segment, signals: Array, known: NDArray[np.bool_]) -> Array:
    """Signals (..., N) up to the cut-off, at the samples whose direction is known."""
    return lowpass(known * signals, segment.cutoff_hz, segment.period_s)[..., known]


def measured(segment: Segment) -> Array:
    """The recorded effort (N,) in step with the motion, and as wide."""
    return _as_motion(segment, segment.raw_effort)


def _as_motion(segment: Segment, raw: Array) -> Array:
    """A raw effort (M,) at the samples and the bandwidth of the motion."""
    period_s, delay_s = segment.raw_period_s, segment.shift_s
    smooth = lowpass(raw, segment.motion_hz, period_s, delay_s=delay_s)
    return np.asarray(smooth[:: segment.stride])


def along(segment: Segment, axis: AxisModel) -> Array:
    """Effort (N,) of a model along the motion, unfiltered."""
    effort = segment.obeyed_effort(axis)
    for term in axis.terms:
        effect = named(term.effect)
        if effect.overrides("withheld"):
            withheld = effect.withheld(segment.raw_effort, along_motion(term))
            effort = effort + _as_motion(segment, withheld)
    return np.asarray(effort)

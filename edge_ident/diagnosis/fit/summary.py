"""What a fitted model comes to: residuals, metric, parameters, contributions and traces.

Every figure is taken over the valid samples, and relative to the measured effort there.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel, delayed
from edge_ident.diagnosis.fit.held_out import held_out_residuals
from edge_ident.diagnosis.measures import ModelFit, Traces
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.timing import whole_shift
from edge_ident.model.model import Estimate
from edge_ident.model.motion import NO_SHIFT, Timing
from edge_ident.signals.metrics import compare, rms

Array = NDArray[np.float64]

_TINY: Final = float(np.finfo(float).tiny)


def model_fit(data: AxisData, fitted: FittedModel, deviations: Array) -> ModelFit:
    """Summarize a fitted model; `deviations` (P,) begins with those of its base parameters."""
    valid = data.valid
    scale = nonzero_rms(data.effort[valid])
    return ModelFit(
        estimate=Estimate(fitted.base, deviations[:4]),
        fitted=rms((data.effort - fitted.predicted)[valid]) / scale,
        held_out=rms(held_out_residuals(data, fitted)[valid]) / scale,
        metric=compare(data.effort[valid], fitted.predicted[valid]),
    )


def timing(data: AxisData, fitted: FittedModel) -> Timing:
    """Shift between effort and position beside all terms of a model, the mean of all recordings.

    A delay in the model leaves nothing to the timing.
    """
    if delayed(fitted.axis):
        return NO_SHIFT
    found = [whole_shift(segment, fitted.axis) for segment in data.segments]
    shift, std = np.array([(s.shift_s, max(s.std_s, _TINY)) for s in found]).T
    period = np.array([s.raw_period_s for s in data.segments])
    weight = std**-2.0 / np.sum(std**-2.0)
    deviation = float(np.sum(std**-2.0) ** -0.5)
    return Timing(
        shift_s=float(weight @ shift),
        shift_samples=float(weight @ (shift / period)),
        std_samples=deviation / float(weight @ period),
    )


def traces(
    data: AxisData, start: FittedModel, model: FittedModel, parts: Sequence[Array]
) -> Traces:
    """Signals and predictions over time; `parts` are the contributions of the model's terms."""
    return Traces(
        time_s=data.of_motion("time_s"),
        position=data.of_motion("position"),
        velocity=data.of_motion("velocity"),
        acceleration=data.of_motion("acceleration"),
        effort=data.effort,
        base_effort=start.predicted,
        extended_effort=model.predicted,
        contributions=_by_effect(model, parts),
        since_reversal=data.since_reversal,
        valid=data.valid,
        file=data.recording,
        recording=data.recording,
    )


def _by_effect(model: FittedModel, parts: Sequence[Array]) -> Mapping[str, Array]:
    """Contributions added up by effect: several orders of a ripple are one effect."""
    added: dict[str, Array] = {}
    for t, part in zip(model.terms, parts, strict=True):
        effect = t.candidate.effect
        added[effect] = added.get(effect, 0.0) + part
    return added


def nonzero_rms(values: Array) -> float:
    """Root mean square, and the smallest number instead of zero: a denominator."""
    return max(rms(values), _TINY)

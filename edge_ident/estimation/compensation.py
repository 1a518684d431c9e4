"""Compensation of known effects: their effort is subtracted before parameters are estimated."""

from dataclasses import replace

import numpy as np

from edge_ident.errors import ModelError
from edge_ident.estimation.compensated import CompensatedAxis
from edge_ident.model.model import AxisModel, Model, Term
from edge_ident.signals.conditioning import Signals, condition, with_effort
from edge_ident.signals.recording import Recording
from edge_ident.support.words import listed


def compensate_effects(
    recording: Recording,
    name: str,
    model: Model | None,
    *,
    late_s: float = 0.0,
    of_motion: Signals | None = None,
) -> CompensatedAxis:
    """Condition one axis, and subtract from its effort what the model's effects account for.

    That is the difference between the efforts that the whole axis of the model and its base term
    need along the measured motion, both at the model's values, and what the actuator withheld. For
    an effect that makes the effort column late, the effort is shifted instead.

    Parameters
    ----------
    recording : Recording
    name : str
        Of the axis.
    model : Model or None
        Without one, nothing is compensated.
    late_s : float
        By which the effort is recorded late, beyond what the recording states.
    of_motion : Signals, optional
        Of this axis and recording, with any effort: their motion is not filtered again.

    Raises
    ------
    ModelError
        The model lacks the axis, knows it in other units, or couples it to one that was not
        recorded.
    """
    if model is None:
        return _conditioned(recording, name, (), recording.effort_shift_s - late_s, of_motion)
    # a sound axis has no use for the catalogue of effects
    from edge_ident.estimation.known_effects import subtracted, without_delay

    known = _known(model, recording, name)
    effects = known.terms[1:]
    delay_s, acting = without_delay(effects)
    shift_s = recording.effort_shift_s - delay_s - late_s
    plain = _conditioned(recording, name, effects, shift_s, of_motion)
    if not acting:
        return plain
    return subtracted(plain, replace(known, terms=(known.terms[0], *acting)), recording, name)


def _conditioned(
    recording: Recording,
    name: str,
    effects: tuple[Term, ...],
    shift_s: float,
    of_motion: Signals | None,
) -> CompensatedAxis:
    """The axis before anything is subtracted from its effort."""
    axis = recording.axes[name]
    if of_motion is None:
        columns = recording.time_s, axis.position, axis.effort
        signals = condition(*columns, effort_shift_s=shift_s, sampling=axis.sampling)
    else:
        signals = with_effort(of_motion, axis.effort, shift_s)
    position, effort = (signals.grid.resampled(x) for x in (axis.position, axis.effort))
    nothing = np.broadcast_to(0.0, effort.shape)
    return CompensatedAxis(signals, nothing, effects, shift_s, position, effort, nothing)


def _known(model: Model, recording: Recording, name: str) -> AxisModel:
    axis, record = model.axes.get(name), recording.axes[name]
    if axis is None:
        raise ModelError(
            f"the model has no axis {name}; it knows {', '.join(model.axes)}",
            "give the model of this drive, or name its axes as the recording does",
        )
    if axis.units != record.units:
        raise ModelError(
            f"axis {name} is in {listed(record.units)}, that of the model in {listed(axis.units)}",
            "give a model in the recording's units",
        )
    return axis

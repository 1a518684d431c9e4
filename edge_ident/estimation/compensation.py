"""Compensation of known effects: their effort is subtracted before parameters are estimated."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.model.effect import Motion
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion, inverse_effort, obeyed
from edge_ident.model.model import AxisModel, Model, Term
from edge_ident.signals.conditioning import Signals, condition, with_effort
from edge_ident.signals.filters import differentiate, lowpass
from edge_ident.signals.recording import Recording
from edge_ident.signals.standstill import bridge

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CompensatedAxis:
    """One axis, its effort compensated for known effects.

    Attributes
    ----------
    signals : Signals
        Their effort is that of the base model alone.
    effects_effort : (N,) array
        What the effects account for, filtered alike.
    effects : tuple of Term
    shift_s : float
        From a row's stamp to the middle of the interval in which its effort acted.
    position, effort : (N,) arrays
        On the even grid, as recorded; the effort less what the actuator withheld.
    effects_unfiltered : (N,) array
        What the effects account for along the motion, in step with the position.
    tied_to_time : tuple of str
        Those of them that would act otherwise in a recording that begins later.
    """

    signals: Signals
    effects_effort: Array
    effects: tuple[Term, ...]
    shift_s: float
    position: Array
    effort: Array
    effects_unfiltered: Array
    tied_to_time: tuple[str, ...] = ()


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
    axis = recording.axes[name]
    known = None if model is None else _known(model, recording, name)
    effects = () if known is None else known.terms[1:]
    delay_s, acting = without_delay(effects)
    shift_s = recording.effort_shift_s - delay_s - late_s
    if of_motion is None:
        columns = recording.time_s, axis.position, axis.effort
        signals = condition(*columns, effort_shift_s=shift_s, sampling=axis.sampling)
    else:
        signals = with_effort(of_motion, axis.effort, shift_s)
    position, effort = (signals.grid.resampled(x) for x in (axis.position, axis.effort))
    nothing = np.broadcast_to(0.0, effort.shape)
    plain = CompensatedAxis(signals, nothing, effects, shift_s, position, effort, nothing)
    if known is None or not acting:
        return plain
    undelayed = replace(known, terms=(known.terms[0], *acting))
    motion, others = _smooth_motions(undelayed, recording, name, signals)
    withheld = _withheld(undelayed, effort)
    added = _added(obeyed(undelayed), motion, others)
    filtered = lowpass(added, signals.cutoff_hz, signals.period_s)
    filtered += lowpass(withheld, signals.cutoff_hz, signals.period_s, delay_s=shift_s)
    effects_effort = bridge(filtered, signals.moving)
    return replace(
        plain,
        signals=replace(signals, effort=signals.effort - effects_effort),
        effects_effort=effects_effort,
        effort=effort - withheld,
        effects_unfiltered=added,
        tied_to_time=tuple(t.effect for t in effects if named(t.effect).tied_to_time),
    )


def _known(model: Model, recording: Recording, name: str) -> AxisModel:
    axis, record = model.axes.get(name), recording.axes[name]
    if axis is None:
        raise ModelError(
            f"the model has no axis {name}; it knows {', '.join(model.axes)}",
            "give the model of this drive, or rename the columns with --column",
        )
    units, recorded = ((of.position_unit, of.effort_unit) for of in (axis, record))
    if units != recorded:
        raise ModelError(
            f"axis {name} is in {' and '.join(recorded)}, that of the model in "
            f"{' and '.join(units)}",
            "give a model in the recording's units",
        )
    return axis


def without_delay(effects: tuple[Term, ...]) -> tuple[float, tuple[Term, ...]]:
    """Time by which the effort column is late, and the effects that do something else."""
    delays = [named(term.effect).effort_delay for term in effects]
    late = [float(term.values[name]) for term, name in zip(effects, delays, strict=True) if name]
    acting = tuple(term for term, name in zip(effects, delays, strict=True) if not name)
    return sum(late), acting


def _smooth_motions(
    axis: AxisModel, recording: Recording, name: str, signals: Signals
) -> tuple[Motion, dict[str, Motion]]:
    """The axis's motion, and those of the axes that act on it, all filtered alike."""
    grid = signals.grid

    def smooth(of_axis: str) -> Motion:
        position = grid.resampled(recording.axes[of_axis].position)
        filtered = differentiate(
            position, signals.cutoff_hz, grid.period_s, decimated=signals.sampling is not None
        )
        time_s = grid.time_s - grid.time_s[0] + signals.begin_s + recording.begin_s
        return Motion.known(time_s, *filtered)

    sources = {term.source_axis for term in axis.terms} & set(recording.axes)
    return smooth(name), {source: smooth(source) for source in sources if source is not None}


def _added(axis: AxisModel, motion: Motion, others: dict[str, Motion]) -> Array:
    """What the effects add to the effort that the motion needs."""
    base = replace(axis, terms=axis.terms[:1])
    return inverse_effort(axis, motion, others) - inverse_effort(base, motion)


def _withheld(axis: AxisModel, effort: Array) -> Array:
    """What was recorded, but not given."""
    terms = axis.terms[1:]
    parts = [named(term.effect).withheld(effort, along_motion(term)) for term in terms]
    return np.asarray(np.sum(parts, axis=0))

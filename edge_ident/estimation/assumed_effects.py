"""Effects that are known of a drive, taken off a recording before its parameters are estimated."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.model.effect import Motion
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion, inverse_effort, obeyed
from edge_ident.model.model import AxisModel, Model, Term
from edge_ident.signals.conditioning import Signals, bridge, condition
from edge_ident.signals.filters import differentiate, even_grid, interpolate, lowpass
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]

_DELAY: Final = "time_delay"


@dataclass(frozen=True)
class Remainder:
    """One axis, with what is left of its effort.

    Attributes
    ----------
    signals : Signals
        Their effort is that of the base model alone.
    taken_off : (N,) array
        What the effects account for, filtered alike.
    effects : tuple of Term
    tied_to_time : tuple of str
        Those of them that would act otherwise in a recording that begins later.
    """

    signals: Signals
    taken_off: Array
    effects: tuple[Term, ...]
    tied_to_time: tuple[str, ...] = ()


def without_effects(recording: Recording, name: str, model: Model | None) -> Remainder:
    """Condition one axis, and take off its effort what the model's effects account for.

    That is what the whole axis of the model needs along the measured motion less what its base
    term needs, both at the model's values, and what its actuator withheld. A recorded delay shifts
    the effort instead.

    Parameters
    ----------
    recording : Recording
    name : str
        Of the axis.
    model : Model or None
        Without one, nothing is taken off.

    Raises
    ------
    ModelError
        The model lacks the axis, knows it in other units, or couples it to one that was not
        recorded.
    """
    axis = recording.axes[name]
    known = None if model is None else _known(model, recording, name)
    effects = () if known is None else known.terms[1:]
    delays = [float(term.values["delay"]) for term in effects if term.effect == _DELAY]
    shift_s = recording.effort_shift_s - sum(delays)
    signals = condition(recording.time_s, axis.position, axis.effort, effort_shift_s=shift_s)
    acting = tuple(term for term in effects if term.effect != _DELAY)
    if known is None or not acting:
        return Remainder(signals, np.zeros_like(signals.effort), effects)
    undelayed = replace(known, terms=(known.terms[0], *acting))
    motion, others = _smooth_motions(undelayed, recording, name, signals.cutoff_hz)
    withheld = _withheld(undelayed, recording, name)
    added = _added(obeyed(undelayed), motion, others)
    filtered = lowpass(added, signals.cutoff_hz, signals.period_s)
    filtered += lowpass(withheld, signals.cutoff_hz, signals.period_s, delay_s=shift_s)
    taken_off = bridge(filtered, signals.moving)
    remaining = replace(signals, effort=signals.effort - taken_off)
    return Remainder(remaining, taken_off, effects, _tied_to_time(undelayed, motion, others))


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


def _smooth_motions(
    axis: AxisModel, recording: Recording, name: str, cutoff_hz: float
) -> tuple[Motion, dict[str, Motion]]:
    """The axis's motion, and those of the axes that act on it, all filtered alike."""
    time_s, period_s = even_grid(recording.time_s)

    def smooth(of_axis: str) -> Motion:
        position = interpolate(time_s, recording.time_s, recording.axes[of_axis].position)
        return Motion.known(time_s - time_s[0], *differentiate(position, cutoff_hz, period_s))

    sources = {term.source_axis for term in axis.terms} & set(recording.axes)
    return smooth(name), {source: smooth(source) for source in sources if source is not None}


def _added(axis: AxisModel, motion: Motion, others: dict[str, Motion]) -> Array:
    """What the effects add to the effort that the motion needs."""
    base = replace(axis, terms=axis.terms[:1])
    return inverse_effort(axis, motion, others) - inverse_effort(base, motion)


def _withheld(axis: AxisModel, recording: Recording, name: str) -> Array:
    """What was recorded, but not given."""
    time_s, _ = even_grid(recording.time_s)
    effort = interpolate(time_s, recording.time_s, recording.axes[name].effort)
    terms = axis.terms[1:]
    parts = [named(term.effect).withheld(effort, along_motion(term)) for term in terms]
    return np.asarray(np.sum(parts, axis=0))


def _tied_to_time(axis: AxisModel, motion: Motion, others: dict[str, Motion]) -> tuple[str, ...]:
    """Effects that add something else to the same motion one record later."""
    later = replace(motion, time_s=motion.time_s + motion.time_s[-1])
    found = []
    for term in axis.terms[1:]:
        alone = replace(axis, terms=(axis.terms[0], term))
        if not np.allclose(_added(alone, motion, others), _added(alone, later, others)):
            found.append(term.effect)
    return tuple(found)

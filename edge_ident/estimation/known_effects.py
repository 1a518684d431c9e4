"""What known effects account for along a measured motion, and an effort without it."""

from dataclasses import dataclass, replace

import numpy as np

from edge_ident.estimation.least_squares import Columns
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion, inverse_effort, obeyed
from edge_ident.model.model import AxisModel, Term, axes_of, regressor
from edge_ident.model.motion import Array, Motion
from edge_ident.signals.conditioning import Signals, bridge
from edge_ident.signals.filters import differentiate, lowpass
from edge_ident.signals.recording import Recording


@dataclass(frozen=True)
class AccountedFor:
    """What effects account for in the effort of an axis.

    Attributes
    ----------
    filtered : (N,) array
        As the effort is.
    along_motion : (N,) array
        Unfiltered, in step with the position, without what the actuator withheld.
    withheld : (N,) array
        In step with the recorded effort.
    friction_line : (3,) array or None
        Viscous friction, Coulomb friction and offset of the line through what the effects add to
        the friction, over the samples in motion; None where they add nothing.
    tied_to_time : tuple of str
        Those of them that would act otherwise in a recording that begins later.
    """

    filtered: Array
    along_motion: Array
    withheld: Array
    friction_line: Array | None
    tied_to_time: tuple[str, ...]


def accounted_for(
    acting: AxisModel, recording: Recording, name: str, signals: Signals, shift_s: float
) -> AccountedFor:
    """What effects account for in the effort of one axis.

    Parameters
    ----------
    acting : AxisModel
        The base term, and the effects that do more than make the effort column late.
    recording : Recording
    name : str
        Of the axis.
    signals : Signals
        Of the axis.
    shift_s : float
        From a row's stamp to the middle of the interval in which its effort acted.
    """
    motion, others = _smooth_motions(acting, recording, name, signals)
    withheld = _withheld(acting, signals.grid.resampled(recording.axes[name].effort))
    added = _added(obeyed(acting), motion, others)
    filtered = lowpass(added, signals.cutoff_hz, signals.period_s)
    filtered += lowpass(withheld, signals.cutoff_hz, signals.period_s, delay_s=shift_s)
    line = _friction_line(obeyed(acting), motion, others, signals)
    tied = tuple(t.effect for t in acting.terms[1:] if named(t.effect).tied_to_time)
    return AccountedFor(bridge(filtered, signals.moving), added, withheld, line, tied)


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
    grid, positions = signals.grid, recording.positions

    def smooth(of_axis: str) -> Motion:
        position = grid.resampled(positions[of_axis])
        filtered = differentiate(position, signals.cutoff_hz, grid.period_s)
        time_s = grid.time_s - grid.time_s[0] + signals.begin_s + recording.begin_s
        return Motion.known(time_s, *filtered)

    axes = set(positions)
    sources = {s for t in axis.terms for s in axes_of(t.source_axis, axes)}
    return smooth(name), {source: smooth(source) for source in sources & axes}


def _added(axis: AxisModel, motion: Motion, others: dict[str, Motion]) -> Array:
    """What the effects add to the effort that the motion needs."""
    base = replace(axis, terms=axis.terms[:1])
    return inverse_effort(axis, motion, others) - inverse_effort(base, motion)


def _friction_line(
    axis: AxisModel, motion: Motion, others: dict[str, Motion], signals: Signals
) -> Array | None:
    """The line through what effects add to the friction, over the samples in motion."""
    sharing = [t for t in axis.terms[1:] if named(t.effect).search.shares_friction]
    if not sharing:
        return None
    added = _added(replace(axis, terms=(axis.terms[0], *sharing)), motion, others)
    columns = Columns(regressor(motion.velocity, motion.acceleration)[signals.moving, 1:])
    return columns.solved(added[signals.moving]) / columns.length


def _withheld(axis: AxisModel, effort: Array) -> Array:
    """What was recorded, but not given."""
    terms = axis.terms[1:]
    parts = [named(term.effect).withheld(effort, along_motion(term)) for term in terms]
    return np.asarray(np.sum(parts, axis=0))

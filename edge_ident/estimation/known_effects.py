"""What known effects account for along a measured motion, and an effort without it."""

from dataclasses import replace

import numpy as np

from edge_ident.estimation.compensated import CompensatedAxis
from edge_ident.estimation.least_squares import Columns
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion, inverse_effort, obeyed
from edge_ident.model.model import AxisModel, Term, axes_of, regressor
from edge_ident.model.motion import Array, Motion
from edge_ident.signals.conditioning import Signals, bridge
from edge_ident.signals.filters import differentiate, lowpass
from edge_ident.signals.recording import Recording


def subtracted(
    plain: CompensatedAxis, acting: AxisModel, recording: Recording, name: str
) -> CompensatedAxis:
    """An axis, its effort less what effects account for.

    Parameters
    ----------
    plain : CompensatedAxis
        With its effort in step, and nothing subtracted.
    acting : AxisModel
        The base term, and the effects that do more than make the effort column late.
    recording : Recording
    name : str
        Of the axis.
    """
    signals = plain.signals
    motion, others = _smooth_motions(acting, recording, name, signals)
    withheld = _withheld(acting, plain.effort)
    added = _added(obeyed(acting), motion, others)
    filtered = lowpass(added, signals.cutoff_hz, signals.period_s)
    filtered += lowpass(withheld, signals.cutoff_hz, signals.period_s, delay_s=plain.shift_s)
    effects_effort = bridge(filtered, signals.moving)
    return replace(
        plain,
        signals=replace(signals, effort=signals.effort - effects_effort),
        effects_effort=effects_effort,
        effort=plain.effort - withheld,
        effects_unfiltered=added,
        friction_line=_friction_line(obeyed(acting), motion, others, signals),
        tied_to_time=tuple(t.effect for t in plain.effects if named(t.effect).tied_to_time),
    )


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

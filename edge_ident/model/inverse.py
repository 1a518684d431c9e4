"""The inverse direction: the effort column that belongs to a known motion, for any model."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.model.effect import Effect, Values
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Term
from edge_ident.model.motion import Motion
from edge_ident.model.sources import acting, together
from edge_ident.model.waves import added

Array = NDArray[np.float64]
Kept = dict[object, Any]
"""Slow results along one motion."""

_MOVED: Final = "moved"
"""Key of the last motion that is not the reading: what moves it, and what is kept along it."""
_ALONE: Final[Mapping[str, Motion]] = MappingProxyType({})


def inverse_effort(
    axis: AxisModel,
    motion: Motion,
    others: Mapping[str, Motion] = _ALONE,
    kept: Kept | None = None,
) -> Array:
    """Effort (N,) or (D, N) of an axis along its motion as the encoder reads it.

    Parameters
    ----------
    axis : AxisModel
    motion : Motion
        Smooth, (N,), evenly sampled.
    others : mapping of axis name to Motion
        For effects that couple axes.
    kept : dict, optional
        Keeps slow results of effects with memory for the next call with this motion.

    Raises
    ------
    ModelError
        An effect is unknown, or its source axis is not among the others.
    """
    # in physical order: encoder, resistances, actuator, record
    terms = [(named(term.effect), along_motion(term), term.source_axis) for term in axis.terms]
    motion, kept = _true_motion(terms, motion, kept)
    if any(effect.follows_base for effect, _, _ in terms):
        motion = _with_base_efforts(motion, terms, others)
    resistances = []
    for place, (effect, values, source) in enumerate(terms):
        seen = _with_source(motion, effect, source, others)
        resistances.append(_resistance(effect, seen, values, kept, (place, source)))
    effort = _sum(resistances, motion)
    for effect, values, _ in terms:
        effort = effect.command(effort, motion.time_s, values)
    for effect, values, _ in terms:
        effort = effect.recorded(effort, motion.time_s, values)
    return effort


def _sum(resistances: Sequence[Array], motion: Motion) -> Array:
    """Of what terms resist with, at all samples."""
    total = added(*resistances)
    return total if total.ndim else np.full(motion.time_s.shape, total)


def _true_motion(
    terms: Sequence[tuple[Effect, Values, str | None]], motion: Motion, kept: Kept | None
) -> tuple[Motion, Kept | None]:
    """The motion of the axis, and what is kept along it. The last motion that is not the reading
    is kept, too, because many calls in turn are about the same one."""
    movers = [(e, values) for e, values, _ in terms if e.overrides("true_motion")]
    if not movers:
        return motion, kept
    key = tuple((e.name, *(x.tobytes() for x in values.values())) for e, values in movers)
    if kept and _MOVED in kept and kept[_MOVED][0] == key:
        return kept[_MOVED][1], kept[_MOVED][2]
    for effect, values in movers:
        motion = effect.true_motion(motion, values)
    if kept is None or any(x.size > 1 for _, values in movers for x in values.values()):
        return motion, None
    kept[_MOVED] = key, motion, {}
    return motion, kept[_MOVED][2]


def _with_base_efforts(
    motion: Motion,
    terms: Sequence[tuple[Effect, Values, str | None]],
    others: Mapping[str, Motion],
) -> Motion:
    """A motion with what inertia and friction of the base term take of the effort, and loads."""
    base = terms[0][1]
    inertia_effort = base["inertia"] * motion.acceleration
    friction_effort = base["viscous_friction"] * motion.velocity
    carried = (
        effect.load(_with_source(motion, effect, source, others), values)
        for effect, values, source in terms
        if effect.carried
    )
    return replace(
        motion,
        transmitted=inertia_effort + base["offset"] + sum(carried),
        inertia_effort=inertia_effort,
        friction_effort=friction_effort + base["coulomb_friction"] * motion.direction,
    )


def _resistance(
    effect: Effect, motion: Motion, values: Values, kept: Kept | None, at: tuple[int, str | None]
) -> Array:
    """What an effect resists with, at a place of the model and with a source. An effect with memory
    is proportional to one parameter (checked in `edge_ident.model.registration`), so its effort is
    kept for a value of one; that of others until the place has other values, because many calls in
    turn change one term alone."""
    scale = effect.memory_scale
    others = {name: value for name, value in values.items() if name != scale}
    if kept is None or effect.follows_base or any(value.size > 1 for value in others.values()):
        return effect.resistance(motion, values)
    key = (effect.name, *(float(value.item()) for value in others.values()))
    if not scale:
        if kept.get(at, (None,))[0] != key:
            kept[at] = key, effect.resistance(motion, values)
        return np.asarray(kept[at][1])
    if key not in kept:
        at_one = {name: value.reshape(1) for name, value in others.items()}
        kept[key] = effect.resistance(motion, {**at_one, scale: np.ones(1)})
    return np.asarray(values[scale] * kept[key])


def obeyed(axis: AxisModel) -> AxisModel:
    """The axis without what its actuator withholds, which is read from a recorded effort
    (`Effect.withheld`): along a motion that was made, the actuator gave what it needed."""
    terms = tuple(t for t in axis.terms if not named(t.effect).overrides("withheld"))
    return replace(axis, terms=terms)


def remembers(terms: Iterable[Term]) -> bool:
    """Whether what an axis resists with depends on how it moved before."""
    return any(named(term.effect).memory_size for term in terms)


def along_motion(term: Term) -> Values:
    """A term's values with an axis for the motion's samples behind that of the drives."""
    return {
        name: np.asarray(value, dtype=np.float64)[..., None]
        for name, value in named(term.effect).complete(term.values).items()
    }


def _with_source(
    motion: Motion, effect: Effect, source: str | None, others: Mapping[str, Motion]
) -> Motion:
    if not effect.has_source(source):
        return motion
    acts = acting(source, others)
    if not acts or not all(one.axis in others for one in acts):
        raise ModelError(
            f"{effect.name} needs the motion of axis {source}",
            f"name one of {', '.join(others) or 'several axes'}, and give its motion",
        )
    return replace(motion, source=together((others[one.axis], one.sense) for one in acts))

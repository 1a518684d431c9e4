"""The inverse direction: the effort column that belongs to a known motion, for any model."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from edge_ident.errors import ModelError
from edge_ident.model.effect import Effect
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel, Term, acting, together
from edge_ident.model.motion import Array, Motion, Values, added

Kept = dict[object, Any]
"""Slow results along one motion."""

# Key of the last motion that is not the reading: what moves it, and what is kept along it.
_MOVED: Final = "moved"
_ALONE: Final[Mapping[str, Motion]] = MappingProxyType({})


def inverse_effort(
    axis: AxisModel, motion: Motion, others: Mapping[str, Motion] = _ALONE, kept: Kept | None = None
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
    motion: Motion, terms: Sequence[tuple[Effect, Values, str | None]], others: Mapping[str, Motion]
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


def steady_effort(term: Term, position: Array, velocity: Array, way: float) -> Array:
    """Effort of a term at constant velocities in one direction.

    Parameters
    ----------
    term : Term
    position, velocity : arrays
        Of one shape; that of the effort, too.
    way : float
        Direction: 1 or -1, also at a velocity of zero.
    """
    still = np.zeros(position.size)
    motion = Motion(still, position.ravel(), velocity.ravel(), still, np.full(position.size, way))
    effort = named(term.effect).resistance(motion, along_motion(term))
    return np.broadcast_to(effort, position.size).reshape(position.shape)


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


# The base model of an axis at one time of the recording that its model was made from.
#
# Some effects change nothing but base parameters, and do so in time: a payload, a lubricant that
# warms, an amplifier that drifts. The hooks of such an effect say by how much at any time.


def base_at(axis: AxisModel, time_s: float) -> AxisModel:
    """The axis with the base parameters of a time; all of its terms are still there.

    Parameters
    ----------
    axis : AxisModel
        Of one drive.
    time_s : float
        From the first sample of the recording on.
    """
    base = axis.terms[0]
    parameters, scale = axis.parameters.copy(), 1.0
    for term in axis.terms[1:]:
        effect = named(term.effect)
        if effect.changes_base:
            values = {
                name: np.full(1, value) for name, value in effect.complete(term.values).items()
            }
            parameters += _added(effect, values, time_s)
            scale *= float(effect.command(np.ones(1), np.full(1, time_s), values)[0])
    values_then = dict(zip(PARAMETERS, (scale * parameters).tolist(), strict=True))
    return replace(axis, terms=(replace(base, values=values_then), *axis.terms[1:]))


def _added(effect: Effect, values: Values, time_s: float) -> np.ndarray:
    """What an effect adds to the base parameters (4,), from its hooks at three speeds."""
    speed, still = np.array([-1.0, 0.0, 1.0]), np.zeros(3)
    motion = Motion.known(np.full(3, time_s), still, speed, still)
    load, friction, inertia = (
        np.broadcast_to(hook(motion, values), 3)
        for hook in (effect.load, effect.friction, effect.inertia)
    )
    return np.array([inertia[1], 0.5 * (load[2] - load[0]), friction[1], load[1]])


# What effects leave of an axis's inertia and Coulomb friction.
#
# Some effects take a part of the base term: the load behind a play, friction that is gone at speed.
# They may take no more than there is: at any time, at any angle of another joint, and at any
# position that the model was seen at.

_EVER: Final = (-1e12, 1e12)  # long before and long after any record, in s
# All around another joint, in rad; what lies between them is 2 % of an amplitude at most.
_ANGLES: Final = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
_PLACES: Final = 16  # positions along the travel
_TOO_FAST: Final = 1e12  # velocity at which no Stribeck friction is left
_ROUNDING: Final = 1e-9


@dataclass(frozen=True)
class Left:
    """The least that terms ever leave of inertia and of Coulomb friction."""

    inertia: float
    coulomb_friction: float

    @property
    def physical(self) -> bool:
        """Whether inertia is left, and no friction drives the axis."""
        return self.inertia > 0.0 and self.coulomb_friction > -_ROUNDING


def left_by_terms(axis: AxisModel) -> Left:
    """What the terms of an axis leave.

    Parameters
    ----------
    axis : AxisModel
        Of one drive.
    """
    at = everywhere(_TOO_FAST, axis)
    inertia, friction = (
        float(np.min(sum(getattr(named(t.effect), hook)(at, along_motion(t)) for t in axis.terms)))
        for hook in ("inertia", "friction")
    )
    return Left(inertia, friction)


def inertia_of_poses(axis: AxisModel, others: Mapping[str, AxisModel]) -> tuple[float, float]:
    """The least and the largest inertia that an axis has where it was seen, at rest, with the axes
    that act on it anywhere that they were seen, or anywhere on a turn.

    Parameters
    ----------
    axis : AxisModel
    others : mapping of axis name to AxisModel
        Of the model's other axes, those that are known.
    """
    low = high = np.full(_PLACES, float(axis.parameters[0]))
    for term in axis.terms[1:]:
        effect = named(term.effect)
        if not effect.overrides("inertia") or effect.memory_size or effect.changes_base:
            continue
        places = np.linspace(*_visited(axis, (0.0, 0.0)), _PLACES)[:, None]
        angles = _angles(term.source_axis, others)
        zero = np.zeros((_PLACES, len(angles)))
        source = Motion.known(zero, angles + zero, zero, zero)
        at = replace(Motion.known(zero, places + zero, zero, zero), source=source)
        values = {name: np.array(value) for name, value in effect.complete(term.values).items()}
        added_there = np.broadcast_to(effect.inertia(at, values), zero.shape)
        low, high = low + added_there.min(axis=1), high + added_there.max(axis=1)
    return float(np.min(low)), float(np.max(high))


def _visited(axis: AxisModel, unknown: tuple[float, float]) -> tuple[float, float]:
    """Least and largest position at which an axis was seen."""
    seen = axis.terms[0].supported
    return unknown if seen is None else seen.position


def _angles(source: str | None, others: Mapping[str, AxisModel]) -> Array:
    """Positions of what acts from a source."""
    turn = (0.0, 2.0 * np.pi)
    each = [
        (np.array(_visited(others[one.axis], turn)) if one.axis in others else np.array(turn))
        * one.sense
        for one in acting(source, others)
    ]
    low, high = (float(sum(f(positions) for positions in each)) for f in (np.min, np.max))
    return np.linspace(low, min(high, low + turn[1]), _PLACES)


def everywhere(velocity: float, axis: AxisModel) -> Motion:
    """Instants (N, 1) at a velocity: along the travel that the axis was seen at, or at position
    zero; long before and long after any record; with another joint at rest at angles all around."""
    grids = np.meshgrid(_EVER, _ANGLES, np.linspace(*_visited(axis, (0.0, 0.0)), _PLACES))
    time_s, angle, position = (x.reshape(-1, 1) for x in grids)
    zero = np.zeros(time_s.shape)
    source = Motion.known(time_s, angle, zero, zero)
    return replace(Motion.known(time_s, position, zero + velocity, zero), source=source)


def made_physical(axis: AxisModel, least_inertia: float) -> AxisModel:
    """The axis with as much more inertia and Coulomb friction as a simulation needs.

    A part of the friction that is larger than the whole becomes the whole. Such a part shows at
    reversals, where the direction is hardly known, and the whole wherever the axis slides.

    Parameters
    ----------
    axis : AxisModel
    least_inertia : float
        What must be left of the inertia; so little that the recording could not show it.
    """
    axis = replace(axis, terms=tuple(_no_more_than_all(axis)))
    left, base = left_by_terms(axis), axis.terms[0]
    values, std = dict(base.values), dict(base.std)
    for name, more in (
        ("inertia", least_inertia - left.inertia),
        ("coulomb_friction", -left.coulomb_friction),
    ):
        if more > 0.0:
            values[name] = float(values[name]) + more
            # it is not known better than by what had to be added
            std[name] = max(std.get(name, 0.0), more)
    return replace(axis, terms=(replace(base, values=values, std=std), *axis.terms[1:]))


def _no_more_than_all(axis: AxisModel) -> Iterator[Term]:
    """The terms; those that are a part of the friction have no more than others leave of it."""
    missing = max(0.0, -left_by_terms(axis).coulomb_friction)
    for term in axis.terms:
        part = named(term.effect).part_of_friction
        if not part or not missing:
            yield term
            continue
        value = float(term.values[part])
        less = min(missing, value)
        missing -= less
        # it is not known better than by what had to be taken
        std = {**term.std, part: max(term.std.get(part) or 0.0, less)}
        yield replace(term, values={**term.values, part: value - less}, std=std)

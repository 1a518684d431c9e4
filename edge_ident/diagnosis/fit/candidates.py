"""Candidate effects and their regressors: what each adds to the effort per unit of amplitude.

A regressor is the change that a small amplitude makes to the prediction of a model. So one rule
serves loads, friction, memory, actuator, encoder and timing: each effect's file says how it acts.
"""

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effects import catalogue, named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.model.search import Excitation, Form

Array = NDArray[np.float64]


Values = Mapping[str, float] | Mapping[str, Array]
"""Values of parameters by name: numbers, or arrays (D,)."""

_SMALL: Final = 1e-6
"""Amplitude of the difference; most effects are linear in it, the others nearly so."""
_STEP: Final = 1e-3
"""Relative step of the derivatives by nonlinear parameters: coarse enough for effects that act in
jumps."""
_MANY: Final = 2
"""Nonlinear parameters beyond which points around one are too sparse to be the last step."""
_ROUNDING: Final = 1e-11
"""Relative change of an effort that is rounding."""
_NOTHING: Final = Term(BASE, dict.fromkeys(PARAMETERS, 0.0))
"""A base term without effort."""
_ROW_LIMIT: Final = 250_000
"""Samples computed at once: a few arrays of them fit a processor's cache."""
_MORE: Final = 6
"""Times more of what is integrated: an instant takes as many calls of numpy for few as for many."""
_FEWER: Final = 2
"""Times fewer where others are computed along with them: many arrays take their room."""


@dataclass(frozen=True)
class Candidate:
    """An effect in one of its forms, with the other axis that takes part, if any."""

    effect: str
    form: Form
    source: str | None = None

    @property
    def parameter_count(self) -> int:
        """Number of free parameters."""
        return len(self.form.linear) + len(self.form.nonlinear)

    @property
    def descends(self) -> bool:
        """Whether it has so many nonlinear parameters that a descent has to refine them.

        Its grid is sparse: what a descent finds may be far better than the best point.
        """
        return len(self.form.nonlinear) > _MANY and len(self.form.linear) == 1

    @property
    def delays(self) -> bool:
        """Whether it shifts the effort: a score of first order says little of that."""
        return bool(named(self.effect).effort_delay)


def candidates(data: AxisData, rotary: bool) -> tuple[Candidate, ...]:
    """All candidates for an axis; `rotary` where its positions are angles."""
    found, several_speeds = [], data.several_speeds
    own_friction = frozenset(data.own) - {"offset"}
    for name, effect in catalogue().items():
        if effect.search.needs_reversals and not data.reverses:
            continue
        if effect.effort_delay and not data.late:
            continue  # timing accounts for the shift
        for form in effect.search.forms:
            separable = several_speeds or not form.several_speeds
            if effect.tied_to_time and own_friction.intersection(form.linear):
                continue  # a recording's own friction says it already
            if separable and (rotary or not form.rotary):
                found += [Candidate(name, form, source) for source in data.sources(form)]
    return tuple(found)


def grid(candidate: Candidate, excitation: Excitation) -> dict[str, Array]:
    """Values of the nonlinear parameters to try, arrays (D,).

    The arrays have length one for a form without nonlinear parameters.
    """
    values, form = named(candidate.effect).search.grid(excitation), candidate.form
    if form.grid is not None:
        own = form.grid(excitation)
        count = len(own[form.nonlinear[0]])
        return {name: np.full(count, array[0]) for name, array in values.items()} | own
    if not form.nonlinear:
        first = {name: array[:1] for name, array in values.items()}
        return first | {name: np.array([value]) for name, value in form.known}
    return values


def term(candidate: Candidate, nonlinear: Values, linear: Values) -> Term:
    """The term of a candidate; parameters of the effect's other forms are those of no effect."""
    values: dict[str, float | Array] = {
        p.name: p.default or 0.0 for p in named(candidate.effect).parameters
    }
    values |= {**nonlinear, **linear}
    return Term(candidate.effect, values, source_axis=candidate.source)


def adds(candidate: Candidate) -> bool:
    """Whether a candidate's effort adds to that of the others, in proportion to its linear
    parameters: it follows from the motion alone, or from the recorded effort alone."""
    effect = named(candidate.effect)
    return effect.additive or (effect.overrides("withheld") and not candidate.form.linear)


def effort_adds(name: str) -> bool:
    """Whether the effort of an effect with given values adds to that of all others."""
    effect = named(name)
    return effect.additive or effect.overrides("withheld")


def alone(axis: AxisModel, place: int) -> AxisModel:
    """What the effort of one term depends on: the term itself, and what moves the encoder.

    The other terms stay where one changes what all of them resist with. So do the base term, loads
    that are carried, and friction that follows them, where it is one of these. Places stay as they
    are, but for what is left out.

    Parameters
    ----------
    place : int
        Of the term.
    """
    effect = named(axis.terms[place].effect)
    if effect.overrides("true_motion") or not all(_reaches(t.effect) for t in axis.terms):
        return axis
    effects = [named(t.effect) for t in axis.terms]
    linked = [not k or e.carried or e.follows_base for k, e in enumerate(effects)]
    together = linked[place] and any(e.follows_base for e in effects)
    kept = [axis.terms[0] if place == 0 or together else _NOTHING]
    for k, t in enumerate(axis.terms[1:], 1):
        if k == place or effects[k].overrides("true_motion") or (together and linked[k]):
            kept.append(t)
    return replace(axis, terms=tuple(kept))


def _beside(axis: AxisModel, candidate: Candidate) -> AxisModel:
    """What of a model the regressors of a candidate depend on; without effort, where they add."""
    if not adds(candidate):
        return axis
    whole = replace(axis, terms=(*axis.terms, term(candidate, {}, {})))
    needed = alone(whole, len(axis.terms))
    return replace(axis, terms=needed.terms[:-1])


def _reaches(name: str) -> bool:
    """Whether an effect lets what the others resist with reach the effort column as it is."""
    effect = named(name)
    changes = effect.overrides("command") or effect.overrides("recorded")
    return effect.overrides("withheld") or not changes


def cached_regressors(
    data: AxisData, axis: AxisModel, candidate: Candidate, nonlinear: Mapping[str, float]
) -> Array:
    """Regressors (k, n) of a candidate on top of a model, computed once for the data and for what
    they depend on; for a form without linear parameters (1, n), its effort."""
    beside, needed = beside_key(axis, candidate)
    key = point_key(beside, nonlinear)
    return data.once(key, lambda: regressors(data, needed, candidate, nonlinear)[0])


def beside_key(axis: AxisModel, candidate: Candidate) -> tuple[Hashable, AxisModel]:
    """What makes the regressors of a candidate, but for its point, and the part of the model among
    it."""
    needed = _beside(axis, candidate)
    return (candidate, effort_key(needed)), needed


def point_key(beside: Hashable, nonlinear: Mapping[str, float]) -> Hashable:
    """What makes the regressors at a point."""
    return (beside, *sorted(nonlinear.items()))


def base_regressor(data: AxisData) -> Array:
    """Columns (n, 4) of the base parameters at the compared samples, computed once for the data."""
    unit = dict(zip(PARAMETERS, np.eye(len(PARAMETERS)), strict=True))
    return data.once(BASE, lambda: data.predicted(AxisModel((Term(BASE, unit),)))).T


def cached_derivatives(
    data: AxisData, axis: AxisModel, candidate: Candidate, nonlinear: Mapping[str, float]
) -> Array:
    """Derivatives (S, k, n) of the regressors of a candidate that adds, by the S nonlinear
    parameters of its form, computed once for the data."""

    def found() -> Array:
        sides, steps = to_both_sides(candidate, nonlinear)
        base = replace(axis, terms=axis.terms[:1])
        low, high = np.split(regressors(data, base, candidate, sides), 2)
        return slopes(low, high, steps)

    return data.once(("derivatives", candidate, *nonlinear.values()), found)


def slopes(low: Array, high: Array, steps: Array) -> Array:
    """Derivatives (S, ...) from values (S, ...) a step (S,) lower and higher; zero where the change
    is no more than rounding."""
    change, per_row = high - low, (len(steps), *(1,) * (low.ndim - 1))
    sizes = [np.linalg.norm(x.reshape(len(steps), -1), axis=1) for x in (change, high)]
    shown = sizes[0] > _ROUNDING * sizes[1]
    return np.asarray(np.where(shown, 0.5 / steps, 0.0).reshape(per_row) * change)


def to_both_sides(
    candidate: Candidate, nonlinear: Mapping[str, float]
) -> tuple[dict[str, Array], Array]:
    """Nonlinear parameters (2·S,) with each of the S of a form a step lower, then each a step
    higher; and these steps (S,)."""
    names = candidate.form.nonlinear
    steps = _STEP * np.array([abs(nonlinear[name]) or 1.0 for name in names])
    moves = np.concatenate([-np.diag(steps), np.diag(steps)])
    sides = {name: np.full(len(moves), value) for name, value in nonlinear.items()}
    sides |= {name: sides[name] + moves[:, k] for k, name in enumerate(names)}
    return sides, steps


def known_effort(data: AxisData, axis: AxisModel) -> Array:
    """Effort (n,) of the effects that an axis is known to have."""
    return cached_effort(data, replace(axis, terms=(_NOTHING, *axis.terms[1:])))


def effort_key(axis: AxisModel) -> Hashable:
    """What makes the effort of a model."""
    return tuple((t.effect, t.source_axis, *map(float, t.values.values())) for t in axis.terms)


def cached_effort(data: AxisData, axis: AxisModel) -> Array:
    """Effort (n,) that a model predicts, computed once for the data."""
    return data.once(("effort", effort_key(axis)), lambda: data.predicted(axis))


def regressors(data: AxisData, axis: AxisModel, candidate: Candidate, nonlinear: Values) -> Array:
    """Regressors of a candidate on top of a model.

    Parameters
    ----------
    nonlinear : mapping of parameter name to float or (D,) array
        One set of nonlinear parameters, or D of them.

    Returns
    -------
    (D, k, n) array
        Effort per unit of each of the k linear parameters; for a form without any (D, 1, n), the
        effort that the nonlinear parameters alone add.
    """
    values = {name: np.atleast_1d(value) for name, value in nonlinear.items()}
    count = len(next(iter(values.values()))) if values else 1
    linear = candidate.form.linear
    limit = _ROW_LIMIT * (_MORE if named(candidate.effect).memory_size else 1)
    batch = max(1, limit // data.samples)
    result = np.empty((count, max(len(linear), 1), len(data.effort)))
    axis = _beside(axis, candidate)
    present: Array | float = 0.0
    places = [slice(k, k + 1) for k in range(len(linear))]  # a wave of one amplitude costs less
    if axis.terms[0] is not _NOTHING:
        present = cached_effort(data, axis)
        places = [slice(None)]  # all others are computed along with it
        batch = max(1, batch // _FEWER)
    for first in range(0, count, batch):
        part = {name: array[first : first + batch] for name, array in values.items()}
        for k in places or [slice(None)]:
            rows = _with_small(data, axis, candidate, part, linear[k]) - present
            result[first : first + batch, k] = rows.swapaxes(0, 1) / (_SMALL if linear else 1.0)
    return result


def _with_small(
    data: AxisData, axis: AxisModel, candidate: Candidate, points: Values, linear: tuple[str, ...]
) -> Array:
    """Efforts (K, D, n) of a model with a candidate at D points: small amplitudes of each of K
    linear parameters in turn; (1, D, n) without linear parameters."""
    count, size = max(map(np.size, points.values()), default=1), max(len(linear), 1)
    small = _SMALL * np.repeat(np.eye(size), count, axis=1)
    sets = {name: np.tile(array, size) for name, array in points.items()}
    added = term(candidate, sets, dict(zip(linear, small, strict=False)))
    rows = data.predicted(replace(axis, terms=(*axis.terms, added)))
    return np.asarray(rows).reshape(size, count, -1)


# What each of several recordings has of its own beside the common model: a shift, and base
# parameters that differ from day to day.
#
# Bearings warm up, and sensors are tared. A model with one offset would have to explain the
# difference by causes.
#
# An own offset is a matter of a tare, and small. Where every recording moves one way, it would be
# all that the dry friction is: there, one offset is that of all.


_APART: Final = ("coulomb_friction", "offset")
_SAME: Final = 0.95
"""Cosine of the angle between direction and offset, from which a recording moves one way."""
_TINY: Final = float(np.finfo(float).tiny)


def own_columns(data: AxisData) -> Array:
    """Columns (n, R + K·(R - 1)) for R recordings and their K own parameters, computed once.

    First what a further shift of each adds to the effort, per s. Then each own parameter of each
    recording but the last, above that of the last. The base model has the means over all samples.
    """

    def found() -> Array:
        known = np.array([float(name != "offset" or not one_way(data)) for name in data.own])
        inside = [data.recording == k for k in range(len(data.segments) - 1)]
        columns = (base_regressor(data)[:, PARAMETERS.index(name)] for name in data.own)
        own = [
            apart * (here - np.mean(here)) * column
            for apart, column in zip(known, columns, strict=True)
            for here in inside
        ]
        return np.column_stack([data.timing_columns, *own])

    return data.once("own columns", found)


def one_way(data: AxisData) -> bool:
    """Whether each of several recordings moves one way, so that direction and offset are the same
    in it, and not all of them do in the same."""
    columns = base_regressor(data)
    direction, offset = (columns[:, PARAMETERS.index(name)] for name in _APART)
    alike = []
    for k in range(len(data.segments)):
        here = data.recording == k
        size = float(np.linalg.norm(direction[here]) * np.linalg.norm(offset[here]))
        alike.append(float(direction[here] @ offset[here]) / max(size, _TINY))
    return min(map(abs, alike)) > _SAME and min(alike) < 0.0 < max(alike)


def own_parameters(data: AxisData, base: Array, own: Array) -> dict[str, Array]:
    """What each recording has of a base parameter, (R,), for each of the own ones.

    Parameters
    ----------
    base : (4,) array
        Base parameters: the means over all samples.
    own : (R + K·(R - 1),) array
        Values of the own columns.
    """
    count = len(data.segments)
    above_last = np.pad(own[count:].reshape(len(data.own), count - 1), ((0, 0), (0, 1)))
    weight = np.bincount(data.recording, minlength=count) / len(data.recording)
    above_mean = above_last - (above_last @ weight)[:, None]
    return {
        name: base[PARAMETERS.index(name)] + of_each
        for name, of_each in zip(data.own, above_mean, strict=True)
    }


def own_limits(data: AxisData, *, shifted: bool) -> tuple[Array, Array]:
    """Lowest and highest values (R + K·(R - 1),) of the same.

    Where a delay carries the whole shift, `shifted` is False, and there is no further one.
    """
    early, late = data.timing_limits
    free = np.full(len(data.own) * (len(data.segments) - 1), np.inf)
    return np.append(early * shifted, -free), np.append(late * shifted, free)


# Derivatives of a model's effort by its linear parameters, where the efforts do not add up.


def derivatives(
    data: AxisData, axis: AxisModel, predicted: Array, linear: Sequence[Collection[str]]
) -> tuple[Array, ...]:
    """Derivatives, rows (k, n), by base parameters, the recordings' own, and linear parameters.

    Parameters
    ----------
    predicted : (n,) array
        Effort of the model.
    linear : sequence of collection of str
        Linear parameters of each of the last terms.
    """
    first = len(axis.terms) - len(linear)
    names = {0: PARAMETERS} | {k: tuple(x) for k, x in enumerate(linear, first) if x}
    base, *added = (_of_term(data, axis, predicted, *place) for place in names.items())
    return (base, own_columns(data).T, *added)


def _of_term(
    data: AxisData, axis: AxisModel, predicted: Array, place: int, names: tuple[str, ...]
) -> Array:
    """Derivatives (K, n) by K parameters of the term at one place.

    Where its effort is in proportion to them, they are the same wherever these parameters are.
    """
    term, needed = axis.terms[place], alone(axis, place)
    follows = any(named(t.effect).follows_base for t in needed.terms)
    if needed is axis or follows or not named(term.effect).additive:
        made = predicted if needed is axis else cached_effort(data, needed)
        return _difference(data, needed, made, term, names)
    at_zero = replace(term, values={**term.values, **dict.fromkeys(names, 0.0)})
    needed = _with(needed, term, at_zero)
    key = ("by linear parameters", names, effort_key(needed))
    return data.once(
        key, lambda: _difference(data, needed, cached_effort(data, needed), at_zero, names)
    )


def _difference(
    data: AxisData, axis: AxisModel, made: Array, term: Term, names: tuple[str, ...]
) -> Array:
    """What each of K parameters of a term adds per unit to the effort (n,) of a model, (K, n)."""
    moved = {name: np.full(len(names), x, dtype=np.float64) for name, x in term.values.items()}
    for row, name in enumerate(names):
        moved[name][row] += _SMALL
    rows = np.atleast_2d(data.predicted(_with(axis, term, replace(term, values=moved))))
    return np.asarray((rows - made) / _SMALL)


def _with(axis: AxisModel, term: Term, other: Term) -> AxisModel:
    """A model with another term in the place of one."""
    return replace(axis, terms=tuple(other if t is term else t for t in axis.terms))

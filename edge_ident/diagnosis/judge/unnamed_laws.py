"""Laws that a named effect may be taken for, and that no curve of the error budget is.

What a machine has can change along the stroke: the inertia of a crank, the force constant of a
motor, friction that differs from place to place. Along one motion each looks like the effect of the
catalogue with the same period, and the catalogue would name that. Here each takes the cause's place
(curves without a law do in `judge.free_curves`). Where one describes the effort decisively better,
the cause is none; nor is a change at one moment that a law with fewer parameters describes as well.
Source: Lagrange's equation for inertia along the stroke, J(x)·a + J'(x)·v²/2.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel, bounds
from edge_ident.diagnosis.fit.linear import solve_within
from edge_ident.diagnosis.fit.summary import along
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.thresholds import DECISIVE
from edge_ident.model.effect import Values
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel
from edge_ident.model.motion import Motion
from edge_ident.model.search import ChangesWith, Form

Array = NDArray[np.float64]
Law = Callable[[Motion, Array, Values], Array]
"""Columns (k, N) along a motion, from the effort (N,) of the model without the cause, and from the
cause's parameters."""


def _shapes(motion: Motion, values: Values) -> tuple[Array, Array]:
    """What changes along the stroke (k, N), and its derivatives by the position: a bump, cosine and
    sine, or powers of the distance from the middle."""
    if np.any(values.get("bump", 0.0)):
        away = (motion.position - float(values["place"])) / float(values["width"])
        at_place = np.exp(-np.square(away))[None]
        return at_place, -2.0 * away / float(values["width"]) * at_place
    if not any(np.any(values.get(name, 0.0)) for name in ("cosine", "sine")):
        away = motion.position - float(values.get("centre", 0.0))
        given = [name for name in ("curvature", "cubic") if np.any(values.get(name, 0.0))]
        powers = np.arange(1, 2 + len(given))[:, None]
        return away**powers, powers * away ** (powers - 1)
    rate = math.tau / float(values["period"])
    cosine, sine = np.cos(rate * motion.position), np.sin(rate * motion.position)
    return np.stack([cosine, sine]), rate * np.stack([-sine, cosine])


def _inertia(motion: Motion, effort: Array, values: Values) -> Array:
    shape, slope = _shapes(motion, values)
    return shape * motion.acceleration + 0.5 * slope * motion.velocity**2


def _viscous(motion: Motion, effort: Array, values: Values) -> Array:
    return _shapes(motion, values)[0] * motion.velocity


def _force(motion: Motion, effort: Array, values: Values) -> Array:
    return _shapes(motion, values)[0] * effort


def _follows_load(motion: Motion, effort: Array, values: Values) -> Array:
    """A loss of what is transmitted, to all or to a part of the inertia."""
    lost = np.sign(motion.transmitted) * motion.direction
    return lost * np.stack([motion.transmitted, motion.acceleration])


def _force_from_then_on(motion: Motion, effort: Array, values: Values) -> Array:
    later = (motion.time_s >= values["time"]) & (values["clock"] == motion.clock)
    return np.asarray(effort * later)[None]


def _one_sided(motion: Motion, effort: Array, values: Values) -> Array:
    return np.abs(effort)[None]


_LAWS: Final[Mapping[ChangesWith | None, Mapping[str, Law]]] = {
    ChangesWith.STROKE: {
        "an inertia that changes along the stroke": _inertia,
        "viscous friction that changes along the stroke": _viscous,
        "a force constant of the motor that changes along the stroke": _force,
        "friction that follows the load": _follows_load,
        "a gain that differs with the sign of the effort": _one_sided,
    },
    ChangesWith.MOMENT: {"a force constant that changes then": _force_from_then_on},
    ChangesWith.EFFORT: {"a gain that differs with the sign of the effort": _one_sided},
}
"""But for friction that follows the load, none has more parameters than an effect that changes
likewise."""


def unnamed(search: Search, model: FittedModel) -> dict[int, str]:
    """Reasons against terms in whose place a law outside the catalogue is better.

    Decisively so. What happens at one moment may also be a law with fewer parameters that is not
    decisively worse; other laws are special cases of effects that change likewise.

    Parameters
    ----------
    search : Search
    model : FittedModel

    Returns
    -------
    mapping of place to str
        Places are those of `model.terms`.
    """
    doubts = {}
    for k, term in enumerate(model.terms):
        laws = _LAWS.get(term.candidate.form.changes, {})
        if laws and (reason := _better(search, model, k, laws)):
            doubts[k] = reason
    return doubts


def _better(search: Search, model: FittedModel, place: int, laws: Mapping[str, Law]) -> str:
    """Which law is better than a term, and how; nothing where none is."""
    term = model.terms[place]
    rest = search.fit(model.base, model.without(place))
    of_cause = search.criterion.misfit(model.error)
    load = _without_friction(model.axis_without([place]))
    along_it = [
        (s, replace(s.motion, transmitted=along(s, load)), along(s, rest.axis))
        for s in search.data.segments
    ]
    found = {}
    for name, law in laws.items():
        parts = [s.filter(law(motion, effort, term.values)) for s, motion, effort in along_it]
        found[name] = _tried(search, rest, np.hstack(parts).T)
    better = {
        name: misfit
        for name, (misfit, parameters) in found.items()
        if of_cause - misfit > _needed(parameters, term.candidate.form)
    }
    if not better:
        return ""
    best = min(better, key=lambda name: better[name])
    decisive = of_cause - better[best] > DECISIVE
    how = "better" if decisive else "as well, with fewer parameters"
    return f"{best} describes the effort {how}"


def _needed(parameters: int, form: Form) -> float:
    """Units by which a law with so many parameters has to be better than a cause of this form; each
    parameter that it has more has to be decisive."""
    more = parameters - len(form.linear)
    if more < 0 and form.changes is ChangesWith.MOMENT:
        return -DECISIVE
    return DECISIVE * (1 + max(more, 0))


def _tried(search: Search, rest: FittedModel, columns: Array) -> tuple[float, int]:
    """What the sum of squares costs that a law of these columns (n, k) leaves beside the other
    terms, which keep their bounds; and the number k of the law's parameters."""
    data = search.data
    changes = np.hstack([rest.derivatives, columns])[data.valid]
    free = np.full(columns.shape[1], np.inf)
    low, high = np.array(bounds(data, rest.template, rest.terms)) - rest.linear_parameters
    low, high = np.append(low, -free), np.append(high, free)
    residual = (data.effort - rest.predicted)[data.valid]
    step = solve_within(changes, residual, low, high).solution
    error = float(np.sum((residual - changes @ step) ** 2))
    return search.criterion.misfit(error), columns.shape[1]


def _without_friction(axis: AxisModel) -> AxisModel:
    """What an axis resists with but for its friction: the load that a transmission carries."""
    base, *added = axis.terms
    smooth = {**base.values, "viscous_friction": 0.0, "coulomb_friction": 0.0}
    kept = (t for t in added if not named(t.effect).overrides("friction"))
    return AxisModel((replace(base, values=smooth), *kept))

"""Derivatives of a model's effort by its linear parameters, where the efforts do not add up."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import alone, cached_effort, effort_key
from edge_ident.diagnosis.fit.own_columns import own_columns
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel, Term

Array = NDArray[np.float64]

_SMALL: Final = 1e-6


def derivatives(
    data: AxisData, axis: AxisModel, predicted: Array, linear: Sequence[Collection[str]]
) -> Array:
    """Derivatives (n, P) by base parameters, the recordings' own, and linear parameters.

    Parameters
    ----------
    predicted : (n,) array
        Effort of the model.
    linear : sequence of collection of str
        Linear parameters of each of the last terms.
    """
    first = len(axis.terms) - len(linear)
    names = {0: PARAMETERS} | {k: tuple(x) for k, x in enumerate(linear, first) if x}
    base, *added = (_of_term(data, axis, predicted, *place).T for place in names.items())
    return np.hstack([base, own_columns(data), *added])


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
    if key not in data.cache:
        made = cached_effort(data, needed)
        data.cache[key] = _difference(data, needed, made, at_zero, names)
    return data.cache[key]


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

"""Derivatives of a model's effort by its linear parameters, where the efforts do not add up."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import alone, cached_effort
from edge_ident.diagnosis.fit.own_columns import own_columns
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.model import PARAMETERS, AxisModel

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
    """Derivatives (K, n) by K parameters of the term at one place."""
    term, needed = axis.terms[place], alone(axis, place)
    moved = {name: np.full(len(names), x, dtype=np.float64) for name, x in term.values.items()}
    for row, name in enumerate(names):
        moved[name][row] += _SMALL
    if needed is not axis:
        predicted = cached_effort(data, needed)
    terms = tuple(replace(term, values=moved) if t is term else t for t in needed.terms)
    rows = np.atleast_2d(data.predicted(replace(needed, terms=terms)))
    return np.asarray((rows - predicted) / _SMALL)

"""What single terms add to the effort, and how it changes with their parameters.

All is to first order: terms are taken on top of the base model alone, as if their efforts add up.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.experiment.compared import Compared
from edge_ident.model.model import PARAMETERS, AxisModel, Term

Array = NDArray[np.float64]

_STEP: Final = 1e-3
"""Relative step of derivatives: coarse enough for effects that act in jumps."""


Key = tuple[object, ...]
"""What tells a term from others: effect, other axis and values."""


@dataclass(frozen=True)
class Columns:
    """A term at the n compared samples.

    Attributes
    ----------
    effort : (n,) array
    derivatives : (P, n) array
        By its parameters that are not zero, per relative change.
    peak : float
        Largest effort before the filter.
    """

    effort: Array
    derivatives: Array
    peak: float


@dataclass(frozen=True)
class BaseColumns:
    """The base model at the n compared samples.

    Attributes
    ----------
    effort : (n,) array
    columns : (4 + R, n) array
        Of the four parameters, and of a shift in time of each of R recordings.
    """

    effort: Array
    columns: Array


def base_columns(compared: Compared, base: AxisModel) -> BaseColumns:
    """The base model; `base` has its term alone."""
    unit = dict(zip(PARAMETERS, np.eye(len(PARAMETERS)), strict=True))
    rows = compared.raw(replace(base, terms=(replace(base.terms[0], values=unit),)))
    filtered = compared.filtered(rows)
    columns = np.vstack([filtered, compared.timing(base.parameters @ rows)])
    return BaseColumns(base.parameters @ filtered, columns)


def key(term: Term) -> Key:
    """The key of a term with plain values."""
    return (term.effect, term.source_axis, *(float(value) for value in term.values.values()))


def term_effort(compared: Compared, base: AxisModel, term: Term) -> Array:
    """Filtered effort (n,) that a term adds to the base model."""
    added = compared.raw(replace(base, terms=(base.terms[0], term))) - compared.raw(base)
    return compared.filtered(added)


def term_columns(compared: Compared, base: AxisModel, terms: Sequence[Term]) -> list[Columns]:
    """Efforts and derivatives of terms, filtered together."""
    without = compared.raw(base)
    rows = [
        np.atleast_2d(compared.raw(replace(base, terms=(base.terms[0], _moved(t))))) - without
        for t in terms
    ]
    filtered = np.split(
        compared.filtered(np.vstack(rows)), np.cumsum([len(part) for part in rows])[:-1]
    )
    return [
        Columns(part[0], (part[1::2] - part[2::2]) / (2.0 * _STEP), float(np.max(np.abs(raw[0]))))
        for part, raw in zip(filtered, rows, strict=True)
    ]


def _moved(term: Term) -> Term:
    """A term with its values, and with each nonzero one a step higher and lower: D = 1 + 2·P."""
    names = [name for name, value in term.values.items() if float(value) != 0.0]
    values: Mapping[str, Array] = {
        name: np.full(1 + 2 * len(names), float(value)) for name, value in term.values.items()
    }
    for k, name in enumerate(names):
        values[name][1 + 2 * k] *= 1.0 + _STEP
        values[name][2 + 2 * k] *= 1.0 - _STEP
    return replace(term, values=values)

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
    raw : (N,) array
        The effort before the filter.
    """

    effort: Array
    derivatives: Array
    raw: Array


@dataclass(frozen=True)
class BaseColumns:
    """The base model at the n compared samples.

    Attributes
    ----------
    effort : (n,) array
    columns : (4 + R, n) array
        Of the four parameters, and of a shift in time of each of R recordings.
    raw : (4, N) array
        Of the four parameters, before the filter.
    """

    effort: Array
    columns: Array
    raw: Array


def base_columns(compared: Compared, base: AxisModel) -> BaseColumns:
    """The base model; `base` has its term alone."""
    unit = dict(zip(PARAMETERS, np.eye(len(PARAMETERS)), strict=True))
    rows = compared.raw(replace(base, terms=(replace(base.terms[0], values=unit),)))
    filtered = compared.filtered(rows)
    columns = np.vstack([filtered, compared.timing(base.parameters @ rows)])
    return BaseColumns(base.parameters @ filtered, columns, rows)


def key(term: Term) -> Key:
    """The key of a term with plain values."""
    return (term.effect, term.source_axis, *(float(value) for value in term.values.values()))


def term_effort(compared: Compared, base: AxisModel, term: Term) -> Array:
    """Filtered effort (n,) that a term adds to the base model."""
    return compared.filtered(_added(compared, base, term))


def term_columns(compared: Compared, terms: Sequence[tuple[AxisModel, Term]]) -> list[Columns]:
    """Efforts and derivatives of terms, each on top of a base model, filtered together."""
    if not terms:
        return []
    rows = [np.atleast_2d(_added(compared, base, _moved(t))) for base, t in terms]
    ends = np.cumsum([len(part) for part in rows])[:-1]
    filtered = np.split(compared.filtered(np.vstack(rows)), ends)
    return [
        Columns(part[0], (part[1::2] - part[2::2]) / (2.0 * _STEP), raw[0])
        for part, raw in zip(filtered, rows, strict=True)
    ]


def _added(compared: Compared, base: AxisModel, term: Term) -> Array:
    """Effort (..., N) that a term adds to a base model, before the filter."""
    together = replace(base, terms=(base.terms[0], term))
    return np.asarray(compared.raw(together) - compared.raw(base))


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

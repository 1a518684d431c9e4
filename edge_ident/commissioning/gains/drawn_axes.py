"""An axis with many values of its uncertain parameters, as recorded and from then on."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.base_in_time import base_at
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel, Term

DRAWS: Final = 19
"""A twentieth equal draw lies between the smallest and the largest in 18 of 20 cases."""
_LEAST_SHARE: Final = 0.1
"""Least share of an inertia or friction that a draw leaves: they are positive."""


def drawn_axis(
    axis: AxisModel, rng: np.random.Generator, moved: NDArray[np.float64] | None = None
) -> AxisModel:
    """The axis with (1 + DRAWS,) values of every parameter, its own first.

    Parameters
    ----------
    axis : AxisModel
    rng : Generator
    moved : (1 + DRAWS, 4) array, optional
        By how much the base parameters differ, where that is known of all together.
    """
    base, *others = axis.terms
    if moved is None:
        base = _drawn_term(base, rng)
    else:
        drawn = {name: float(base.values[name]) + moved[:, n] for n, name in enumerate(PARAMETERS)}
        base = replace(base, values=_within_bounds(base, drawn))
    return replace(axis, terms=(base, *(_drawn_term(term, rng) for term in others)))


def from_then_on(drawn: AxisModel, end_s: float | None) -> AxisModel:
    """Drawn axes after the recording that the model was made from.

    What belongs to the time of the recording will not be the same again. Where it changes base
    parameters, they stay as they are at its end.

    Parameters
    ----------
    drawn : AxisModel
    end_s : float or None
        End of the recording, where it is known, from its first sample on.
    """
    lasting = tuple(term for term in drawn.terms if not named(term.effect).tied_to_time)
    if len(lasting) == len(drawn.terms):
        return drawn
    if end_s is not None:
        each = [base_at(_one(drawn, n), end_s).parameters for n in range(1 + DRAWS)]
        values = dict(zip(PARAMETERS, np.array(each).T, strict=True))
        lasting = (replace(lasting[0], values=values), *lasting[1:])
    return replace(drawn, terms=lasting)


def _drawn_term(term: Term, rng: np.random.Generator) -> Term:
    values = {
        name: float(value) + term.std.get(name, 0.0) * np.append(0.0, rng.normal(size=DRAWS))
        for name, value in named(term.effect).complete(term.values).items()
    }
    return replace(term, values=_within_bounds(term, values))


def _within_bounds(
    term: Term, drawn: Mapping[str, NDArray[np.float64]]
) -> dict[str, float | NDArray[np.float64]]:
    """Drawn values as far as physics allows them."""
    bounds = named(term.effect).bounds
    found: dict[str, float | NDArray[np.float64]] = {}
    for name, values in drawn.items():
        low, high = bounds[name]
        least = _LEAST_SHARE * float(values[0]) if low >= 0.0 else low
        found[name] = np.clip(values, max(low, least), high)
    return found


def _one(drawn: AxisModel, n: int) -> AxisModel:
    """One of the drawn axes."""
    terms = (
        replace(term, values={name: np.asarray(value)[n] for name, value in term.values.items()})
        for term in drawn.terms
    )
    return replace(drawn, terms=tuple(terms))

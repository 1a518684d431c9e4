"""What single terms of a fitted model contribute to its effort."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import cached_regressors
from edge_ident.diagnosis.fit.fitting import FittedModel, additive
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Term
from edge_ident.model.motion import LARGEST_SHIFT

Array = NDArray[np.float64]


def term_effort(data: AxisData, model: FittedModel, index: int) -> Array:
    """Effort (n,) of one added term beside the others; to first order where efforts do not add up.

    Parameters
    ----------
    index : int
        Place among the terms that the diagnosis added.
    """
    t, columns = model.terms[index], model.columns_of(index)
    if not t.linear:
        rows = cached_regressors(data, model.template, t.candidate, t.nonlinear)
        return np.asarray(rows[0])
    return np.asarray(model.derivatives[:, columns] @ model.linear_parameters[columns])


def contributions(data: AxisData, model: FittedModel) -> list[Array]:
    """What each added term adds to the prediction of a model, (n,) each."""
    places = range(len(model.terms))
    if additive(model.template, model.terms):
        return [term_effort(data, model, k) for k in places]
    return [_added(data, model, k) for k in places]


def _added(data: AxisData, model: FittedModel, index: int) -> Array:
    return data.predicted(model.axis) - data.predicted(reduced_axis(data, model, [index]))


def reduced_axis(data: AxisData, model: FittedModel, places: Sequence[int]) -> AxisModel:
    """A model's axis without some of its added terms; all parameters stay as they are.

    Of a delay, only what exceeds the timing of a controller is left out: the rest is part of every
    base model.
    """
    first, rest = len(model.template.terms), model.axis_without(places)
    largest_s = LARGEST_SHIFT * max(s.raw_period_s for s in data.segments)
    left_out = [model.axis.terms[first + place] for place in places]
    timing = [_timing(term, largest_s) for term in left_out if named(term.effect).effort_delay]
    return replace(rest, terms=(*rest.terms, *timing))


def _timing(delay: Term, largest_s: float) -> Term:
    """As much of a delay as the base model may have."""
    name = named(delay.effect).effort_delay
    shift_s = min(max(delay.values[name], -largest_s), largest_s)
    return replace(delay, values={**delay.values, name: shift_s})

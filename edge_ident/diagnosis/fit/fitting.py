"""Least-squares fits of models with several terms."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import (
    Candidate,
    adds,
    base_regressor,
    cached_effort,
    cached_regressors,
    derivatives,
    effort_adds,
    effort_key,
    known_effort,
    own_columns,
    own_limits,
    term,
)
from edge_ident.diagnosis.fit.linear import solve_within
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.model.motion import LARGEST_SHIFT

Array = NDArray[np.float64]


_ITERATIONS: Final = 4
"""Gauss-Newton steps; all but a few amplitudes are linear."""
_CONVERGED: Final = 1e-3
"""Error of the linear prediction of a step, of the residual, at which the iteration ends."""


@dataclass(frozen=True)
class FittedTerm:
    """A candidate with values of its nonlinear and linear parameters."""

    candidate: Candidate
    nonlinear: dict[str, float]
    linear: dict[str, float]

    @property
    def model_term(self) -> Term:
        """As part of a model."""
        return term(self.candidate, self.nonlinear, self.linear)

    @property
    def values(self) -> dict[str, Array]:
        """All parameters of the effect, by name."""
        return {name: np.asarray(value) for name, value in self.model_term.values.items()}


@dataclass(frozen=True)
class FittedModel:
    """A model, fitted to the valid samples of an axis, inside its physical bounds.

    Attributes
    ----------
    base : (4,) array
        Base parameters.
    own : (R + K·(R - 1),) array
        What each of R recordings has of its own: its further shift in s, beyond what its
        preparation took out; then K parameters of each but the last, above those of the last.
    terms : tuple of FittedTerm
        Terms that the diagnosis added.
    predicted : (n,) array
        At all compared samples.
    rows : tuple of (k, n) arrays
        Derivatives by base parameters, the recordings' own, and each term's linear parameters;
        models of the same data share them.
    free : (P,) array of bool
        Parameters that no bound holds.
    error : float
        Sum of squared residuals over the valid samples.
    """

    axis: AxisModel
    base: Array
    own: Array
    terms: tuple[FittedTerm, ...]
    predicted: Array
    rows: tuple[Array, ...]
    free: NDArray[np.bool_]
    error: float

    @cached_property
    def key(self) -> Hashable:
        """What tells the model from others that are fitted to the same data."""
        candidates = tuple(t.candidate for t in self.terms)
        return effort_key(self.axis), candidates, self.own.tobytes(), self.free.tobytes()

    @property
    def linear_parameters(self) -> Array:
        """Base parameters, the recordings' own and linear parameters (P,), as in the Jacobian."""
        return _linear_parameters(self.base, self.own, self.terms)

    @property
    def derivatives(self) -> Array:
        """The rows as columns, (n, P)."""
        return np.vstack(self.rows).T

    @property
    def jacobian(self) -> Array:
        """The derivatives, zero for what a bound holds."""
        return np.where(self.free, self.derivatives, 0.0)

    def of_law(self, term: FittedTerm) -> tuple[int, ...]:
        """Places of the added terms that have the source of a term, and its effect or its curve:
        two laws of friction over speed are one friction, and may largely cancel."""
        laws = [_law(t.candidate) for t in (term, *self.terms)]
        return tuple(k for k, law in enumerate(laws[1:]) if law == laws[0])

    def axis_without(self, places: Sequence[int]) -> AxisModel:
        """The axis without some of the added terms; all parameters stay as they are."""
        first = len(self.template.terms)
        left_out = {first + place for place in places}
        terms = (t for k, t in enumerate(self.axis.terms) if k not in left_out)
        return replace(self.axis, terms=tuple(terms))

    @property
    def effects(self) -> frozenset[str]:
        """Names of the effects that the diagnosis added."""
        return frozenset(t.candidate.effect for t in self.terms)

    @property
    def base_columns(self) -> slice:
        """Columns of the Jacobian that belong to the base model and to the recordings' own."""
        return slice(0, len(PARAMETERS) + len(self.own))

    def columns_of(self, index: int) -> slice:
        """Columns of the Jacobian that belong to one term."""
        sizes = [len(t.linear) for t in self.terms]
        first = self.base_columns.stop + sum(sizes[:index])
        return slice(first, first + sizes[index])

    def without(self, index: int) -> tuple[FittedTerm, ...]:
        """All terms but one."""
        return self.terms[:index] + self.terms[index + 1 :]

    @property
    def template(self) -> AxisModel:
        """The axis without the terms that the diagnosis added."""
        known = len(self.axis.terms) - len(self.terms)
        return replace(self.axis, terms=self.axis.terms[:known])


def fit(
    data: AxisData, template: AxisModel, base: Array, terms: Sequence[FittedTerm]
) -> FittedModel:
    """Fit base parameters, the recordings' own and linear ones; nonlinear ones stay as they are.

    Parameters
    ----------
    base : (4,) array
        Base parameters to start from.
    terms : sequence of FittedTerm
        Terms to add, with linear parameters to start from.
    """
    terms = tuple(terms)
    key: tuple[Hashable, ...] = ("fit", effort_key(replace(template, terms=template.terms[1:])))
    key += tuple((t.candidate, *t.nonlinear.values()) for t in terms)
    if not additive(template, terms):  # where it starts from matters
        key += (base.tobytes(), *(tuple(t.linear.values()) for t in terms))
        return data.once(key, lambda: _fit_in_steps(data, template, base, terms))
    return data.once(key, lambda: _fit_additive(data, template, terms))


def _fit_in_steps(
    data: AxisData, template: AxisModel, base: Array, terms: tuple[FittedTerm, ...]
) -> FittedModel:
    """Steps of Gauss and Newton."""
    low, high = bounds(data, template, terms)
    columns = own_columns(data)
    own = np.zeros(columns.shape[1])
    axis = build(template, base, terms)
    made = cached_effort(data, axis)
    for _ in range(_ITERATIONS):
        rows = derivatives(data, axis, made, [t.linear for t in terms])
        jacobian = np.vstack(rows).T
        present = _linear_parameters(base, own, terms)
        predicted = made + columns @ own
        residual = (data.effort - predicted)[data.valid]
        step = solve_within(jacobian[data.valid], residual, low - present, high - present)
        base, own, terms = _split(present + step.solution, terms)
        axis = build(template, base, terms)
        linear_prediction = predicted + jacobian @ step.solution
        made = cached_effort(data, axis)
        predicted = made + columns @ own
        if np.max(np.abs(predicted - linear_prediction)) < _CONVERGED * np.std(residual):
            break
    residual = (data.effort - predicted)[data.valid]
    return FittedModel(
        axis,
        base,
        own,
        terms,
        predicted,
        rows,
        step.free,
        float(residual @ residual),
    )


def _law(candidate: Candidate) -> tuple[Hashable, ...]:
    """What a candidate adds to: a curve, or what its effect does; and the axis it acts from."""
    return named(candidate.effect).search.curve or candidate.effect, candidate.source


def additive(template: AxisModel, terms: Sequence[FittedTerm]) -> bool:
    """Whether the efforts of all terms add up, those that the axis is known to have included."""
    known = all(effort_adds(t.effect) for t in template.terms[1:])
    return known and all(adds(t.candidate) for t in terms)


def delayed(axis: AxisModel) -> bool:
    """Whether a term of a model carries the whole delay of the effort."""
    return any(named(t.effect).effort_delay for t in axis.terms)


def _fit_additive(
    data: AxisData, template: AxisModel, terms: tuple[FittedTerm, ...]
) -> FittedModel:
    """Linear least squares on cached regressors, after terms without linear parameters."""
    rows = _additive_rows(data, template, terms)
    jacobian = np.vstack(rows).T
    other = [t for t in terms if not t.linear]
    fixed = sum(
        (cached_regressors(data, template, t.candidate, t.nonlinear)[0] for t in other),
        known_effort(data, template),
    )
    low, high = bounds(data, template, terms)
    found = solve_within(jacobian[data.valid], (data.effort - fixed)[data.valid], low, high)
    base, own, terms = _split(found.solution, terms)
    predicted = np.asarray(jacobian @ found.solution + fixed)
    residual = (data.effort - predicted)[data.valid]
    return FittedModel(
        build(template, base, terms),
        base,
        own,
        terms,
        predicted,
        rows,
        found.free,
        float(residual @ residual),
    )


def bounds(data: AxisData, template: AxisModel, terms: Sequence[FittedTerm]) -> tuple[Array, Array]:
    """Physical bounds (P,) of base parameters, the recordings' own and linear parameters.

    A delay in the model carries the whole shift, and no recording has a further one.
    """
    shifted = not delayed(build(template, np.zeros(len(PARAMETERS)), terms))
    own = np.stack(own_limits(data, shifted=shifted), axis=1)
    pairs = [named(BASE).bounds[name] for name in PARAMETERS]
    pairs += own.tolist()
    pairs += [named(t.candidate.effect).bounds[name] for t in terms for name in t.linear]
    low, high = np.array(pairs).T
    return low, high


def _additive_rows(
    data: AxisData, template: AxisModel, terms: tuple[FittedTerm, ...]
) -> tuple[Array, ...]:
    """Derivatives by base parameters, the recordings' own, and linear parameters."""
    rows = (cached_regressors(data, template, t.candidate, t.nonlinear) for t in terms if t.linear)
    return (base_regressor(data).T, own_columns(data).T, *rows)


def _linear_parameters(base: Array, own: Array, terms: Sequence[FittedTerm]) -> Array:
    return np.array([*base, *own, *(value for t in terms for value in t.linear.values())])


def build(template: AxisModel, base: Array, terms: Sequence[FittedTerm]) -> AxisModel:
    """The model of base parameters, the template's effects and the added terms."""
    values = dict(zip(PARAMETERS, base, strict=True))
    added = (t.model_term for t in terms)
    return replace(template, terms=(Term(BASE, values), *template.terms[1:], *added))


def _split(
    parameters: Array, terms: tuple[FittedTerm, ...]
) -> tuple[Array, Array, tuple[FittedTerm, ...]]:
    """Base parameters, the recordings' own and the terms, of linear parameters (P,)."""
    sizes = [len(t.linear) for t in terms]
    ends = np.cumsum([len(PARAMETERS), len(parameters) - len(PARAMETERS) - sum(sizes), *sizes])
    base, own, *parts = np.split(parameters, ends[:-1])
    moved = tuple(
        replace(t, linear=dict(zip(t.linear, part.tolist(), strict=True)))
        for t, part in zip(terms, parts, strict=True)
    )
    return base, own, moved


def jacobian_of(data: AxisData, fitted: FittedModel) -> Array:
    """The Jacobian (n, P) of a fitted model on other data at the same samples."""
    if additive(fitted.template, fitted.terms):
        return np.vstack(_additive_rows(data, fitted.template, fitted.terms)).T
    linear = [t.linear for t in fitted.terms]
    return np.vstack(derivatives(data, fitted.axis, cached_effort(data, fitted.axis), linear)).T


# What single terms of a fitted model contribute to its effort.


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

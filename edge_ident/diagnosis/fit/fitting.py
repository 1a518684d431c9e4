"""Least-squares fits of models with several terms."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, cached_regressors, term
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.estimation.least_squares import unit_length
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term

Array = NDArray[np.float64]

_ITERATIONS: Final = 4
"""Gauss-Newton steps; all but a few amplitudes are linear."""
_CONVERGED: Final = 1e-3
"""Error of the linear prediction of a step, of the residual, at which the iteration ends."""
_SMALL: Final = 1e-6
_RANK: Final = 1e-9


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


@dataclass(frozen=True)
class FittedModel:
    """A model, fitted to the valid samples of an axis.

    Attributes
    ----------
    axis : AxisModel
    base : (4,) array
        Base parameters.
    terms : tuple of FittedTerm
        Terms that the diagnosis added.
    predicted : (n,) array
        At all compared samples.
    jacobian : (n, P) array
        Derivatives by the base parameters, then by each term's linear parameters.
    error : float
        Sum of squared residuals over the valid samples.
    """

    axis: AxisModel
    base: Array
    terms: tuple[FittedTerm, ...]
    predicted: Array
    jacobian: Array
    error: float

    @property
    def linear_parameters(self) -> Array:
        """Base parameters and linear parameters (P,), in the order of the Jacobian."""
        return _linear_parameters(self.base, self.terms)

    @property
    def effects(self) -> frozenset[str]:
        """Names of the effects that the diagnosis added."""
        return frozenset(t.candidate.effect for t in self.terms)

    def columns_of(self, index: int) -> slice:
        """Columns of the Jacobian that belong to one term."""
        sizes = [len(t.linear) for t in self.terms]
        first = len(PARAMETERS) + sum(sizes[:index])
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
    """Fit base parameters and linear parameters; nonlinear parameters stay as they are.

    Parameters
    ----------
    template : AxisModel
        The axis with the effects that it is known to have.
    base : (4,) array
        Base parameters to start from.
    terms : sequence of FittedTerm
        Terms to add, with linear parameters to start from.
    """
    terms = tuple(terms)
    if additive(template, terms):
        return _fit_additive(data, template, terms)
    axis = build(template, base, terms)
    predicted = data.predicted(axis)
    for _ in range(_ITERATIONS):
        jacobian = _jacobian(data, axis, predicted, terms)
        residual = (data.effort - predicted)[data.valid]
        step = solve(jacobian[data.valid], residual)
        if base[0] + step[0] < 0.0:
            predicted = predicted - base[0] * jacobian[:, 0]
            base = np.array([0.0, *base[1:]])
            jacobian = _without_inertia(jacobian)
            step = solve(jacobian[data.valid], (data.effort - predicted)[data.valid])
        base, terms = _moved(base, terms, step)
        axis = build(template, base, terms)
        linear_prediction = predicted + jacobian @ step
        predicted = data.predicted(axis)
        if np.max(np.abs(predicted - linear_prediction)) < _CONVERGED * np.std(residual):
            break
    residual = (data.effort - predicted)[data.valid]
    return FittedModel(axis, base, terms, predicted, jacobian, float(residual @ residual))


def additive(template: AxisModel, terms: Sequence[FittedTerm]) -> bool:
    """Whether the efforts of all terms add up."""
    return len(template.terms) == 1 and all(named(t.candidate.effect).additive for t in terms)


def _fit_additive(
    data: AxisData, template: AxisModel, terms: tuple[FittedTerm, ...]
) -> FittedModel:
    """Linear least squares on cached regressors."""
    jacobian = _additive_jacobian(data, template, terms)
    step = solve(jacobian[data.valid], data.effort[data.valid])
    if step[0] < 0.0:
        jacobian = _without_inertia(jacobian)
        step = solve(jacobian[data.valid], data.effort[data.valid])
    base, terms = _moved(np.zeros(4), tuple(_zeroed(t) for t in terms), step)
    predicted = np.asarray(jacobian @ _linear_parameters(base, terms))
    residual = (data.effort - predicted)[data.valid]
    axis = build(template, base, terms)
    return FittedModel(axis, base, terms, predicted, jacobian, float(residual @ residual))


def _without_inertia(jacobian: Array) -> Array:
    """The Jacobian (n, P) with the inertia held at zero.

    No physics makes an inertia negative. What would make it so is another effect in phase with the
    acceleration, such as a spring along a sinusoid.
    """
    return np.concatenate([np.zeros((len(jacobian), 1)), jacobian[:, 1:]], axis=1)


def _zeroed(fitted: FittedTerm) -> FittedTerm:
    return replace(fitted, linear=dict.fromkeys(fitted.linear, 0.0))


def _additive_jacobian(data: AxisData, template: AxisModel, terms: tuple[FittedTerm, ...]) -> Array:
    """Derivatives (n, P) by base parameters and linear parameters."""
    if "base" not in data.cache:
        unit = dict(zip(PARAMETERS, np.eye(4), strict=True))
        data.cache["base"] = data.predicted(replace(template, terms=(Term(BASE, unit),)))
    parts = [data.cache["base"]]
    parts += [cached_regressors(data, template, t.candidate, t.nonlinear) for t in terms]
    return np.vstack(parts).T


def _linear_parameters(base: Array, terms: Sequence[FittedTerm]) -> Array:
    return np.array([*base, *(value for t in terms for value in t.linear.values())])


def build(template: AxisModel, base: Array, terms: Sequence[FittedTerm]) -> AxisModel:
    """The model of base parameters, the template's effects and the added terms."""
    values = dict(zip(PARAMETERS, base, strict=True))
    known = template.terms[1:]
    return replace(template, terms=(Term(BASE, values), *known, *(t.model_term for t in terms)))


def solve(regressor: Array, target: Array) -> Array:
    """Least squares on columns of unit length; parameters that are not excited stay at zero.

    Parameters
    ----------
    regressor : (n, P) array
    target : (n,) array

    Returns
    -------
    (P,) array
    """
    unit, length = unit_length(regressor)
    return np.asarray((np.linalg.lstsq(unit, target, rcond=_RANK)[0].T / length).T)


def _moved(
    base: Array, terms: tuple[FittedTerm, ...], step: Array
) -> tuple[Array, tuple[FittedTerm, ...]]:
    """Base parameters and terms after a step (P,), inside the physical bounds."""
    at = len(PARAMETERS)
    moved = []
    for t in terms:
        linear = {}
        bounds = named(t.candidate.effect).bounds
        for name, value in t.linear.items():
            low, high = bounds[name]
            linear[name] = min(max(value + float(step[at]), low), high)
            at += 1
        moved.append(replace(t, linear=linear))
    return base + step[: len(PARAMETERS)], tuple(moved)


def _jacobian(
    data: AxisData, axis: AxisModel, predicted: Array, terms: tuple[FittedTerm, ...]
) -> Array:
    """Derivatives (n, P) by base parameters and linear parameters, in one batch."""
    places = [(0, name) for name in PARAMETERS]
    first = len(axis.terms) - len(terms)
    for k, t in enumerate(terms):
        places += [(first + k, name) for name in t.linear]
    changed = list(axis.terms)
    for row, (index, name) in enumerate(places):
        values = dict(changed[index].values)
        array = np.asarray(values[name], dtype=np.float64) * np.ones(len(places))
        array[row] += _SMALL
        changed[index] = replace(changed[index], values={**values, name: array})
    rows = data.predicted(replace(axis, terms=tuple(changed)))
    return np.asarray(((rows - predicted) / _SMALL).T)


def jacobian_of(data: AxisData, fitted: FittedModel) -> Array:
    """The Jacobian (n, P) of a fitted model on other data at the same samples."""
    if additive(fitted.template, fitted.terms):
        return _additive_jacobian(data, fitted.template, fitted.terms)
    return _jacobian(data, fitted.axis, data.predicted(fitted.axis), fitted.terms)

"""Fitting a model with several terms to a view, and how well it does on stretches left out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, term, unit_columns
from edge_ident.diagnosis.prepare.view import View
from edge_ident.estimation.covariance import coloured_std
from edge_ident.estimation.least_squares import unit_length
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term

Array = NDArray[np.float64]

_ITERATIONS: Final = 4
"""Of Gauss and Newton; all but a few amplitudes are linear."""
_DERIVATIVE: Final = 1e-3
"""Relative step for derivatives by shapes, coarse enough for effects that act in jumps."""
_LINEAR: Final = 1e-3
"""Share of the residual by which a step may miss what it foresaw."""
_SMALL: Final = 1e-6
_TINY: Final = float(np.finfo(float).tiny)
_RANK: Final = 1e-9
_FOLDS: Final = 5
_LEARNED: Final = 0.05
"""Share of a column's energy that the rest must have to say anything of what is left out."""


@dataclass(frozen=True)
class Found:
    """A candidate with its shapes and amplitudes."""

    candidate: Candidate
    shapes: dict[str, float]
    amplitudes: dict[str, float]

    @property
    def term(self) -> Term:
        """As part of a model."""
        return term(self.candidate, self.shapes, self.amplitudes)


@dataclass(frozen=True)
class Fitted:
    """A model fitted to the clear samples of a view.

    Attributes
    ----------
    base : (4,) array
    found : tuple of Found
    predicted : (n,) array
        At all picks.
    jacobian : (n, P) array
        By base parameters, then each term's amplitudes.
    """

    axis: AxisModel
    base: Array
    found: tuple[Found, ...]
    predicted: Array
    jacobian: Array
    error: float
    """Sum of squares over the clear samples."""

    @property
    def linear(self) -> Array:
        """Base parameters and amplitudes, in the order of the jacobian."""
        return _linear(self.base, self.found)

    def columns_of(self, index: int) -> slice:
        """Those of the jacobian, and of `linear`, that belong to one of what was found."""
        sizes = [len(f.amplitudes) for f in self.found]
        first = len(PARAMETERS) + sum(sizes[:index])
        return slice(first, first + sizes[index])

    def without(self, index: int) -> tuple[Found, ...]:
        """All that was found but one."""
        return self.found[:index] + self.found[index + 1 :]

    @property
    def template(self) -> AxisModel:
        """The axis without what was found."""
        kept = len(self.axis.terms) - len(self.found)
        return replace(self.axis, terms=self.axis.terms[:kept])


def fit(view: View, template: AxisModel, base: Array, found: Sequence[Found]) -> Fitted:
    """Fit base parameters and all amplitudes, with the shapes as they are."""
    found = tuple(found)
    if additive(template, found):
        return _fit_additive(view, template, found)
    axis = build(template, base, found)
    predicted = view.predicted(axis)
    for _ in range(_ITERATIONS):
        jacobian = _jacobian(view, axis, predicted, found)
        residual = (view.effort - predicted)[view.clear]
        step = solve(jacobian[view.clear], residual)
        if base[0] + step[0] < 0.0:
            predicted = predicted - base[0] * jacobian[:, 0]
            base = np.array([0.0, *base[1:]])
            jacobian = _massless(jacobian)
            step = solve(jacobian[view.clear], (view.effort - predicted)[view.clear])
        base, found = _moved(base, found, step)
        axis = build(template, base, found)
        reached = view.predicted(axis)
        foreseen = predicted + jacobian @ step
        predicted = reached
        if np.max(np.abs(reached - foreseen)) < _LINEAR * np.std(residual):
            break
    residual = (view.effort - predicted)[view.clear]
    return Fitted(axis, base, found, predicted, jacobian, float(residual @ residual))


def additive(template: AxisModel, found: Sequence[Found]) -> bool:
    """Whether all terms just add up."""
    return len(template.terms) == 1 and all(named(f.candidate.effect).additive for f in found)


def _fit_additive(view: View, template: AxisModel, found: tuple[Found, ...]) -> Fitted:
    """Plain least squares on columns that are kept."""
    jacobian = _additive_jacobian(view, template, found)
    step = solve(jacobian[view.clear], view.effort[view.clear])
    if step[0] < 0.0:
        jacobian = _massless(jacobian)
        step = solve(jacobian[view.clear], view.effort[view.clear])
    base, found = _moved(np.zeros(4), tuple(_emptied(f) for f in found), step)
    predicted = np.asarray(jacobian @ _linear(base, found))
    residual = (view.effort - predicted)[view.clear]
    axis = build(template, base, found)
    return Fitted(axis, base, found, predicted, jacobian, float(residual @ residual))


def _massless(jacobian: Array) -> Array:
    """Without the inertia, which no physics makes negative: what would make it so is something
    else that goes with the acceleration, such as a spring along a sinusoid."""
    return np.concatenate([np.zeros((len(jacobian), 1)), jacobian[:, 1:]], axis=1)


def _emptied(found: Found) -> Found:
    return replace(found, amplitudes=dict.fromkeys(found.amplitudes, 0.0))


def _additive_jacobian(view: View, template: AxisModel, found: tuple[Found, ...]) -> Array:
    """By base parameters and amplitudes, (n, P)."""
    if "base" not in view.kept:
        rows = dict(zip(PARAMETERS, np.eye(4), strict=True))
        view.kept["base"] = view.predicted(replace(template, terms=(Term(BASE, rows),)))
    parts = [view.kept["base"]]
    parts += [unit_columns(view, template, f.candidate, f.shapes) for f in found]
    return np.vstack(parts).T


def _linear(base: Array, found: Sequence[Found]) -> Array:
    return np.array([*base, *(value for f in found for value in f.amplitudes.values())])


def build(template: AxisModel, base: Array, found: Sequence[Found]) -> AxisModel:
    """The model of base parameters and terms found, after those that the template brings."""
    values = dict(zip(PARAMETERS, base, strict=True))
    kept = template.terms[1:]
    return replace(template, terms=(Term(BASE, values), *kept, *(f.term for f in found)))


def solve(jacobian: Array, residual: Array) -> Array:
    """Least squares with columns of unit length; directions that are not seen stay at zero."""
    unit, length = unit_length(jacobian)
    return np.asarray((np.linalg.lstsq(unit, residual, rcond=_RANK)[0].T / length).T)


def _moved(base: Array, found: tuple[Found, ...], step: Array) -> tuple[Array, tuple[Found, ...]]:
    at = 4
    moved = []
    for f in found:
        amplitudes = {}
        bounds = named(f.candidate.effect).bounds
        for name, value in f.amplitudes.items():
            low, high = bounds[name]
            amplitudes[name] = min(max(value + float(step[at]), low), high)
            at += 1
        moved.append(replace(f, amplitudes=amplitudes))
    return base + step[:4], tuple(moved)


def _jacobian(view: View, axis: AxisModel, predicted: Array, found: tuple[Found, ...]) -> Array:
    """By base parameters and amplitudes, (n, P), all differences in one batch."""
    places = [(0, name) for name in PARAMETERS]
    first = len(axis.terms) - len(found)
    for k, f in enumerate(found):
        places += [(first + k, name) for name in f.amplitudes]
    terms = list(axis.terms)
    for row, (index, name) in enumerate(places):
        values = dict(terms[index].values)
        array = np.asarray(values[name], dtype=np.float64) * np.ones(len(places))
        array[row] += _SMALL
        terms[index] = replace(terms[index], values={**values, name: array})
    rows = view.predicted(replace(axis, terms=tuple(terms)))
    return np.asarray(((rows - predicted) / _SMALL).T)


def jacobian_of(view: View, fitted: Fitted) -> Array:
    """The jacobian of a fitted model on another view of the same samples."""
    if additive(fitted.template, fitted.found):
        return _additive_jacobian(view, fitted.template, fitted.found)
    return _jacobian(view, fitted.axis, view.predicted(fitted.axis), fitted.found)


def shape_derivatives(view: View, fitted: Fitted) -> Array:
    """Derivatives of the prediction by every shape, (n, S)."""
    rows = []
    template = fitted.template
    kept, adds = len(template.terms), additive(template, fitted.found)
    for k, f in enumerate(fitted.found):
        for name in f.candidate.form.nonlinear:
            step = _DERIVATIVE * (abs(f.shapes[name]) or 1.0)
            sides = [{**f.shapes, name: f.shapes[name] + s} for s in (-step, step)]
            if adds:
                amplitudes = np.array(list(f.amplitudes.values()))
                low, high = (
                    amplitudes @ unit_columns(view, template, f.candidate, side) for side in sides
                )
            else:
                low, high = (
                    view.predicted(_reshaped(fitted.axis, kept + k, replace(f, shapes=side)))
                    for side in sides
                )
            rows.append((high - low) / (2.0 * step))
    return np.array(rows).reshape(len(rows), len(view.effort)).T


def _reshaped(axis: AxisModel, index: int, found: Found) -> AxisModel:
    return replace(axis, terms=(*axis.terms[:index], found.term, *axis.terms[index + 1 :]))


def held_out(view: View, fitted: Fitted, derivatives: Array) -> Array:
    """Residuals (n,) of samples that did not take part in the fit that predicts them.

    Every fifth block is left out in turn. The fit is repeated to first order: amplitudes anew,
    shapes by their derivatives. What acts only in the blocks left out stays as it was fitted.
    """
    columns = np.hstack([fitted.jacobian, derivatives])
    start = np.concatenate([fitted.linear, np.zeros(derivatives.shape[1])])
    target: Array = view.effort - fitted.predicted + columns @ start
    known = _shape_certainty(view, columns, derivatives.shape[1])
    residual = np.empty_like(target)
    energy = np.sum(columns[view.clear] ** 2, axis=0)
    for fold in range(_FOLDS):
        out = view.block % _FOLDS == fold
        train = view.clear & ~out
        learned = np.sum(columns[train] ** 2, axis=0) > _LEARNED * energy
        moved = np.where(learned, 0.0, start)
        rows = np.vstack([columns[train], known])[:, learned]
        wanted = np.concatenate([target[train] - columns[train] @ moved, np.zeros(len(known))])
        moved[learned] = solve(rows, wanted)
        residual[out] = target[out] - columns[out] @ moved
    return residual


def deviations(view: View, fitted: Fitted) -> Array:
    """Standard deviations of base parameters, amplitudes and shapes, in this order."""
    columns = np.hstack([fitted.jacobian, shape_derivatives(view, fitted)])
    unit, length = unit_length(columns[view.clear])
    return np.asarray(coloured_std(unit, (view.effort - fitted.predicted)[view.clear]) / length)


def _shape_certainty(view: View, columns: Array, shapes: int) -> Array:
    """Rows (S, P) that hold each shape to within its deviation of where all samples put it.

    A fifth of the samples cannot move it further than that, while a derivative can be anything
    but straight: of a step in time it is a pulse.
    """
    clear = columns[view.clear]
    length = np.maximum(np.linalg.norm(clear, axis=0), _TINY)
    _, singular, right = np.linalg.svd(clear / length, full_matrices=False)
    kept = singular > _RANK * singular[0]
    unit = right[kept].T / singular[kept]
    rows = np.zeros((shapes, columns.shape[1]))
    for k in range(shapes):
        at = columns.shape[1] - shapes + k
        # deviation of the parameter over that of a sample, white noise
        rows[k, at] = length[at] / max(float(np.linalg.norm(unit[at])), _TINY)
    return rows

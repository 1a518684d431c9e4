"""Trying a candidate on what a model leaves: how much of it its columns explain."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, columns, term
from edge_ident.diagnosis.fit.fitting import Fitted, Found
from edge_ident.diagnosis.fit.projection import explained, orthonormal
from edge_ident.diagnosis.prepare.view import View
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion
from edge_ident.model.model import AxisModel, Term

Array = NDArray[np.float64]
Shapes = Mapping[str, Array]
"""Values of a candidate's shapes by name, arrays (D,)."""

_SLIGHT: Final = 1e-6
"""Relative change of a command, to see whether the actuator heeds it."""
_MOST_WITHHELD: Final = 0.4
"""Share of the samples; an actuator that gives less than that much obeys nothing."""


@dataclass(frozen=True)
class Trial:
    """A candidate at its best shapes: what adding it would leave.

    Attributes
    ----------
    found : Found
    error : float
        Sum of squares that would be left over the clear samples.
    on_edge : bool
        Whether a shape lies where its grid ends.
    """

    found: Found
    error: float
    on_edge: bool = False


@dataclass(frozen=True)
class Gap:
    """What a model leaves of the effort at the clear samples.

    Attributes
    ----------
    residual : (n,) array
    basis : (n, R) array
        Orthonormal; what the model's columns span.
    """

    view: View
    axis: AxisModel
    residual: Array
    basis: Array

    @classmethod
    def of(cls, view: View, fitted: Fitted) -> Self:
        """That of a fitted model."""
        residual = (view.effort - fitted.predicted)[view.clear]
        return cls(view, fitted.axis, residual, orthonormal(fitted.jacobian[view.clear]))

    def columns(self, candidate: Candidate, shapes: Shapes) -> Array:
        """Columns (D, k, n) of a candidate."""
        return columns(self.view, self.axis, candidate, shapes)[..., self.view.clear]

    def explained(self, candidate: Candidate, shapes: Shapes, rows: Array) -> tuple[Array, Array]:
        """Errors (D,) that columns leave at their best amplitudes (D, k), with what a candidate
        pays for commands that it ignores."""
        errors, amplitudes = explained(candidate, rows, self.residual, self.basis)
        if not named(candidate.effect).overrides("withheld"):
            return errors, amplitudes
        fitted = dict(zip(candidate.form.linear, amplitudes.T, strict=True))
        return errors * surcharge(self.view, term(candidate, shapes, fitted)), amplitudes

    def best(self, candidate: Candidate, shapes: Shapes, rows: Array, grid: Shapes) -> Trial:
        """The best of D sets of shapes; `grid` is all that are searched."""
        errors, amplitudes = self.explained(candidate, shapes, rows)
        best = int(np.argmin(errors))
        at = {name: float(array[best]) for name, array in shapes.items()}
        values = dict(zip(candidate.form.linear, amplitudes[best].tolist(), strict=False))
        found = Found(candidate, at, values)
        return Trial(found, float(errors[best]), _on_edge(candidate, at, grid))


def surcharge(view: View, added: Term) -> Array:
    """Factor (D,) on the error of a model with a term in which the actuator ignores commands.

    What it then withholds is read from the effort itself and follows from no motion: every such
    sample is a free parameter, and pays for it.
    """
    effect = named(added.effect)
    if not effect.overrides("withheld"):
        return np.ones(1)
    values = along_motion(added)
    ignored, count = np.zeros(1), 0
    for s in view.stretches:
        more = _SLIGHT * s.raw_effort
        change = effect.withheld(s.raw_effort + more, values)
        change = change - effect.withheld(s.raw_effort, values)
        ignores = np.abs(change) > 0.5 * np.abs(more)
        ignored = ignored + np.sum(np.atleast_2d(ignores), axis=1)
        count += len(s.raw_effort)
    share = ignored / count
    price = np.exp(share * np.log(np.count_nonzero(view.clear)))
    return np.asarray(np.where(share < _MOST_WITHHELD, price, np.inf))


def _on_edge(candidate: Candidate, at: Mapping[str, float], grid: Shapes) -> bool:
    closed = set(candidate.form.nonlinear) - set(named(candidate.effect).search.open_ended)
    return any(
        np.ptp(grid[name]) > 0.0
        and at[name] in (float(np.min(grid[name])), float(np.max(grid[name])))
        for name in closed
    )

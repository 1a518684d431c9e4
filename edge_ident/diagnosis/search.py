"""Which effects are in the data: one after the other, each time the one that explains most.

Every candidate is tried at every shape of its grid, on what the present model cannot explain and
after projection on what it can (variable projection: Golub and Pereyra 1973). The best few are
refined between the points of their grids, and compared by the extended Bayesian information
criterion (Chen and Chen, Biometrika 95 (2008) 759), which makes a candidate pay for its parameters
and for the number of others that were tried.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from edge_ident.diagnosis.candidates import Candidate, candidates, columns, grid, term
from edge_ident.diagnosis.fitting import Fitted, Found, fit, jacobian_of, solve
from edge_ident.diagnosis.projection import AROUND, explained, orthonormal
from edge_ident.diagnosis.view import View
from edge_ident.effects import catalogue, named
from edge_ident.inverse import along_motion
from edge_ident.model import AxisModel, Term

Array = NDArray[np.float64]

_REFINED: Final = 4
"""Candidates that are refined before one is chosen."""
_PROMISING: Final = 0.4
"""Of what the best candidate gains, below which refinement brings none to the front."""
_SLIGHTEST: Final = 3.0
"""Gain, before any penalty, below which a candidate has seen nothing."""
_ROUNDS: Final = 3
_CLOSER: Final = (0.25, 0.4)
"""Width of a round over that of the one before; of few shapes, of many."""
_DESCENTS: Final = 10
"""Steps downhill from the best of many shapes."""
_BEYOND: Final = 4.0
"""Of the largest value in a shape's grid, up to which a descent may go."""
_DESCENT_STEP: Final = 0.02
"""For derivatives, of a shape's typical size: coarse enough for effects that act in jumps."""
_LARGEST: Final = 2.0
"""Peak of an effect over that of the effort, beyond which it was fitted to its tails alone."""
_CLARITY: Final = 0.75
"""Least share of motion in what is a candidate's own."""
_SLIGHT: Final = 1e-6
"""Relative change of a command, to see whether the actuator heeds it."""
_MOST_WITHHELD: Final = 0.4
"""Share of the samples; an actuator that gives less than that much obeys nothing."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Trial:
    """A candidate at its best shapes: what adding it would leave."""

    found: Found
    error: float
    """Sum of squares that would be left over the clear samples."""
    doubt: float
    """Sum of squares by which the formulas of the model that it is added to may be off."""
    on_edge: bool


class Search:
    """Candidates and their columns for one view, kept while the model grows."""

    def __init__(self, view: View, template: AxisModel, start: Fitted) -> None:
        self.view = view
        self.template = template
        self.shaken = view.shaken
        self.samples = float(np.count_nonzero(view.clear))
        """Independent ones: those of which the residual's colour leaves so many."""
        self.extent = view.extent(start.base)
        self.candidates = candidates(view, template.position_unit == "rad")
        self.grids = {c: grid(c, self.extent) for c in self.candidates}
        self.library = {
            c: columns(view, start.axis, c, self.grids[c])[..., view.clear] for c in self.candidates
        }

    def penalty(self, candidate: Candidate) -> float:
        """What a candidate has to pay, in the unit of n·log(error)."""
        tried = len(catalogue()) * _count(self.grids[candidate])
        return float(candidate.size * np.log(self.samples) + 2.0 * np.log(tried))

    def criterion(self, fitted: Fitted) -> float:
        """Extended Bayesian information of a model, the smaller the better."""
        return self._misfit(fitted.error) + self._paid(fitted)

    def gain(self, before: Fitted, after: Fitted) -> float:
        """What a model gains over another one, beyond that by which the formulas of either may be
        off: in the unit of the criterion."""
        doubt = max(self.doubt(before), self.doubt(after))
        misfit = self._misfit(before.error + doubt) - self._misfit(after.error + doubt)
        return misfit - self._paid(after) + self._paid(before)

    def _misfit(self, error: float) -> float:
        return self.samples * float(np.log(max(error, _TINY)))

    def _paid(self, fitted: Fitted) -> float:
        """What all that was found pays."""
        paid = 0.0
        for f in fitted.found:
            paid += self.penalty(f.candidate)
            paid += self.samples * float(np.log(self._surcharge(f.term)[0]))
        return paid

    def _surcharge(self, added: Term) -> Array:
        """Factor (D,) on the error of a model with a term in which the actuator ignores commands.

        What it then withholds is read from the effort itself and follows from no motion: every
        such sample is a free parameter, and pays for it.
        """
        effect = named(added.effect)
        if not effect.overrides("withheld"):
            return np.ones(1)
        values = along_motion(added)
        ignored, count = np.zeros(1), 0
        for s in self.view.stretches:
            more = _SLIGHT * s.raw_effort
            change = effect.withheld(s.raw_effort + more, values)
            change = change - effect.withheld(s.raw_effort, values)
            ignores = np.abs(change) > 0.5 * np.abs(more)
            ignored = ignored + np.sum(np.atleast_2d(ignores), axis=1)
            count += len(s.raw_effort)
        share = ignored / count
        price = np.exp(share * np.log(np.count_nonzero(self.view.clear)))
        return np.asarray(np.where(share < _MOST_WITHHELD, price, np.inf))

    def doubt(self, fitted: Fitted) -> float:
        """Sum of squares by which the formulas of a model may be off."""
        clear = self.view.clear
        basis = orthonormal(fitted.jacobian[clear, :4])
        doubt, at = 0.0, 4
        for f in fitted.found:
            size = len(f.amplitudes)
            if size:
                effort = fitted.jacobian[clear, at : at + size] @ list(f.amplitudes.values())
            else:
                effort = self._contribution(f, fitted)
            own = effort - basis @ (basis.T @ effort)
            doubt += named(f.candidate.effect).discrepancy ** 2 * float(own @ own)
            at += size
        return doubt

    def _contribution(self, found: Found, fitted: Fitted) -> Array:
        rows = columns(self.view, fitted.axis, found.candidate, found.shapes)
        return np.asarray(rows[0, 0, self.view.clear])

    def trials(self, fitted: Fitted, without: frozenset[str] = frozenset()) -> list[Trial]:
        """The most promising candidates on top of a model, refined, the best first."""
        residual = (self.view.effort - fitted.predicted)[self.view.clear]
        basis = orthonormal(fitted.jacobian[self.view.clear])
        doubt = self.doubt(fitted)
        shaken = jacobian_of(self.shaken, fitted)[self.view.clear]
        coarse = []
        for candidate in self.candidates:
            if candidate.effect in without:
                continue
            errors, amplitudes = self._explained(
                candidate, self.grids[candidate], self.library[candidate], residual, basis
            )
            best = int(np.argmin(errors))
            if not np.isfinite(errors[best]):
                continue
            trial = self._trial(candidate, self.grids[candidate], best, errors, amplitudes)
            coarse.append(replace(trial, doubt=doubt))
        coarse.sort(key=self._alone)
        refined: list[Trial] = []
        before = self._misfit(fitted.error + doubt)
        for trial in coarse:
            gained = before - self._alone(trial)
            if len(refined) == _REFINED or gained < _PROMISING * (before - self._alone(coarse[0])):
                break
            if gained < _SLIGHTEST - self.penalty(trial.found.candidate):
                break
            better = self._refined(trial, fitted, residual, basis)
            if self._plausible(better.found, fitted) and (
                self._clarity(better.found, fitted, shaken) > _CLARITY
            ):
                refined.append(replace(better, doubt=doubt))
        return sorted(refined, key=self._alone)

    def _plausible(self, found: Found, fitted: Fitted) -> bool:
        """Whether an effect stays within the effort that was measured."""
        rows = columns(self.view, fitted.axis, found.candidate, found.shapes)[0]
        amplitudes = np.array(list(found.amplitudes.values()) or [1.0])
        return float(np.max(np.abs(amplitudes @ rows))) < _LARGEST * self.extent.effort

    def _clarity(self, found: Found, fitted: Fitted, shaken_jacobian: Array) -> float:
        """Share of what is a candidate's own that is motion, and not noise of the encoders.

        The least of its columns counts. What the model's columns do not explain of a candidate's
        is all that tells them apart. On slow motions that can be noise of the model's columns.
        """
        clear = self.view.clear
        seen, shaken = (
            columns(view, fitted.axis, found.candidate, found.shapes)[0][:, clear]
            for view in (self.view, self.shaken)
        )
        jacobian = fitted.jacobian[clear]
        noise = shaken_jacobian - jacobian
        worst = 1.0
        for k in range(len(seen)):
            others = np.hstack([jacobian, np.delete(seen, k, axis=0).T])
            weights = solve(others, seen[k])
            own = seen[k] - others @ weights
            moved = np.hstack([noise, np.delete(shaken - seen, k, axis=0).T])
            spoiled = (shaken - seen)[k] - moved @ weights
            worst = min(worst, 1.0 - float(spoiled @ spoiled) / max(float(own @ own), _TINY))
        return worst

    def own_shares(self, candidate: Candidate, fitted: Fitted) -> Array:
        """Of each shape's effort, all amplitudes alike, the share (D,) that no term explains."""
        rows = self.library[candidate]
        length = np.linalg.norm(rows, axis=2, keepdims=True)
        effort = np.sum(rows / np.maximum(length, _TINY), axis=1)
        basis = orthonormal(fitted.jacobian[self.view.clear])
        own = effort - (effort @ basis) @ basis.T
        whole = np.linalg.norm(effort, axis=1)
        return np.asarray(np.linalg.norm(own, axis=1) / np.maximum(whole, _TINY))

    def promised(self, trial: Trial, fitted: Fitted) -> float:
        """What a model would gain by a trial."""
        return self._misfit(fitted.error + trial.doubt) - self._alone(trial)

    def _alone(self, trial: Trial) -> float:
        """Criterion of a trial without what the model pays that it stands on."""
        return self._misfit(trial.error + trial.doubt) + self.penalty(trial.found.candidate)

    def independent(self, fitted: Fitted) -> float:
        """How many independent samples a model's residual is worth to a column of like colour:
        Bartlett's formula for the correlation of two series (1935), summed to where the
        autocorrelation is first lost (Geyer 1992)."""
        residual = np.where(self.view.clear, self.view.effort - fitted.predicted, 0.0)
        here = self.view.clear.astype(np.float64)
        count = float(np.sum(here))
        power = float(residual @ residual) / count
        spread = 1.0
        for lag in range(1, len(residual) // 4):
            pairs = float(here[lag:] @ here[:-lag])
            correlation = float(residual[lag:] @ residual[:-lag]) / max(pairs, 1.0) / power
            if correlation < 2.0 / np.sqrt(max(pairs, 1.0)):
                break
            spread += 2.0 * correlation**2
        return count / spread

    def polished(self, fitted: Fitted) -> Fitted:
        """Search the shapes of each term once more, beside all the others."""
        for k, f in enumerate(fitted.found):
            if not f.candidate.form.shapes:
                continue
            rest = self.fit(fitted.base, fitted.found[:k] + fitted.found[k + 1 :])
            residual = (self.view.effort - rest.predicted)[self.view.clear]
            basis = orthonormal(rest.jacobian[self.view.clear])
            start = Trial(f, np.inf, 0.0, False)
            better = self._refined(start, rest, residual, basis).found
            found = (*fitted.found[:k], better, *fitted.found[k + 1 :])
            candidate = self.fit(fitted.base, found)
            if candidate.error < fitted.error:
                fitted = candidate
        return fitted

    def fit(self, base: Array, found: tuple[Found, ...]) -> Fitted:
        """Fit a model to the view."""
        return fit(self.view, self.template, base, found)

    def _trial(
        self,
        candidate: Candidate,
        shapes: dict[str, Array],
        best: int,
        errors: Array,
        amplitudes: Array,
    ) -> Trial:
        at = {name: float(array[best]) for name, array in shapes.items()}
        named_ = dict(zip(candidate.form.amplitudes, amplitudes[best].tolist(), strict=False))
        edge = any(
            at[name] in (float(np.min(array)), float(np.max(array)))
            for name, array in self.grids[candidate].items()
            if name in candidate.form.shapes
            and name not in named(candidate.effect).open_shapes
            and np.ptp(array) > 0.0
        )
        return Trial(Found(candidate, at, named_), float(errors[best]), 0.0, edge)

    def _refined(self, trial: Trial, fitted: Fitted, residual: Array, basis: Array) -> Trial:
        """Close in on the best shapes, all of them together."""
        candidate = trial.found.candidate
        names = candidate.form.shapes
        whole = self.grids[candidate]
        width = {name: _spacing(whole[name], trial.found.shapes[name]) for name in names}
        around = AROUND.get(len(names), AROUND[max(AROUND)])
        for _ in range(_ROUNDS if names else 0):
            shapes = {k: np.full(len(around), v) for k, v in trial.found.shapes.items()}
            for k, name in enumerate(names):
                offsets = width[name] * around[:, k]
                shapes[name] = self._within(candidate, name, shapes[name] + offsets)
                width[name] *= _CLOSER[len(names) > 2]
            rows = columns(self.view, fitted.axis, candidate, shapes)[..., self.view.clear]
            errors, amplitudes = self._explained(candidate, shapes, rows, residual, basis)
            best = int(np.argmin(errors))
            if np.isfinite(errors[best]) and errors[best] <= trial.error:
                trial = self._trial(candidate, shapes, best, errors, amplitudes)
        if len(names) > 2 and len(candidate.form.amplitudes) == 1:
            trial = self._descended(trial, fitted, residual, basis)
        return trial

    def _descended(self, trial: Trial, fitted: Fitted, residual: Array, basis: Array) -> Trial:
        """Go down from a trial's shapes to the nearest best ones (Levenberg and Marquardt)."""
        candidate = trial.found.candidate
        names = candidate.form.shapes
        start = np.array([trial.found.shapes[name] for name in names])
        bounds = named(candidate.effect).bounds
        low, high = np.array([bounds[name] for name in names]).T
        whole = self.grids[candidate]
        largest = _BEYOND * np.array([float(np.max(np.abs(whole[name]))) for name in names])
        low, high = np.maximum(low, -largest), np.minimum(high, np.maximum(largest, low + _TINY))
        scale = np.maximum(np.maximum(np.abs(start), 0.1 * largest), _TINY)

        def left(points: Array) -> Array:
            """Residuals (D, n) at D sets of shapes."""
            shapes = {k: np.full(len(points), v) for k, v in trial.found.shapes.items()}
            inside = np.clip(points * scale, low, high)
            shapes |= {name: inside[:, k] for k, name in enumerate(names)}
            rows = columns(self.view, fitted.axis, candidate, shapes)[:, 0, self.view.clear]
            own = rows - (rows @ basis) @ basis.T
            length = np.maximum(np.einsum("dn,dn->d", own, own), _TINY)
            return np.asarray(residual - (own @ residual / length)[:, None] * own)

        def jacobian(point: Array) -> Array:
            steps = _DESCENT_STEP * np.eye(len(point))
            sides = left(np.concatenate([point + steps, point - steps]))
            forward, backward = np.split(sides, 2)
            return np.asarray((forward - backward).T / (2.0 * _DESCENT_STEP))

        end = scipy.optimize.least_squares(
            lambda point: left(point[None])[0],
            np.clip(start, low, high) / scale,
            jacobian,
            bounds=(low / scale - 1e-9, high / scale + 1e-9),
            max_nfev=_DESCENTS,
        )
        points = np.clip(end.x * scale, low, high)
        shapes = {k: np.array([v]) for k, v in trial.found.shapes.items()}
        shapes |= {name: points[k : k + 1] for k, name in enumerate(names)}
        rows = columns(self.view, fitted.axis, candidate, shapes)[..., self.view.clear]
        errors, amplitudes = self._explained(candidate, shapes, rows, residual, basis)
        if np.isfinite(errors[0]) and errors[0] < trial.error:
            return self._trial(candidate, shapes, 0, errors, amplitudes)
        return trial

    def _explained(
        self,
        candidate: Candidate,
        shapes: dict[str, Array],
        rows: Array,
        residual: Array,
        basis: Array,
    ) -> tuple[Array, Array]:
        """Errors (D,) that a candidate leaves, with what it pays for commands that it ignores."""
        errors, amplitudes = explained(candidate, rows, residual, basis)
        if not named(candidate.effect).overrides("withheld"):
            return errors, amplitudes
        fitted = dict(zip(candidate.form.amplitudes, amplitudes.T, strict=True))
        return errors * self._surcharge(term(candidate, shapes, fitted)), amplitudes

    def _within(self, candidate: Candidate, name: str, points: Array) -> Array:
        """Points inside a shape's grid where that has an extent, else inside its bounds."""
        low, high = (float(f(self.grids[candidate][name])) for f in (np.min, np.max))
        if low == high:
            low, high = named(candidate.effect).bounds[name]
        return np.asarray(np.clip(points, low, high))


def _spacing(values: Array, at: float) -> float:
    """Distance to the neighbouring value of a grid, the larger of the two."""
    distinct = np.unique(values)
    index = int(np.argmin(np.abs(distinct - at)))
    near = distinct[max(index - 1, 0) : index + 2]
    return float(np.max(np.abs(near - at))) if len(near) > 1 else abs(at)


def _count(shapes: dict[str, Array]) -> int:
    return max((len(array) for array in shapes.values()), default=1)

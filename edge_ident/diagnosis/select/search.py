"""Which effects are in the data: one after the other, each time the one that explains most.

Every candidate is tried at every shape of its grid, on what the present model cannot explain and
after projection on what it can (variable projection: Golub and Pereyra 1973). The best few are
refined between the points of their grids, and compared by the extended Bayesian information
criterion (Chen and Chen, Biometrika 95 (2008) 759), which makes a candidate pay for its parameters
and for the number of others that were tried.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, candidates, columns, grid
from edge_ident.diagnosis.fit.fitting import Fitted, Found, fit, jacobian_of, solve
from edge_ident.diagnosis.fit.projection import orthonormal
from edge_ident.diagnosis.fit.refining import refined
from edge_ident.diagnosis.fit.trying import Gap, Trial, surcharge
from edge_ident.diagnosis.fit.vibrations import VIBRATION, Spectrum
from edge_ident.diagnosis.prepare.view import View
from edge_ident.model.effects import catalogue, named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel

Array = NDArray[np.float64]

DECISIVE: Final = 10.0
"""Difference of the criterion that counts as decisive (Kass and Raftery 1995)."""
_REFINED: Final = 4
"""Candidates that are refined before one is chosen."""
_PROMISING: Final = 0.4
"""Of what the best candidate gains, below which refinement brings none to the front."""
_SLIGHTEST: Final = 3.0
"""Gain, before any penalty, below which a candidate has seen nothing."""
_LARGEST: Final = 2.0
"""Peak of an effect over that of the effort, beyond which it was fitted to its tails alone."""
_CLARITY: Final = 0.75
"""Least share of motion in what is a candidate's own."""
_TINY: Final = float(np.finfo(float).tiny)


class Search:
    """Candidates and their columns for one view, kept while the model grows."""

    def __init__(self, view: View, template: AxisModel, start: Fitted) -> None:
        self.view = view
        self.template = template
        self.shaken = view.shaken
        self.samples = float(np.count_nonzero(view.clear))
        """Independent ones: those of which the residual's colour leaves so many."""
        self.excitation = view.excitation(start.base)
        self.candidates = candidates(view, template.position_unit == "rad")
        self.grids = {c: grid(c, self.excitation) for c in self.candidates}
        self._closest: dict[object, Trial] = {}
        self.spectrum = Spectrum.of(view)
        self.grids[VIBRATION] = {"frequency": self.spectrum.frequency_hz}
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
            paid += self.samples * float(np.log(surcharge(self.view, f.term)[0]))
        return paid

    def doubt(self, fitted: Fitted) -> float:
        """Sum of squares by which the formulas of a model may be off."""
        clear = self.view.clear
        base = fitted.jacobian[clear, : len(PARAMETERS)]
        varying = base @ fitted.base
        varying = varying - np.mean(varying)
        doubt = named(BASE).search.discrepancy ** 2 * float(varying @ varying)
        basis = orthonormal(base)
        for k, f in enumerate(fitted.found):
            if f.amplitudes:
                columns_of = fitted.columns_of(k)
                effort = fitted.jacobian[clear, columns_of] @ fitted.linear[columns_of]
            else:
                effort = self._contribution(f, fitted)
            own = effort - basis @ (basis.T @ effort)
            doubt += named(f.candidate.effect).search.discrepancy ** 2 * float(own @ own)
        return doubt

    def _contribution(self, found: Found, fitted: Fitted) -> Array:
        rows = columns(self.view, fitted.axis, found.candidate, found.shapes)
        return np.asarray(rows[0, 0, self.view.clear])

    def trials(self, fitted: Fitted, without: frozenset[str] = frozenset()) -> list[Trial]:
        """The most promising candidates on top of a model, refined, the best first."""
        gap = Gap.of(self.view, fitted)
        doubt = self.doubt(fitted)
        shaken = jacobian_of(self.shaken, fitted)[self.view.clear]
        coarse = []
        for candidate in self.candidates:
            if candidate.effect in without:
                continue
            shapes = self.grids[candidate]
            trial = gap.best(candidate, shapes, self.library[candidate], shapes)
            if np.isfinite(trial.error):
                coarse.append(trial)
        coarse += self._vibrations(gap)

        def alone(trial: Trial) -> float:
            return self._alone(trial, doubt)

        coarse.sort(key=alone)
        found: list[Trial] = []
        before = self._misfit(fitted.error + doubt)
        for trial in coarse:
            gained = before - alone(trial)
            if len(found) == _REFINED or gained < _PROMISING * (before - alone(coarse[0])):
                break
            if gained < _SLIGHTEST - self.penalty(trial.found.candidate):
                break
            better = self._refined(gap, trial)
            rows = columns(self.view, fitted.axis, better.found.candidate, better.found.shapes)[0]
            if self._plausible(better.found, rows) and (
                self._clarity(better.found, rows, fitted, shaken) > _CLARITY
            ):
                found.append(better)
        return sorted(found, key=alone)

    def _vibrations(self, gap: Gap) -> list[Trial]:
        """The loudest vibration from outside, if there can be one."""
        loudest = self.spectrum.loudest(gap.residual)
        if loudest["frequency"].size == 0:
            return []
        rows = gap.columns(VIBRATION, loudest)
        return [gap.best(VIBRATION, loudest, rows, self.grids[VIBRATION])]

    def _refined(self, gap: Gap, trial: Trial) -> Trial:
        """A trial at its best shapes; the same one comes up again in other contexts."""
        left = float(gap.residual @ gap.residual)
        key = (trial.found.candidate, *trial.found.shapes.values(), trial.error, left)
        if key not in self._closest:
            self._closest[key] = refined(gap, trial, self.grids[trial.found.candidate])
        return self._closest[key]

    def _plausible(self, found: Found, rows: Array) -> bool:
        """Whether an effect with columns (k, n) stays within the effort that was measured, and can
        be told from it."""
        values = {name: np.asarray(value) for name, value in found.term.values.items()}
        if not named(found.candidate.effect).search.physical(values, self.excitation):
            return False
        amplitudes = np.array(list(found.amplitudes.values()) or [1.0])
        return float(np.max(np.abs(amplitudes @ rows))) < _LARGEST * self.excitation.effort

    def _clarity(self, found: Found, rows: Array, fitted: Fitted, shaken_jacobian: Array) -> float:
        """Share of what is the own of columns (k, n) that is motion, and not noise of the encoders.

        The least of its columns counts. What the model's columns do not explain of a candidate's
        is all that tells them apart. On slow motions that can be noise of the model's columns.
        """
        clear = self.view.clear
        seen = rows[:, clear]
        shaken = columns(self.shaken, fitted.axis, found.candidate, found.shapes)[0][:, clear]
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
        """What a model would gain by a trial, beyond that by which its formulas may be off."""
        doubt = self.doubt(fitted)
        return self._misfit(fitted.error + doubt) - self._alone(trial, doubt)

    def _alone(self, trial: Trial, doubt: float) -> float:
        """Criterion of a trial without what the model pays that it stands on."""
        return self._misfit(trial.error + doubt) + self.penalty(trial.found.candidate)

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
            if not f.candidate.form.nonlinear:
                continue
            rest = self.fit(fitted.base, fitted.without(k))
            # the inertia may be free beside this term, and not without it
            gap = replace(Gap.of(self.view, rest), basis=self._basis_without(fitted, k))
            better = self._refined(gap, Trial(f, np.inf)).found
            found = (*fitted.found[:k], better, *fitted.found[k + 1 :])
            candidate = self.fit(fitted.base, found)
            if candidate.error < fitted.error:
                fitted = candidate
        return fitted

    def _basis_without(self, fitted: Fitted, index: int) -> Array:
        """What the columns of a model span, but for those of one term."""
        kept = np.delete(fitted.jacobian, fitted.columns_of(index), axis=1)
        return orthonormal(kept[self.view.clear])

    def fit(self, base: Array, found: tuple[Found, ...]) -> Fitted:
        """Fit a model to the view."""
        return fit(self.view, self.template, base, found)


def present(model: Fitted) -> frozenset[str]:
    """Effects of a model that a drive can have but once."""
    names = {term.effect for term in model.axis.terms[1:]}
    return frozenset(name for name in names if not named(name).search.repeats)


def _count(shapes: dict[str, Array]) -> int:
    return max((len(array) for array in shapes.values()), default=1)

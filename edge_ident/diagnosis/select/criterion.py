"""The criterion that compares models: extended Bayesian information, less model discrepancy.

The extended BIC (Chen and Chen, Biometrika 95 (2008) 759) penalizes a model for its parameters and
for the number of candidates that were tried. Its unit is n·log(error).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from edge_ident.diagnosis.fit.candidates import Candidate, cached_effort
from edge_ident.diagnosis.fit.discrepancy import model_discrepancy
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.ignored_commands import ignored_command_penalty
from edge_ident.diagnosis.fit.library import Grid
from edge_ident.diagnosis.fit.own_columns import own_columns
from edge_ident.diagnosis.fit.scoring import ScoredCandidate
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.thresholds import LOST_CORRELATION
from edge_ident.model.effects import catalogue, named

_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Criterion:
    """Extended Bayesian information of models of one axis; smaller is better.

    Attributes
    ----------
    data : AxisData
    noise_replica : AxisData
        The same samples with the encoder noise added a second time.
    start : FittedModel
        The base model.
    grids : mapping of Candidate to Grid
        Nonlinear parameters that are tried.
    samples : float
        Number of independent samples.
    """

    data: AxisData
    noise_replica: AxisData
    start: FittedModel
    grids: Mapping[Candidate, Grid]
    samples: float

    def with_samples(self, samples: float) -> "Criterion":
        """The same criterion with another number of independent samples."""
        return replace(self, samples=samples)

    def penalty(self, candidate: Candidate) -> float:
        """Penalty for the parameters of a candidate and for the candidates that were tried."""
        return candidate.parameter_count * math.log(self.samples) + self._tried[candidate]

    def value(self, fitted: FittedModel) -> float:
        """Extended BIC of a model."""
        return self.misfit(self.error(fitted)) + self._penalties(fitted)

    def gain(self, before: FittedModel, after: FittedModel) -> float:
        """Gain of a model over another, beyond the discrepancy of either, and as if the encoder
        noise passed in both as in the one in which more of it does.

        Its own discrepancy is no excuse for the other model where it leaves more. Nor does more
        noise pass in a model than it leaves: a load that bounces answers any noise by another path.
        """
        most = max(min(self._encoder_noise(m), m.error) for m in (before, after))
        error, left = (self.error(model, most) for model in (before, after))
        discrepancy = self.discrepancy(before)
        if left <= error:
            discrepancy = max(discrepancy, self.discrepancy(after))
        misfit = self.misfit(error + discrepancy) - self.misfit(left + discrepancy)
        return misfit - self._penalties(after) + self._penalties(before)

    def expected_gain(self, scored: ScoredCandidate, fitted: FittedModel) -> float:
        """Gain of a model by a candidate, from the candidate's score alone."""
        discrepancy = self.discrepancy(fitted)
        return self.misfit(fitted.error + discrepancy) - self.scored(scored, discrepancy)

    def scored(self, scored: ScoredCandidate, discrepancy: float) -> float:
        """Value of a model with a candidate, without the penalties of its other terms."""
        return self.misfit(scored.error + discrepancy) + self.penalty(scored.candidate)

    def room(self, fitted: FittedModel, noise: float) -> float:
        """Gain over a model, before any penalty, of one that leaves nothing but noise.

        Parameters
        ----------
        fitted : FittedModel
        noise : float
            Sum of squares that noise alone leaves.
        """
        discrepancy = self.discrepancy(fitted)
        return self.misfit(fitted.error + discrepancy) - self.misfit(noise + discrepancy)

    def error(self, fitted: FittedModel, passed: float = 0.0) -> float:
        """Sum of squared residuals, as if the encoder noise passed as in the base model, and with
        what it costs that an actuator ignores commands, as in scores.

        A load on a spring follows no fast motion. So a model with one has less inertia where the
        encoder noise is, and a smaller residual. That is no evidence.

        Parameters
        ----------
        passed : float, optional
            Sum of squares of the encoder noise that passes, where that is more.
        """
        most = max(self._base_noise, passed)
        left = fitted.error + max(most - self._encoder_noise(fitted), 0.0)
        withholding = [t for t in fitted.terms if named(t.candidate.effect).overrides("withheld")]
        factors = [ignored_command_penalty(self.data, t.model_term)[0] for t in withholding]
        return left * math.prod(map(float, factors))

    def _encoder_noise(self, fitted: FittedModel) -> float:
        """Sum of squares that the encoder noise has in the effort of a model."""
        key = ("encoder noise", fitted.key)
        if key not in self.data.results:
            own = own_columns(self.data) @ fitted.own
            passed = cached_effort(self.noise_replica, fitted.axis) + own - fitted.predicted
            self.data.results[key] = np.sum(np.square(passed[self.data.valid]))
        return float(self.data.results[key])

    @cached_property
    def _base_noise(self) -> float:
        return self._encoder_noise(self.start)

    def misfit(self, error: float) -> float:
        """What a sum of squares costs."""
        return self.samples * math.log(max(error, _TINY))

    def discrepancy(self, fitted: FittedModel) -> float:
        """Sum of squares by which a model's formulas may be off."""
        return model_discrepancy(self.data, fitted)

    @cached_property
    def _tried(self) -> Mapping[Candidate, float]:
        """Penalty for the candidates that were tried."""
        effects = len(catalogue())
        return {c: 2.0 * math.log(effects * _count(grid)) for c, grid in self.grids.items()}

    def _penalties(self, fitted: FittedModel) -> float:
        """Penalties of all added terms, and of what recordings have of their own but an offset."""
        others = len(self.data.segments) - 1
        total = (len(self.data.own) - 1) * others * math.log(self.samples)
        return total + sum(self.penalty(t.candidate) for t in fitted.terms)


def independent_samples(data: AxisData, fitted: FittedModel) -> float:
    """Number of independent samples that a coloured residual is worth.

    Bartlett's formula for the correlation of two series of like colour (1935), summed to the lag
    at which the autocorrelation is first lost (Geyer 1992).
    """
    residual = np.where(data.valid, data.effort - fitted.predicted, 0.0)
    here = data.valid.astype(np.float64)
    count = float(np.sum(here))
    power = float(residual @ residual) / count
    spread = 1.0
    for lag in range(1, len(residual) // 4):
        pairs = float(here[lag:] @ here[:-lag])
        correlation = float(residual[lag:] @ residual[:-lag]) / max(pairs, 1.0) / power
        if correlation < LOST_CORRELATION.value / np.sqrt(max(pairs, 1.0)):
            break
        spread += 2.0 * correlation**2
    return count / spread


def _count(grid: Grid) -> int:
    """Points of a grid; one of a form without any, and where there are none to try."""
    return max((len(array) for array in grid.values()), default=1) or 1

"""The search for candidates: scored on a grid, refined, screened.

Every candidate is scored at every point of its grid, on the residual of the present model and after
projection on what that model spans (variable projection: Golub and Pereyra 1973). The best few are
refined between the points of their grids.
"""

import math
from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import (
    Candidate,
    cached_effort,
    candidates,
    grid,
    own_columns,
)
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION, Spectrum
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit, jacobian_of
from edge_ident.diagnosis.fit.held_out import model_discrepancy
from edge_ident.diagnosis.fit.library import (
    Grid,
    Library,
    ResidualSubspace,
    ScoredCandidate,
    ignored_command_penalty,
)
from edge_ident.diagnosis.fit.linear import solve
from edge_ident.diagnosis.fit.noise_floor import lagged_products, noise_floor
from edge_ident.diagnosis.fit.refinement import Refinements, rows_beside, scored_late
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.thresholds import (
    LOST_CORRELATION,
    MOST_REFINED,
    PROMISING,
    RELIABILITY,
    SLIGHTEST,
)
from edge_ident.model.effects import catalogue, named
from edge_ident.model.model import PARAMETERS, AxisModel, Term, acting
from edge_ident.model.search import Excitation

Array = NDArray[np.float64]


# Screening of candidates, before any model is fitted with them: physical, and reliable.

_TINY: Final = float(np.finfo(float).tiny)


def excited(term: FittedTerm, excitation: Excitation) -> bool:
    """Whether the recording excites a term of this size."""
    return named(term.candidate.effect).search.possible(term.values, excitation)


def reliable(
    regressors: Array, replica_regressors: Array, jacobian: Array, replica_jacobian: Array
) -> bool:
    """Whether enough of a candidate's orthogonal component is motion, and not encoder noise.

    Only the component that the model's Jacobian does not span distinguishes a candidate. In slow
    motions that can be noise. The replica, with the encoder noise added a second time, shows how
    much. The least ratio of the regressors counts.

    Parameters
    ----------
    regressors, replica_regressors : (k, n) arrays
        Of the candidate.
    jacobian, replica_jacobian : (n, P) arrays
        Of the model.
    """
    noise = replica_jacobian - jacobian
    lowest = 1.0
    for k in range(len(regressors)):
        others = np.hstack([jacobian, np.delete(regressors, k, axis=0).T])
        weights = solve(others, regressors[k])
        orthogonal = regressors[k] - others @ weights
        others_noise = np.hstack([noise, np.delete(replica_regressors - regressors, k, axis=0).T])
        changed = (replica_regressors - regressors)[k] - others_noise @ weights
        energy = max(float(orthogonal @ orthogonal), _TINY)
        lowest = min(lowest, 1.0 - float(changed @ changed) / energy)
    return lowest > RELIABILITY


def unrepeatable(
    model: FittedModel, library: Iterable[Candidate], carriers: Set[str]
) -> frozenset[str | Candidate]:
    """What an axis cannot have beside a model: an effect a second time, or from the same axis, and
    joints that turn in another way than those of the model.

    Parameters
    ----------
    library : iterable of Candidate
        Those that are searched.
    carriers : set of str
        Axes that carry this one.
    """
    once = [t for t in model.axis.terms[1:] if not named(t.effect).search.repeats]
    alone = {t.effect for t in once if t.source_axis is None}
    left_out = {c for c in library for t in once if c.effect == t.effect and _same(c, t, carriers)}
    left_out |= {c for c in library for t in model.terms if _turns_otherwise(c, t.candidate)}
    return frozenset(alone | left_out)


def _same(candidate: Candidate, term: Term, carriers: Set[str]) -> bool:
    """Whether an effect acts from no other axis than the same effect of a model.

    Where sums of angles act, it must be a part of the other: a link's angle holds those of all
    joints that carry it. What the larger sum adds turns links further out.
    """
    one, other = (frozenset(acting(s, ())) for s in (candidate.source, term.source_axis))
    if not (one and other):
        return True
    if not any(form.sums for form in named(term.effect).search.forms):
        return {each.axis for each in one} == {each.axis for each in other}
    smaller, larger = sorted((one, other), key=len)
    return not smaller < larger or any(each.axis in carriers for each in larger - smaller)


def _turns_otherwise(one: Candidate, other: Candidate) -> bool:
    """Whether a joint would turn in one plane with this one and across it, or in two senses."""
    senses = [dict(acting(c.source, ())) for c in (one, other)]
    shared = senses[0].keys() & senses[1].keys()
    if one.form.senses and other.form.senses:
        return any(senses[0][axis] != senses[1][axis] for axis in shared)
    across = (one.form.senses and other.form.across) or (one.form.across and other.form.senses)
    return across and bool(shared)


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
        if correlation < LOST_CORRELATION / np.sqrt(max(pairs, 1.0)):
            break
        spread += 2.0 * correlation**2
    return count / spread


def many_other_laws(data: AxisData) -> bool:
    """Whether several other axes move: along one path, a few of their laws describe any effort."""
    return len(data.other_axes) > 1


def samples_of_unknown(data: AxisData, fitted: FittedModel) -> float:
    """Number of independent samples of an unknown effort that does what a model misses, at least.

    Bartlett's formula over all lags, less what white noise adds to it: where a motion repeats, so
    does all that depends on it, and a repetition says nothing new. What a coloured series has in
    common with itself by chance counts, too: that makes the number up to three times smaller.
    """
    residual = np.where(data.valid, data.effort - fitted.predicted, 0.0)
    pairs = np.maximum(lagged_products(data.valid.astype(np.float64)), 1.0)
    count, power = float(np.count_nonzero(data.valid)), float(residual @ residual)
    correlation = lagged_products(residual) / pairs * (count / max(power, _TINY))
    spread = 2.0 * float(np.sum((pairs * correlation**2 - 1.0)[1:])) / count
    return max(count / max(1.0 + spread, 1.0), 1.0)


def _count(grid: Grid) -> int:
    """Points of a grid; one of a form without any, and where there are none to try."""
    return max((len(array) for array in grid.values()), default=1) or 1


LeftOut = frozenset[str | Candidate]


@dataclass(frozen=True)
class Search:
    """Candidates and their regressors for the data of one axis.

    Attributes
    ----------
    noise_replica : AxisData
        The same samples with the encoder noise added a second time.
    grids : mapping of Candidate to grid
        Nonlinear parameters to try; an external vibration is among them.
    samples : float
        Number of independent samples that the criterion counts.
    spectrum : Spectrum
        Of external vibrations.
    library : Library
        Regressors of each candidate at the points of its grid, and at those refined before.
    noise : float
        Sum of squares that noise alone leaves.
    refinements : Refinements
        Candidates that were refined before.
    """

    data: AxisData
    noise_replica: AxisData
    template: AxisModel
    start: FittedModel
    grids: Mapping[Candidate, Grid]
    samples: float
    excitation: Excitation
    spectrum: Spectrum
    library: Library
    noise: float
    refinements: Refinements = field(default_factory=Refinements, compare=False)

    @classmethod
    def of(
        cls, data: AxisData, template: AxisModel, start: FittedModel, before: Self | None = None
    ) -> Self:
        """Prepare the search; `start` is the fitted base model, `before` an earlier search."""
        excitation = data.excitation(start.base)
        every = candidates(data, template.position_unit == "rad")
        # what the base model changes by is nothing to a grid
        spread = excitation if before is None else before.excitation
        grids: dict[Candidate, Grid] = {c: grid(c, spread) for c in every}
        spectrum = Spectrum.of(data)
        library = Library.of(data, start.axis, grids, before.library if before else None)
        searched = {**grids, VIBRATION: spectrum.grid}
        replica = data.noise_replica
        samples = float(np.count_nonzero(data.valid))
        noise = samples * noise_floor(data, start).rms ** 2
        return cls(
            data, replica, template, start, searched, samples, excitation, spectrum, library, noise
        )

    def with_samples(self, samples: float) -> Self:
        """The same search, whose criterion counts another number of independent samples."""
        return replace(self, samples=samples)

    # The criterion that compares models, in units of n·log(error): the extended BIC (Chen and Chen,
    # Biometrika 95 (2008) 759) penalizes a model for its parameters and for the number of
    # candidates that were tried; smaller is better.

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
        most = self.noise_in(before, after)
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

    @property
    def room(self) -> float:
        """Gain over the base model, before any penalty, of one that leaves nothing but noise."""
        discrepancy = self.discrepancy(self.start)
        return self.misfit(self.start.error + discrepancy) - self.misfit(self.noise + discrepancy)

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
        left = fitted.error + self.noise_below(most, fitted)
        withholding = [t for t in fitted.terms if named(t.candidate.effect).overrides("withheld")]
        factors = [ignored_command_penalty(self.data, t.model_term)[0] for t in withholding]
        return left * math.prod(map(float, factors))

    def noise_in(self, *models: FittedModel) -> float:
        """Sum of squares that the encoder noise has in that model in which more of it passes."""
        return max(min(self._encoder_noise(m), m.error) for m in models)

    def noise_below(self, most: float, fitted: FittedModel) -> float:
        """By how much less of the encoder noise passes in a model than so much."""
        return max(most - self._encoder_noise(fitted), 0.0)

    def _encoder_noise(self, fitted: FittedModel) -> float:
        """Sum of squares that the encoder noise has in the effort of a model."""

        def found() -> float:
            own = own_columns(self.data) @ fitted.own
            passed = cached_effort(self.noise_replica, fitted.axis) + own - fitted.predicted
            return float(np.sum(np.square(passed[self.data.valid])))

        return self.data.once(("encoder noise", fitted.key), found)

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

    def fit(self, base: Array, terms: tuple[FittedTerm, ...]) -> FittedModel:
        """Fit a model to the data."""
        return fit(self.data, self.template, base, terms)

    def score(self, fitted: FittedModel, without: LeftOut = frozenset()) -> list[ScoredCandidate]:
        """Score all candidates on top of a model; refine and screen the most promising.

        Parameters
        ----------
        without : frozenset of str or Candidate
            Effects and candidates that are left out, beside those that cannot stand beside the
            model.

        Returns
        -------
        list of ScoredCandidate
            The best first.
        """
        without |= unrepeatable(fitted, self.library, self.data.carriers)
        subspace = ResidualSubspace.of(self.data, fitted)
        discrepancy = self.discrepancy(fitted)
        replica_jacobian = jacobian_of(self.noise_replica, fitted)[self.data.valid]

        def value(scored: ScoredCandidate) -> float:
            return self.scored(scored, discrepancy)

        coarse = certain = self._coarse(fitted, subspace, without)
        if not np.all(fitted.free[: len(PARAMETERS)]):
            # without bounds a form may be best where no fit inside them follows
            held = ResidualSubspace.of(self.data, fitted, held=True)
            certain = self._coarse(fitted, held, without, held=True)
            coarse = [*coarse, *certain]
        before = self.misfit(fitted.error + discrepancy)
        gains = {s.candidate: before - value(s) for s in certain}
        found: list[ScoredCandidate] = []
        for scored in sorted(coarse, key=value):
            gained = before - value(scored)
            searched = sum(bool(s.term.nonlinear) for s in found)  # the others cost nothing
            if searched == MOST_REFINED or gained < PROMISING * max(gains.values(), default=0.0):
                break
            if gained < SLIGHTEST - self.penalty(scored.candidate):
                break
            refined = self.refinements.refined(subspace, scored, self.grids[scored.candidate])
            best = self._within_bounds(fitted, refined)
            if not self._admissible(best.term, fitted, replica_jacobian):
                gains.pop(scored.candidate, None)  # what no machine has bars nothing
            elif best not in found:
                found.append(best)
        return sorted(found, key=value)

    def _coarse(
        self, fitted: FittedModel, of: ResidualSubspace, without: LeftOut, held: bool = False
    ) -> list[ScoredCandidate]:
        """Each candidate at the best point of its grid, a delay as fitted, and the strongest
        vibration; once a model: criteria that count other samples ask again."""
        key = ("coarse", held, fitted.key, without)
        library, coarse = self.data.cache.get(key, (None, []))
        if library is not self.library:
            following = self._following_loads(fitted)
            delays = [c for c in self.library if c.delays]
            apart = without.union(c.effect for c in (*following, *delays))
            coarse = of.score_library(self.library, self.grids, apart)
            coarse += [scored_late(self.data, fitted) for c in delays if c.effect not in without]
            coarse += [
                of.score(c, self.library.points[c], self.grids[c])
                for c in following
                if not without & {c, c.effect}
            ]
            strongest = self.spectrum.strongest(of.residual)
            if strongest["frequency"].size and VIBRATION.effect not in without:
                grid = self.grids[VIBRATION]
                coarse.append(of.score(VIBRATION, strongest, grid, recurring=True))
            self.data.cache[key] = self.library, coarse
        return list(coarse)

    def _following_loads(self, fitted: FittedModel) -> list[Candidate]:
        """Candidates whose effort follows the loads of a model: the library has them without."""
        if not any(named(t.candidate.effect).carried for t in fitted.terms):
            return []
        return [c for c in self.library if named(c.effect).follows_base]

    def _within_bounds(self, fitted: FittedModel, scored: ScoredCandidate) -> ScoredCandidate:
        """A candidate with the error that it leaves inside the bounds of the base parameters.

        Scores are those without bounds. Where a bound holds a parameter of the model, a score may
        be that of an inertia or a friction below zero, which no fit confirms.
        """
        inside = scored.candidate.delays or np.all(fitted.free[: len(PARAMETERS)])
        return scored if inside else self._as_fitted(fitted, scored)

    def _as_fitted(self, fitted: FittedModel, scored: ScoredCandidate) -> ScoredCandidate:
        """A candidate beside the terms of a model, fitted together."""
        model = self.fit(fitted.base, (*fitted.terms, scored.term))
        return replace(scored, term=model.terms[-1], error=model.error)

    def _admissible(self, term: FittedTerm, fitted: FittedModel, replica_jacobian: Array) -> bool:
        """Whether a candidate is physical, and more than encoder noise."""
        if not excited(term, self.excitation):
            return False
        valid, rows = self.data.valid, rows_beside(self.data, fitted, term, self.data)
        replica = rows_beside(self.data, fitted, term, self.noise_replica)
        return reliable(rows[:, valid], replica[:, valid], fitted.jacobian[valid], replica_jacobian)

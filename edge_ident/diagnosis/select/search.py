"""The search for candidates: scored on a grid, refined, screened.

Every candidate is scored at every point of its grid, on the residual of the present model and after
projection on what that model spans (variable projection: Golub and Pereyra 1973). The best few are
refined between the points of their grids.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, candidates, grid
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION, Spectrum
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, build, fit, jacobian_of
from edge_ident.diagnosis.fit.grid_rows import Searched, grid_rows, kept_rows
from edge_ident.diagnosis.fit.late import rows_beside, scored_late
from edge_ident.diagnosis.fit.library import Grid, Library
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.fit.refinement import Refinements
from edge_ident.diagnosis.fit.scoring import ResidualSubspace, ScoredCandidate
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.criterion import Criterion
from edge_ident.diagnosis.select.screening import excited, measurable, reliable, unrepeatable
from edge_ident.diagnosis.select.threshold import Threshold
from edge_ident.diagnosis.select.thresholds import (
    ADDED_TERM,
    MOST_REFINED,
    PROMISING,
    SLIGHTEST,
    STARTS,
)
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel
from edge_ident.model.search import Excitation

Array = NDArray[np.float64]
LeftOut = frozenset[str | Candidate]


@dataclass(frozen=True)
class Search:
    """Candidates and their regressors for the data of one axis.

    Attributes
    ----------
    data : AxisData
    noise_replica : AxisData
        The same samples with the encoder noise added a second time.
    template : AxisModel
        The axis with the effects that it is known to have.
    excitation : Excitation
    criterion : Criterion
    spectrum : Spectrum
        Of external vibrations.
    library : Library
        Regressors of each candidate at the points of its grid, and at those refined before.
    noise : float
        Sum of squares that noise alone leaves.
    refines : bool
        Whether nonlinear parameters are searched between the points of the grids.
    deep : bool
        Whether candidates of sparse grids are searched from many parts of their ranges.
    added : Threshold
        That a term has to gain more than to enter.
    refinements : Refinements
        Candidates that were refined before.
    """

    data: AxisData
    noise_replica: AxisData
    template: AxisModel
    excitation: Excitation
    criterion: Criterion
    spectrum: Spectrum
    library: Library
    noise: float
    refines: bool = True
    deep: bool = False
    added: Threshold[float] = ADDED_TERM
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
        found = grid_rows if before is None else before.searched.rows
        library = Library.of(grids, {c: found(data, start.axis, c, grids[c]) for c in every})
        searched = {**grids, VIBRATION: spectrum.grid}
        replica = data.noise_replica
        samples = float(np.count_nonzero(data.valid))
        criterion = Criterion(data, replica, start, searched, samples)
        noise = samples * noise_floor(data, start).rms ** 2
        return cls(data, replica, template, excitation, criterion, spectrum, library, noise)

    def with_samples(self, samples: float) -> Self:
        """The same search, whose criterion counts another number of independent samples."""
        return replace(self, criterion=self.criterion.with_samples(samples))

    def with_refined_points(self, model: FittedModel) -> Self:
        """The same search, whose library also has the points that it refined; it refines no more.

        So a repetition costs products alone. The terms of a model are among the points, and no
        point that follows encoder noise: a candidate counts at its best one, and that is refused.
        """
        base = self.criterion.start
        replica_jacobian = jacobian_of(self.noise_replica, base)[self.data.valid]
        refined = (t for t in self.refinements.terms if t.candidate in self.library)
        sure = [t for t in refined if self._admissible(t, base, replica_jacobian)]
        found: dict[Candidate, dict[tuple[float, ...], FittedTerm]] = {}
        for term in (*model.terms, *sure):
            if term.nonlinear and term.candidate in self.library:
                found.setdefault(term.candidate, {})[tuple(term.nonlinear.values())] = term
        more = {
            candidate: {
                name: np.array([t.nonlinear[name] for t in terms.values()])
                for name in self.library.points[candidate]
            }
            for candidate, terms in found.items()
        }
        axis = build(self.template, self.excitation.base, ())
        rows = {c: kept_rows(self.data, axis, c, points) for c, points in more.items()}
        library = self.library.with_points(more, rows)
        return replace(self, library=library, refines=False, refinements=Refinements())

    def on(self, data: AxisData) -> Self:
        """The same search on other data of the same motion: another effort, fewer valid samples."""
        kept = data.valid[self.data.valid]
        return replace(
            self,
            data=data,
            criterion=replace(self.criterion, data=data),
            spectrum=self.spectrum.at(kept),
            library=self.library.at(kept),
            refinements=Refinements(),
        )

    @property
    def searched(self) -> Searched:
        """What a search of the same motion may take over."""
        return Searched(self.data, self.criterion.start.axis, self.library)

    @property
    def grids(self) -> Mapping[Candidate, Grid]:
        """Nonlinear parameters to try, by candidate."""
        return self.criterion.grids

    def gain(self, before: FittedModel, after: FittedModel) -> float:
        """Gain of the criterion from one model to another."""
        return self.criterion.gain(before, after)

    def worth_descending(self, fitted: FittedModel) -> frozenset[Candidate]:
        """Candidates of sparse grids that would be accepted if they explained all but noise."""
        room = self.criterion.room(fitted, self.noise) - self.added.value
        return frozenset(c for c in self.library if c.descends and room > self.criterion.penalty(c))

    def fit(self, base: Array, terms: tuple[FittedTerm, ...]) -> FittedModel:
        """Fit a model to the data."""
        return fit(self.data, self.template, base, terms)

    def score(self, fitted: FittedModel, without: LeftOut = frozenset()) -> list[ScoredCandidate]:
        """Score all candidates on top of a model; refine and screen the most promising.

        Parameters
        ----------
        fitted : FittedModel
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
        discrepancy = self.criterion.discrepancy(fitted)
        replica_jacobian = jacobian_of(self.noise_replica, fitted)[self.data.valid]

        def value(scored: ScoredCandidate) -> float:
            return self.criterion.scored(scored, discrepancy)

        coarse = certain = self._coarse(fitted, subspace, without)
        if not np.all(fitted.free[: len(PARAMETERS)]):
            # without bounds a form may be best where no fit inside them follows
            held = ResidualSubspace.of(self.data, fitted, held=True)
            certain = self._coarse(fitted, held, without, held=True)
            coarse = [*coarse, *certain]
        before = self.criterion.misfit(fitted.error + discrepancy)
        promising = PROMISING.value * (before - min(map(value, certain), default=before))
        found: list[ScoredCandidate] = []
        for scored in sorted(coarse, key=value):
            gained = before - value(scored)
            refined = sum(bool(s.term.nonlinear) for s in found)  # the others cost nothing
            if refined == MOST_REFINED.value or gained < promising:
                break
            if gained < SLIGHTEST.value - self.criterion.penalty(scored.candidate):
                break
            best = self._within_bounds(fitted, self._refined(subspace, scored))
            if best not in found and self._admissible(best.term, fitted, replica_jacobian):
                found.append(best)
        if self.deep and self.refines and not fitted.terms:  # beside others it takes too long
            descents = self._descents(fitted, subspace, without)
            found += [s for s in descents if self._admissible(s.term, fitted, replica_jacobian)]
            every = {s.candidate: s for s in sorted(found, key=value, reverse=True)}
            sparse = [best for candidate, best in every.items() if candidate.descends]
            found = [s for s in found if not s.candidate.descends] + sparse
        return sorted(found, key=value)

    def _descents(
        self, fitted: FittedModel, subspace: ResidualSubspace, without: LeftOut
    ) -> list[ScoredCandidate]:
        """Candidates of sparse grids, refined from each part of their ranges."""
        scored = subspace.score_library(self.library, self.grids, without, STARTS.value)
        worth = self.worth_descending(fitted)
        starts = [start for start in scored if start.candidate in worth]
        return [
            self._within_bounds(fitted, end)
            for candidate, of_one in groupby(starts, key=lambda start: start.candidate)
            for end in self.refinements.descended(subspace, tuple(of_one), self.grids[candidate])
        ]

    def _coarse(
        self, fitted: FittedModel, of: ResidualSubspace, without: LeftOut, held: bool = False
    ) -> list[ScoredCandidate]:
        """Each candidate at the best point of its grid, a delay as fitted, and the strongest
        vibration; once a model: criteria that count other samples ask again."""
        key = ("coarse", held, fitted.key, without)
        library, coarse = self.data.results.get(key, (None, []))
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
            self.data.results[key] = self.library, coarse
        return list(coarse)

    def _following_loads(self, fitted: FittedModel) -> list[Candidate]:
        """Candidates whose effort follows the loads of a model: the library has them without."""
        if not any(named(t.candidate.effect).carried for t in fitted.terms):
            return []
        return [c for c in self.library if named(c.effect).follows_base]

    def _refined(self, subspace: ResidualSubspace, scored: ScoredCandidate) -> ScoredCandidate:
        """A candidate at its best nonlinear parameters."""
        if not self.refines and scored.candidate != VIBRATION:
            return scored
        return self.refinements.refined(subspace, scored, self.grids[scored.candidate])

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
        if not measurable(term, rows, self.excitation):
            return False
        replica = rows_beside(self.data, fitted, term, self.noise_replica)
        return reliable(rows[:, valid], replica[:, valid], fitted.jacobian[valid], replica_jacobian)

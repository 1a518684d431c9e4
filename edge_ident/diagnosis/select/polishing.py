"""Nonlinear parameters of a model, each term once more beside all the others.

A term enters at the best values for what was left then. A search that refines nothing, on disturbed
data, has the points of its library, among them those of the model that it is to find again.
"""

from dataclasses import replace

import numpy as np

from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm
from edge_ident.diagnosis.fit.projection import orthonormal
from edge_ident.diagnosis.fit.refinement import FINE
from edge_ident.diagnosis.fit.scoring import ResidualSubspace, ScoredCandidate
from edge_ident.diagnosis.select.search import Search


def polished(search: Search, fitted: FittedModel) -> FittedModel:
    """A model with the nonlinear parameters of each term as they are best beside all the others.

    Parameters
    ----------
    search : Search
    fitted : FittedModel
    """
    for place, term in enumerate(fitted.terms):
        if not (term.candidate.form.nonlinear and _may_change(search, term)):
            continue
        rest = search.fit(fitted.base, fitted.without(place))
        # the inertia may be free beside this term, and not without it
        others = np.delete(fitted.jacobian, fitted.columns_of(place), axis=1)[search.data.valid]
        basis = orthonormal(others)
        subspace = replace(ResidualSubspace.of(search.data, rest), basis=basis, key=None)
        better = _best(search, subspace, term)
        terms = (*fitted.terms[:place], better.term, *fitted.terms[place + 1 :])
        candidate = search.fit(fitted.base, terms)
        if candidate.error < fitted.error:
            fitted = candidate
    return fitted


def _may_change(search: Search, term: FittedTerm) -> bool:
    """Whether there is more than one value to choose from."""
    return search.refines or term.candidate in search.library


def _best(search: Search, subspace: ResidualSubspace, term: FittedTerm) -> ScoredCandidate:
    """A term at its best values: between the points of its grid, or at one of the library."""
    candidate, grid = term.candidate, search.grids[term.candidate]
    if search.refines:
        here = ScoredCandidate(term, np.inf)
        return search.refinements.refined(subspace, here, grid, FINE)
    points, rows = search.library.points[candidate], search.library[candidate]
    return subspace.score_at(candidate, points, rows, grid)

"""Screening of candidates, before any model is fitted with them: physical, and reliable."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.bounded import solve
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm
from edge_ident.diagnosis.select.thresholds import LARGEST, RELIABILITY
from edge_ident.model.effects import named
from edge_ident.model.search import Excitation

Array = NDArray[np.float64]

_TINY: Final = float(np.finfo(float).tiny)


def excited(term: FittedTerm, excitation: Excitation) -> bool:
    """Whether the recording excites a term of this size."""
    return named(term.candidate.effect).search.physical(term.values, excitation)


def measurable(term: FittedTerm, regressors: Array, excitation: Excitation) -> bool:
    """Whether the effort of a term could have been measured.

    Parameters
    ----------
    regressors : (k, n) array
        Of the term.
    """
    amplitudes = np.array(list(term.linear.values()) or [1.0])
    peak = float(np.max(np.abs(amplitudes @ regressors)))
    return peak < LARGEST.value * excitation.effort


def reliable(
    regressors: Array, replica_regressors: Array, jacobian: Array, replica_jacobian: Array
) -> bool:
    """Whether the reliability ratio of a candidate's orthogonal component is high enough."""
    ratio = _reliability_ratio(regressors, replica_regressors, jacobian, replica_jacobian)
    return ratio > RELIABILITY.value


def _reliability_ratio(
    regressors: Array, replica_regressors: Array, jacobian: Array, replica_jacobian: Array
) -> float:
    """Share of motion, and not of encoder noise, in a candidate's orthogonal component.

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
    return lowest


def unrepeatable(model: FittedModel) -> frozenset[str]:
    """Effects of a model that an axis can have only once."""
    names = {term.effect for term in model.axis.terms[1:]}
    return frozenset(name for name in names if not named(name).search.repeats)

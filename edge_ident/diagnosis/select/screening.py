"""Screening of candidates, before any model is fitted with them: physical, and reliable."""

from collections.abc import Iterable, Set
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.bounded import solve
from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm
from edge_ident.diagnosis.select.thresholds import LARGEST, RELIABILITY
from edge_ident.model.effects import named
from edge_ident.model.model import Term, acting
from edge_ident.model.search import Excitation

Array = NDArray[np.float64]

_TINY: Final = float(np.finfo(float).tiny)


def excited(term: FittedTerm, excitation: Excitation) -> bool:
    """Whether the recording excites a term of this size."""
    return named(term.candidate.effect).search.possible(term.values, excitation)


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


def unrepeatable(
    model: FittedModel, library: Iterable[Candidate], carriers: Set[str]
) -> frozenset[str | Candidate]:
    """What an axis cannot have beside a model: an effect a second time, or from the same axis, and
    joints that turn in another way than those of the model.

    Parameters
    ----------
    model : FittedModel
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

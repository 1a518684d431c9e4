"""The rule that accepts a cause.

`decide` is the rule. Forward selection asks it before it adds a term, backward elimination before
it keeps one, and replacement before it exchanges one for an alternative. `larger_than_rest` decides
which causes of the model that the search ends with are supported, and which only suspected.
`structure_left` decides on the verdict. What they compare with is in `select.thresholds`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from edge_ident.diagnosis.fit.fitting import FittedTerm
from edge_ident.diagnosis.select.thresholds import (
    ADDED_TERM,
    DECISIVE,
    KEPT_TERM,
    LARGER_IN_TIME,
    LARGEST_DISCREPANCY,
    NONZERO,
    SAME_SIZE,
    STRUCTURE,
    SUPPORTED,
)


@dataclass(frozen=True)
class Evidence:
    """What is known about a change from one model to another.

    Attributes
    ----------
    criterion_gain : float
        Difference of the extended BIC, less model discrepancy (`select.criterion`).
    supported : float or None
        Probability that the held-out residual falls; None where it has not been computed.
    one_off : bool
        Whether the change acts once, so that cross-validation does not apply.
    near_zero : tuple of str
        Essential parameters that lie near zero.
    """

    criterion_gain: float
    supported: float | None = None
    one_off: bool = False
    near_zero: tuple[str, ...] = ()


@dataclass(frozen=True)
class Decision:
    """Whether a change of the model is accepted, and why.

    Attributes
    ----------
    reason : str
        In words, with the numbers.
    margin : float
        What there is beyond what is required, in the unit of the rule: of the criterion, of runs,
        or of the effort.
    """

    accepted: bool
    reason: str
    margin: float


def nearly_none(names: Sequence[str]) -> str:
    """What is said of essential parameters near zero."""
    return f"{', '.join(names)} lies within {NONZERO:.0f} standard deviations of zero"


def decide(
    before: Sequence[FittedTerm],
    after: Sequence[FittedTerm],
    evidence: Evidence,
    *,
    staying: bool = False,
) -> Decision:
    """Decide whether a model may take the place of another.

    Parameters
    ----------
    before, after : sequence of FittedTerm
        Terms of the two models.
    evidence : Evidence
        Of the change from the one to the other.
    staying : bool
        Whether the additional term is in the model already, and asks to stay.
    """
    # what acts once is not cross-validated, so that the criterion alone decides
    of_one_more = KEPT_TERM if staying and not evidence.one_off else ADDED_TERM
    required = _required_gain(before, after, of_one_more)
    margin = evidence.criterion_gain - required
    reason = _criterion_reason(evidence.criterion_gain, required, staying)
    if not margin > 0.0:
        return Decision(False, reason, margin)
    if evidence.near_zero:
        return Decision(False, nearly_none(evidence.near_zero), margin)
    if evidence.one_off:
        return Decision(
            True, f"{reason} and it acts once, so it counts where it was fitted", margin
        )
    if evidence.supported is None:
        return Decision(True, reason, margin)
    held_out = (
        f"it reduces the held-out residual with a probability of {evidence.supported:.1%} "
        f"(more than {SUPPORTED:.0%} is required)"
    )
    if not evidence.supported > SUPPORTED:
        return Decision(False, held_out, margin)
    return Decision(True, f"{reason} and {held_out}", margin)


def _criterion_reason(gain: float, required: float, staying: bool) -> str:
    """What a change does to the criterion, and what is required of it."""
    if not staying:
        if required < 0.0:
            return (
                "it needs one kind of effect, or one moment, fewer and changes the criterion by "
                f"{gain:+.0f} units (more than {required:.0f} are required)"
            )
        return f"it gains {gain:.0f} units of the criterion (more than {required:.0f} are required)"
    change = "worse" if gain > 0.0 else "better"
    return (
        f"without it the criterion is {abs(gain):.0f} units {change} (a term must gain more than "
        f"{ADDED_TERM:.0f} to enter, and more than {required:.0f} to stay)"
    )


def _required_gain(
    before: Sequence[FittedTerm], after: Sequence[FittedTerm], of_one_more: float
) -> float:
    """Units of the criterion; those of a model with one term more are given."""
    if len(after) > len(before):
        return of_one_more
    # a new kind of effect beside one that is there already has to be decisive; and what happens at
    # a moment, in the place of what lasts: it would be chance that it did just what that does
    counts = [_kinds(terms) + _moments(terms) for terms in (before, after)]
    return DECISIVE * (counts[1] - counts[0])


def _kinds(terms: Sequence[FittedTerm]) -> int:
    return len({t.candidate.effect for t in terms})


def _moments(terms: Sequence[FittedTerm]) -> int:
    """How many of some terms happen at a moment of their own."""
    return sum("time" in t.nonlinear for t in terms)


def separable(criterion_gain: float) -> bool:
    """Whether a motion separates a cause from an alternative that it gains this much over."""
    return criterion_gain >= DECISIVE


def larger_than_rest(share: float, rest: float, *, tied_to_time: bool = False) -> Decision:
    """Decide whether a cause is larger than what is left unexplained.

    What is tied to time has to be twice as large: a disturbance in time that no effect explains
    looks for a while like a drift, a payload or an event.

    Parameters
    ----------
    share, rest : float
        Rms of the cause's own effort, and of what is left beyond noise, of the effort's rms.
    tied_to_time : bool
        Whether the effect is.
    """
    required = rest * (LARGER_IN_TIME if tied_to_time else 1.0)
    relation = "more" if share >= required else "less"
    times = f"{LARGER_IN_TIME:.0f} times " if tied_to_time else ""
    reason = (
        f"its own effort, {share:.1%}, is {relation} than {times}what is left unexplained beside "
        f"it, {rest:.1%}"
    )
    return Decision(share >= required, reason, share - required)


def same_size(first: float, second: float, std: float, parts: tuple[str, str]) -> Decision:
    """Decide whether two halves of the data show a cause with one size.

    Parameters
    ----------
    first, second : float
        Size in either half, of that in the model.
    std : float
        Standard deviation of their difference.
    parts : tuple of str
        What the halves are called.
    """
    apart, allowed = abs(first - second), max(SAME_SIZE, NONZERO * std)
    reason = (
        f"{parts[0]} the data show {first:.2f} times its effort, and {parts[1]} {second:.2f} times"
    )
    return Decision(not apart > allowed, reason, allowed - apart)


def noise_limit(floor: float, uncertainty: float) -> float:
    """Rms up to which a residual may be noise; `uncertainty` is the floor's relative deviation."""
    return STRUCTURE * (1.0 + 2.0 * uncertainty) * floor


def beyond(residual: float, limit: float) -> float:
    """Rms of what is left of a residual without noise of the rms `limit`."""
    return float(np.sqrt(max(residual**2 - limit**2, 0.0)))


def about_alike(more: float, explained: float, off: float, worth_naming: float) -> bool:
    """Whether one model leaves more than another by no more than is worth naming, and than a small
    share of what it explains: what its formulas may be off.

    Parameters
    ----------
    more, explained, worth_naming : float
        Sums of squares.
    off : float
        Share of what it explains that the formulas may be off.
    """
    return more < min(off * explained, worth_naming)


def structure_left(
    residual: float,
    floor: float,
    uncertainty: float,
    discrepancy: float,
    tolerance: float,
    effort: float,
) -> bool:
    """Whether a residual holds more than noise and model discrepancy, and more than is tolerated.

    Parameters
    ----------
    residual, floor, discrepancy, tolerance, effort : float
        Rms over the valid samples: of the residual, of noise, of what the formulas may be off, of
        what is not worth naming, and of the measured effort.
    uncertainty : float
        Relative standard deviation of the floor.
    """
    discrepancy = min(discrepancy, LARGEST_DISCREPANCY * effort)
    uncertain = float(np.hypot(noise_limit(floor, uncertainty), discrepancy))
    return residual > max(uncertain, float(np.hypot(floor, tolerance)))

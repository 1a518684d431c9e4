"""Judgement: which terms of the selected model are supported causes, suspected, or minor.

The rules stand in `select.acceptance`. A cause is suspected where one of them is against it: it is
smaller than what is left unexplained, the halves of the data disagree about it, it shows at
standstill alone, too often or too briefly, it trades places with the base parameters, its values
are those of another effect or uncertain, a free curve fits better, the model with all causes is not
physical, the selection did not converge, or no cause may be named. It is minor where it is small,
or a sound drive has it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.held_out import standard_deviations
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor
from edge_ident.diagnosis.judge.assessment import Assessment
from edge_ident.diagnosis.judge.causes import causes, strongest_first
from edge_ident.diagnosis.judge.causes_in_time import imitated, recurring
from edge_ident.diagnosis.judge.free_curves import curves_instead
from edge_ident.diagnosis.judge.halves import decide_halves
from edge_ident.diagnosis.judge.unknown import unknown_instead
from edge_ident.diagnosis.measures import Validation, Verdict
from edge_ident.diagnosis.result import Cause, Refused
from edge_ident.diagnosis.select.acceptance import Decision, larger_than_rest
from edge_ident.diagnosis.select.cross_validation import evidence_for_terms, tied_to_time
from edge_ident.diagnosis.select.search import Search, many_other_laws
from edge_ident.diagnosis.select.selection import SupportedModel, SupportedTerm, without_each
from edge_ident.diagnosis.select.thresholds import INFORMATION_KEPT

_UNSETTLED: Final = "the selection of causes did not converge: in another round others may stay"
_SOUND: Final = "certain, and no fault: the chain of a sound drive winds up as much"


@dataclass(frozen=True)
class Judgement:
    """What the selected model comes to.

    Attributes
    ----------
    supported : SupportedModel
        With the supported causes, external vibrations and minor causes.
    suspected, minor : tuple of Cause
        Strongest first.
    rest : float
        Rms of what the supported model and the curves beside it leave beyond noise, over that of
        the effort.
    validation : Validation or None
        What another recording says, where there is one.
    """

    verdict: Verdict
    supported: SupportedModel
    suspected: tuple[Cause, ...]
    minor: tuple[Cause, ...]
    rest: float
    validation: Validation | None = None


def judge(
    search: Search,
    selected: SupportedModel,
    floor: NoiseFloor,
    tolerance: float,
    blocked: str | None = None,
) -> Judgement:
    """Judge every term of the model that the search ends with.

    Parameters
    ----------
    tolerance : float
        Smallest share of the effort that is worth naming.
    blocked : str, optional
        Why no cause may be named.
    """
    doubts = {} if selected.converged else dict.fromkeys(range(len(selected.support)), _UNSETTLED)
    doubts |= _refused(s.decision for s in selected.support)
    doubts |= curves_instead(search, selected.model, floor)
    assessed = Assessment.of(search, selected.model, floor, tolerance)
    kept = [k for k in range(len(selected.model.terms)) if k not in doubts]
    doubts |= unknown_instead(assessed, kept)
    kept = [k for k in kept if k not in doubts]
    beside = assessed.beside_curves(assessed.fitted(kept))
    before = None
    while kept != before:  # beside the others more is left unexplained then
        before = kept
        for doubt in (_smaller, _traded, _in_time, _halves_apart, _by_values):
            doubts |= (doubtful := doubt(beside, kept))
            kept = [k for k in kept if k not in doubtful]
    reason = blocked or (assessed.against_all(kept) if kept else None)
    if reason is not None:
        doubts |= dict.fromkeys(kept, reason)
        kept = []
    judged = _judgement(assessed, beside, selected, _sort(assessed, kept, doubts))
    # a recording that contradicts itself is understood by no model, however well one fits
    return replace(judged, verdict=Verdict.UNEXPLAINED) if blocked else judged


@dataclass(frozen=True)
class _Sorted:
    """Places of the terms that are supported, minor, and sound; and reasons against the others.

    A sound drive has what the sound terms say, and the base model does not, so they stay in the
    model. They are no cause.
    """

    named: Sequence[int]
    minor: Sequence[int]
    sound: Sequence[int]
    doubts: Mapping[int, str]


def _refused(decisions: Iterable[Decision]) -> dict[int, str]:
    """Reasons of the decisions against terms, by their places."""
    return {k: d.reason for k, d in enumerate(decisions) if not d.accepted}


def _smaller(assessed: Assessment, kept: list[int]) -> dict[int, str]:
    """Reasons against the weakest term, and the next, until each is larger than what is left."""
    doubts: dict[int, str] = {}
    while kept:
        model = assessed.fitted(kept)
        decisions = _beside_rest(assessed, model)
        weakest, decision = min(enumerate(decisions), key=lambda pair: pair[1].margin)
        if decision.accepted:
            break
        doubts[kept[weakest]] = decision.reason
        kept = [k for k in kept if k != kept[weakest]]
    return doubts


def _beside_rest(assessed: Assessment, model: FittedModel) -> list[Decision]:
    """For each term of a model, whether it is larger than what the model leaves unexplained."""
    rest = assessed.rest(model)
    return [
        larger_than_rest(share, rest, tied_to_time=tied_to_time(t))
        for share, t in zip(assessed.shares(model), model.terms, strict=True)
    ]


def _traded(assessed: Assessment, kept: Sequence[int]) -> dict[int, str]:
    """Reasons against causes that others take back, and vibrations that the base model does.

    These are no part of the machine, and the motion has to show its parameters beside them.
    """
    doubts = assessed.taken_back(assessed.fitted(kept))
    if doubts or assessed.information_kept(kept) > INFORMATION_KEPT:
        return {kept[place]: reason for place, reason in doubts.items()}
    reason = "it trades places with the base parameters, of which this motion then says little"
    terms = assessed.model.terms
    return {k: reason for k in kept if terms[k].candidate == VIBRATION}


def _in_time(assessed: Assessment, kept: Sequence[int]) -> dict[int, str]:
    """Reasons against events that something else may imitate, or that recur, weak ones too."""
    search, model = assessed.search, assessed.fitted(kept)
    doubts = imitated(search.data, model, search.excitation)
    reasons = recurring(search.data, assessed.model)
    reasons |= {kept[place]: why for place, why in doubts.items()}
    return {k: reasons[k] for k in kept if k in reasons}


def _halves_apart(assessed: Assessment, kept: Sequence[int]) -> dict[int, str]:
    """Reasons against causes of which the halves of the data show different sizes."""
    decisions = decide_halves(assessed.search.data, assessed.fitted(kept), assessed.space)
    return {k: d.reason for k, d in zip(kept, decisions, strict=True) if d and not d.accepted}


def _by_values(assessed: Assessment, kept: Sequence[int]) -> dict[int, str]:
    """Reasons against causes that are another effect, or of no certain size, by their values."""
    doubts = {k: reason for k in kept if (reason := assessed.degenerate(k))}
    return assessed.doubtful_sizes(kept) | assessed.phases(kept) | doubts


def _sort(assessed: Assessment, kept: list[int], doubts: Mapping[int, str]) -> _Sorted:
    """Sort what is certain into what is named, what is minor, and what a sound drive has as well.

    Those below the tolerance are minor, the weakest first, as long as they do not together make
    the difference between a base model that is not adequate and an extended one that is. What a
    sound drive has is minor too where the base model is adequate.
    """
    adequate = not assessed.structure(assessed.search.start)
    every = assessed.of_a_chain(kept)
    sound = [] if adequate else every
    worth = [k for k in kept if k not in every]
    explained = not assessed.structure(assessed.fitted(sorted([*worth, *sound])))
    while worth:
        places = sorted([*worth, *sound])
        sizes = assessed.sizes(assessed.fitted(places), recorded_alone=adequate)
        size, weakest = min(pair for pair in zip(sizes, places, strict=True) if pair[1] in worth)
        fewer = [k for k in worth if k != weakest]
        if size * assessed.scale >= assessed.tolerance:
            break
        left = assessed.fitted(sorted([*fewer, *sound]))
        if explained and not adequate and assessed.structure(left):
            break
        worth = fewer
    minor = [k for k in kept if k not in worth and k not in sound]
    return _Sorted(worth, minor, sound, doubts)


def _judgement(
    assessed: Assessment,
    beside: Assessment,
    selected: SupportedModel,
    found: _Sorted,
) -> Judgement:
    data, model = assessed.search.data, selected.model
    every = causes(selected, assessed.shares(model), standard_deviations(data, model))
    own = [t.candidate != VIBRATION for t in selected.model.terms]
    doubtful = [replace(every[k], decision=r) for k, r in found.doubts.items() if own[k]]
    vibrations = [Refused(VIBRATION.effect, r) for k, r in found.doubts.items() if not own[k]]
    many, minor = many_other_laws(data), [k for k in found.minor if own[k]]
    # along one path, what is small of several other axes may be anything
    left_out = [k for k in minor if many and model.terms[k].candidate.source is not None]
    staying = sorted({*found.sound, *minor}.difference(left_out))
    supported = _supported(assessed, beside, selected, found.named, staying)
    return Judgement(
        verdict=_verdict(assessed, found),
        supported=replace(supported, refused=(*selected.refused, *vibrations)),
        suspected=strongest_first(doubtful),
        minor=strongest_first(
            replace(every[k], decision=_minor_reason(assessed, k)) for k in left_out
        ),
        rest=beside.rest(beside.fitted(sorted([*found.named, *staying]))),
    )


def _minor_reason(assessed: Assessment, place: int) -> str:
    if assessed.sound(place):
        return _SOUND
    limit = assessed.tolerance / assessed.scale
    return f"certain, and it takes less than {limit:.1%} off the effort, which is worth naming"


def _supported(
    assessed: Assessment,
    beside: Assessment,
    selected: SupportedModel,
    named: Sequence[int],
    minor: Sequence[int],
) -> SupportedModel:
    """The model with a part of the terms: gains and decisions anew, alternatives as they were."""
    places = sorted([*named, *minor])
    model = assessed.fitted(places)
    _, gains = evidence_for_terms(assessed.search, model, without_each(assessed.search, model))
    support = []
    larger = _beside_rest(beside, beside.fitted(places))
    for place, gain, decided in zip(places, gains, larger, strict=True):
        before = selected.support[place]
        reasons = [before.decision.reason, decided.reason]
        reasons += [_minor_reason(assessed, place)] if place in minor else []
        decision = replace(before.decision, reason="; ".join(reasons))
        support.append(SupportedTerm(gain, decision, before.comparison, place in minor))
    return replace(selected, model=model, support=tuple(support))


def _verdict(assessed: Assessment, found: _Sorted) -> Verdict:
    """What a sound drive has is no cause, so a machine that has nothing else is adequate."""
    places = sorted([*found.named, *found.sound])
    vibrating = any(assessed.model.terms[k].candidate == VIBRATION for k in places)
    model = assessed.fitted(places)
    # what is named may have taken the place of a suspected cause that is larger than the rest
    doubtful = found.named and assessed.outweighed(model, found.doubts)
    if vibrating or doubtful or assessed.structure(model):
        return Verdict.UNEXPLAINED
    return Verdict.EXPLAINED if found.named else Verdict.ADEQUATE

"""Judgement: which terms of the selected model are supported causes, suspected, or minor.

The rules stand in `select.acceptance`. A cause is suspected where too few runs on disturbed data
find it, where it is smaller than what is left unexplained, or where no cause may be named at all.
It is minor where it is certain and not worth naming. What is not supported leaves the model, and
the rest is fitted again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.held_out import standard_deviations
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.result import Cause, Refused, Verdict
from edge_ident.diagnosis.select.acceptance import (
    again,
    beyond,
    larger_than_rest,
    noise_limit,
    structure_left,
)
from edge_ident.diagnosis.select.backward_elimination import (
    SupportedModel,
    SupportedTerm,
    without_vibrations,
)
from edge_ident.diagnosis.select.causes import causes, strongest_first
from edge_ident.diagnosis.select.evidence import evidence_for_terms
from edge_ident.diagnosis.select.own_effort import Array, base_space, own_efforts
from edge_ident.diagnosis.select.physics import unphysical
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.stability import RUNS, times_found
from edge_ident.diagnosis.select.thresholds import TRADED
from edge_ident.signals.metrics import rms


@dataclass(frozen=True)
class Rules:
    """What a user may ask of the judgement.

    Attributes
    ----------
    tolerance : float
        Smallest share of the rms effort that is worth naming.
    stability : bool
        Whether the search is repeated on disturbed data.
    keep_minor : bool
        Whether minor causes stay in the model.
    """

    tolerance: float = 0.01
    stability: bool = True
    keep_minor: bool = False


@dataclass(frozen=True)
class Judgement:
    """What the selected model comes to.

    Attributes
    ----------
    verdict : Verdict
    supported : SupportedModel
        With the supported causes, external vibrations and, if they are kept, minor causes.
    suspected, minor : tuple of Cause
        Strongest first.
    """

    verdict: Verdict
    supported: SupportedModel
    suspected: tuple[Cause, ...]
    minor: tuple[Cause, ...]


def judge(
    search: Search,
    start: FittedModel,
    selected: SupportedModel,
    floor: NoiseFloor,
    rules: Rules,
    blocked: str | None = None,
    on_run: Callable[[int], None] = lambda run: None,
) -> Judgement:
    """Judge every term of the model that the search ends with.

    Parameters
    ----------
    search : Search
    start : FittedModel
        The base model.
    selected : SupportedModel
    floor : NoiseFloor
    rules : Rules
    blocked : str, optional
        Why no cause may be named.
    on_run : callable
        Gets the number of disturbed runs that are done.
    """
    court = _Court.of(search, start, selected.model, floor, rules.tolerance)
    kept = list(range(len(selected.model.terms)))
    found: Sequence[int] = []
    doubts: dict[int, str] = {}
    if rules.stability and kept and not blocked:
        found = times_found(search, start, selected.model, floor.rms, on_run)
        doubts = _not_found_again(found)
        kept = [k for k in kept if k not in doubts]
    kept, smaller = _larger_than_rest(court, kept)
    doubts |= smaller
    traded = _traded(court, kept)
    doubts |= traded
    kept = [k for k in kept if k not in traded]
    reason = blocked or (unphysical(search.data, court.fitted(kept)) if kept else None)
    if reason is not None:
        doubts |= dict.fromkeys(kept, reason)
        kept = []
    named, minor = _worth_naming(court, kept)
    judged = _judgement(court, selected, _Sorted(named, minor, doubts), found, rules)
    # a recording that contradicts itself is understood by no model, however well one fits
    return replace(judged, verdict=Verdict.UNEXPLAINED) if blocked else judged


@dataclass(frozen=True)
class _Court:
    """The selected model, and what its parts are measured by; all rms over the valid samples."""

    search: Search
    start: FittedModel
    model: FittedModel
    space: Array
    noise: float
    scale: float
    tolerance: float
    cache: dict[tuple[int, ...], FittedModel] = field(default_factory=dict, compare=False)

    @classmethod
    def of(
        cls,
        search: Search,
        start: FittedModel,
        model: FittedModel,
        floor: NoiseFloor,
        tolerance: float,
    ) -> Self:
        scale = nonzero_rms(search.data.effort[search.data.valid])
        space = base_space(search.data, start)
        noise = noise_limit(floor.rms, floor.uncertainty)
        return cls(search, start, model, space, noise, scale, tolerance * scale)

    def fitted(self, kept: Sequence[int]) -> FittedModel:
        """The model with a part of its terms, fitted again with their nonlinear parameters.

        What left may have bent them.
        """
        if len(kept) == len(self.model.terms):
            return self.model
        key = tuple(kept)
        if key not in self.cache:
            terms = tuple(self.model.terms[k] for k in kept)
            self.cache[key] = self.search.polished(self.search.fit(self.start.base, terms))
        return self.cache[key]

    def left(self, model: FittedModel) -> float:
        """Rms of a model's residual."""
        return float(np.sqrt(model.error / np.count_nonzero(self.search.data.valid)))

    def shares(self, model: FittedModel) -> list[float]:
        """Rms of each term's own effort over the rms of the measured effort."""
        efforts = own_efforts(self.search.data, model, self.space)
        return [rms(effort) / self.scale for effort in efforts]

    def rest(self, model: FittedModel) -> float:
        """Share of the effort that a model leaves beyond noise."""
        return beyond(self.left(model), self.noise) / self.scale

    def structure(self, model: FittedModel) -> bool:
        """Whether a model leaves more than noise, discrepancy and tolerance allow."""
        samples = np.count_nonzero(self.search.data.valid)
        discrepancy = float(np.sqrt(self.search.criterion.discrepancy(model) / samples))
        return structure_left(self.left(model), self.noise, discrepancy, self.tolerance)


@dataclass(frozen=True)
class _Sorted:
    """Places of the terms that are supported and minor, and reasons against the others."""

    named: Sequence[int]
    minor: Sequence[int]
    doubts: Mapping[int, str]


def _not_found_again(found: Sequence[int]) -> dict[int, str]:
    """Reasons against the terms that too few runs find; the undisturbed run is one of them."""
    decisions = [again(times + 1, RUNS + 1) for times in found]
    return {k: d.reason for k, d in enumerate(decisions) if not d.accepted}


def _larger_than_rest(court: _Court, kept: list[int]) -> tuple[list[int], dict[int, str]]:
    """Drop the weakest term and fit again, until each is larger than what is left."""
    doubts: dict[int, str] = {}
    while kept:
        model = court.fitted(kept)
        shares = court.shares(model)
        weakest = int(np.argmin(shares))
        decision = larger_than_rest(shares[weakest], court.rest(model))
        if decision.accepted:
            break
        doubts[kept[weakest]] = decision.reason
        kept = [k for k in kept if k != kept[weakest]]
    return kept, doubts


def _traded(court: _Court, kept: Sequence[int]) -> dict[int, str]:
    """Reasons against vibrations that trade places with the base model.

    They are no part of the machine. So without them, and with the parameters that were fitted
    beside them, the rest has to describe the machine no worse than the base model.
    """
    model = court.fitted(kept)
    rest = without_vibrations(court.search.data, model)
    if court.left(rest) <= TRADED.value * court.left(court.start):
        return {}
    reason = "without it the parameters that were fitted beside it are worse than the base model's"
    return {k: reason for k, t in zip(kept, model.terms, strict=True) if t.candidate == VIBRATION}


def _worth_naming(court: _Court, kept: list[int]) -> tuple[list[int], list[int]]:
    """Places of what is named, and of what is minor.

    All are minor where the base model is adequate. Otherwise those below the tolerance are, the
    weakest first, as long as they do not together make the difference between explained and not.
    """
    if not court.structure(court.start):
        return [], kept
    named, explained = list(kept), not court.structure(court.fitted(kept))
    while named:
        shares = _shares_by_effect(court, named)
        weakest = int(np.argmin(shares))
        fewer = [k for k in named if k != named[weakest]]
        if shares[weakest] * court.scale >= court.tolerance:
            break
        if explained and court.structure(court.fitted(fewer)):
            break
        named = fewer
    return named, [k for k in kept if k not in named]


def _shares_by_effect(court: _Court, places: Sequence[int]) -> list[float]:
    """Share of each term, with the others of its effect: the orders of a ripple are one."""
    model = court.fitted(places)
    efforts = own_efforts(court.search.data, model, court.space)
    names = [(t.candidate.effect, t.candidate.source) for t in model.terms]
    together = {name: np.zeros_like(efforts[0]) for name in names}
    for name, effort in zip(names, efforts, strict=True):
        together[name] = together[name] + effort
    return [rms(together[name]) / court.scale for name in names]


def _judgement(
    court: _Court, selected: SupportedModel, found: _Sorted, times: Sequence[int], rules: Rules
) -> Judgement:
    data, model = court.search.data, selected.model
    every = causes(data, selected, court.shares(model), standard_deviations(data, model))
    own = [t.candidate != VIBRATION for t in selected.model.terms]
    doubtful = [replace(every[k], decision=r) for k, r in found.doubts.items() if own[k]]
    vibrations = [Refused(VIBRATION.effect, r) for k, r in found.doubts.items() if not own[k]]
    minor = [replace(every[k], decision=_minor_reason(court, every[k])) for k in found.minor
             if own[k]]  # fmt: skip
    kept = found.minor if rules.keep_minor else ()
    supported = _supported(court, selected, sorted([*found.named, *kept]), kept, times)
    return Judgement(
        verdict=_verdict(court, found.named),
        supported=replace(supported, refused=(*selected.refused, *vibrations)),
        suspected=strongest_first(doubtful),
        minor=strongest_first(minor),
    )


def _minor_reason(court: _Court, cause: Cause) -> str:
    limit = court.tolerance / court.scale
    if cause.share < limit:
        return f"certain, and smaller than {limit:.1%} of the effort, which is worth naming"
    return "certain, but the base model leaves no more than noise and what is not worth naming"


def _supported(
    court: _Court,
    selected: SupportedModel,
    places: Sequence[int],
    minor: Sequence[int],
    times: Sequence[int],
) -> SupportedModel:
    """The model with a part of the terms: gains and decisions anew, alternatives as they were."""
    model = court.fitted(places)
    shares, rest = court.shares(model), court.rest(model)
    _, _, gains = evidence_for_terms(court.search, model)
    support = []
    for place, gain, share in zip(places, gains, shares, strict=True):
        before = selected.support[place]
        reasons = [before.decision.reason, larger_than_rest(share, rest).reason]
        reasons += [again(times[place] + 1, RUNS + 1).reason] if times else []
        decision = replace(before.decision, reason="; ".join(reasons))
        support.append(SupportedTerm(gain, decision, before.comparison, place in minor))
    return replace(selected, model=model, support=tuple(support))


def _verdict(court: _Court, named: Sequence[int]) -> Verdict:
    if not court.structure(court.start):
        return Verdict.ADEQUATE
    own = [k for k in named if court.model.terms[k].candidate != VIBRATION]
    explained = own and not court.structure(court.fitted(named))
    return Verdict.EXPLAINED if explained and own == list(named) else Verdict.UNEXPLAINED

"""The search for causes: terms are left out, exchanged and added until no change is accepted.

What explains most of what the base model leaves may be wrong where two causes act together. So
every effect is tried in the place of each term before more is added (sequential floating search:
Pudil, Novovicova and Kittler, Pattern Recognition Letters 15 (1994) 1119).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from edge_ident.diagnosis.fit.candidates import Candidate, own_columns
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, build, delayed, fit
from edge_ident.diagnosis.fit.held_out import Gain
from edge_ident.diagnosis.fit.library import ResidualSubspace, ScoredCandidate
from edge_ident.diagnosis.fit.linear import orthonormal
from edge_ident.diagnosis.measures import worth_naming
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.result import Refused
from edge_ident.diagnosis.select.acceptance import Decision, Evidence, decide
from edge_ident.diagnosis.select.alternatives import (
    ComparedAlternatives,
    compare_alternatives,
    in_best_senses,
)
from edge_ident.diagnosis.select.cross_validation import (
    evidence_for_terms,
    held_out_gain,
    is_one_off,
    near_zero,
    staying,
)
from edge_ident.diagnosis.select.search import LeftOut, Search, independent_samples
from edge_ident.diagnosis.select.thresholds import (
    BEAM_WIDTH,
    FEWEST_INDEPENDENT,
    MOST_FITTED,
    MOST_ROUNDS,
    MOST_TERMS,
)
from edge_ident.model.inverse import remembers
from edge_ident.model.model import PARAMETERS, AxisModel, Term, axes_of


@dataclass(frozen=True)
class SupportedTerm:
    """What the last round says of one term of the model; `minor` where it is not worth naming."""

    gain: Gain
    decision: Decision
    comparison: ComparedAlternatives
    minor: bool = False


@dataclass(frozen=True)
class SupportedModel:
    """The result of backward elimination.

    Attributes
    ----------
    support : tuple of SupportedTerm
        One for each term of the model.
    refused : tuple of Refused
        Effects that left the model.
    converged : bool
        Whether the last round left the model as it was.
    """

    model: FittedModel
    support: tuple[SupportedTerm, ...]
    refused: tuple[Refused, ...]
    converged: bool

    @property
    def vibrations(self) -> tuple[Term, ...]:
        """External vibrations, the strongest first."""
        found = [t for t in self.model.terms if t.candidate == VIBRATION]
        found.sort(key=lambda t: -math.hypot(*t.linear.values()))
        return tuple(t.model_term for t in found)

    def of(self, model: FittedModel, places: Sequence[int]) -> "SupportedModel":
        """The same for a model with some of the terms, by their places."""
        return replace(self, model=model, support=tuple(self.support[k] for k in places))

    def without_vibrations(self, data: AxisData) -> "SupportedModel":
        """The model of the axis itself; parameters stay as they were fitted beside vibrations."""
        own = [t.candidate != VIBRATION for t in self.model.terms]
        support = tuple(s for s, mine in zip(self.support, own, strict=True) if mine)
        return replace(self, model=without_vibrations(data, self.model), support=support)


@dataclass(frozen=True)
class Selected:
    """The base model of an axis, and the model that the search ends with.

    Attributes
    ----------
    search : Search
        Its criterion counts the independent samples of what the model leaves.
    """

    search: Search
    supported: SupportedModel

    @property
    def start(self) -> FittedModel:
        """The base model."""
        return self.search.start

    @property
    def late(self) -> bool:
        """Whether a delay is among what was selected."""
        return delayed(self.supported.model.axis)

    def better_than(self, other: "Selected") -> bool:
        """Whether the criterion prefers this model to that of another selection.

        Of an effort that is late, fewer samples are compared: the mean of the squares counts.
        """
        samples, values = other.search.samples, []
        for one in (self, other):
            value = one.search.with_samples(samples).value(one.supported.model)
            compared = np.count_nonzero(one.search.data.valid)
            values.append(value - samples * np.log(compared))
        return bool(values[0] < values[1])


def fitted_base(data: AxisData, template: AxisModel) -> FittedModel:
    """The base model beside what the axis is known to have; the fit starts from an inertia."""
    return fit(data, template, np.eye(len(PARAMETERS))[0], ())


def unsearched(data: AxisData, template: AxisModel) -> Selected:
    """The base model alone."""
    start = fitted_base(data, template)
    alone = SupportedModel(start, (), (), converged=True)
    return Selected(Search.of(data, template, start), alone)


def grown_model(data: AxisData, template: AxisModel, before: Selected | None = None) -> Selected:
    """What is added to the base model, before anything is exchanged or left out.

    A coloured residual is worth fewer independent samples than it has. Then the terms are added
    anew, and the search counts as many.

    Parameters
    ----------
    template : AxisModel
        The axis with what it is known to have.
    before : Selected, optional
        On the same motion, with an effort that was moved since then.
    """
    start = fitted_base(data, template)
    search = Search.of(data, template, start, before.search if before else None)
    model = _grown(search, start)
    samples = independent_samples(data, model)
    if model.terms and samples < FEWEST_INDEPENDENT * search.samples:
        search = search.with_samples(samples)
        # of two large causes neither explains much alone: what was found together competes
        model = min(_grown(search, start), model, key=search.value)
    return _unsettled(search, model)


def moved_model(data: AxisData, before: Selected) -> Selected:
    """What was added before, beside an effort that was moved since then."""
    template = before.start.template
    start = fitted_base(data, template)
    search = Search.of(data, template, start, before.search)
    model = polished(search, search.fit(start.base, before.supported.model.terms))
    samples = min(search.samples, independent_samples(data, model))
    return _unsettled(search.with_samples(samples), model)


def settled_model(grown: Selected) -> Selected:
    """The model to which changes of another lead, until none is accepted."""
    data, start = grown.search.data, grown.start
    found = replace(grown, supported=settle(grown.search, grown.supported.model))
    seen = with_hidden_events(data, found.supported.model, float(start.base[0]))
    return found if seen is data else selected_model(seen, start.template)


def selected_model(data: AxisData, template: AxisModel, before: Selected | None = None) -> Selected:
    """Select a model of an axis; for the parameters see `grown_model`."""
    return settled_model(grown_model(data, template, before))


def _unsettled(search: Search, model: FittedModel) -> Selected:
    return Selected(search, SupportedModel(model, (), (), converged=False))


def settle(search: Search, model: FittedModel) -> SupportedModel:
    """Change a model until no change is accepted.

    Parameters
    ----------
    model : FittedModel
        To begin with.
    """
    refused: list[Refused] = []
    gone: LeftOut = frozenset()
    for remaining in reversed(range(MOST_ROUNDS + 1)):
        model = polished(search, in_best_senses(search, model))
        seen = _look(search, model, gone)
        if seen.change is None or not remaining:
            break
        refused += seen.refused
        gone |= seen.gone
        model = seen.change
    compared = seen.comparisons or _compared(search, model, gone)
    support = map(SupportedTerm, seen.gains, seen.decisions, compared)
    left = [r for r in refused if r.effect not in model.effects | {VIBRATION.effect}]
    return SupportedModel(
        model, tuple(support), tuple(dict.fromkeys(left)), converged=seen.change is None
    )


@dataclass(frozen=True)
class _Round:
    """One look at a model; `change` is the better one, or None, and `gone` what does not return."""

    gains: Sequence[Gain]
    decisions: Sequence[Decision]
    comparisons: Sequence[ComparedAlternatives] = ()
    change: FittedModel | None = None
    refused: tuple[Refused, ...] = ()
    gone: LeftOut = frozenset()


def _look(search: Search, model: FittedModel, gone: LeftOut) -> _Round:
    """Decide on every term, and find the next change.

    What cross-validation does not support leaves before alternatives are compared, and a better
    alternative comes before a term with an essential parameter near zero leaves, in that form. Then
    comes what is to be added, but for what is gone.
    """
    smaller = without_each(search, model)
    evidence, gains = evidence_for_terms(search, model, smaller)
    seen = _Round(gains, staying(smaller, model, evidence))
    left_out: list[str | Candidate] = [t.candidate.effect for t in model.terms]
    if all(d.accepted for d in seen.decisions):
        seen = replace(seen, comparisons=_compared(search, model, gone))
        if (better := _exchanged(search, model, seen.comparisons)) is not None:
            return replace(seen, change=better[0], refused=(better[1],))
        close = near_zero(search.data, model)
        evidence = [replace(e, near_zero=n) for e, n in zip(evidence, close, strict=True)]
        seen = replace(seen, decisions=staying(smaller, model, evidence))
        left_out = [t.candidate for t in model.terms]
    doubtful = [k for k, d in enumerate(seen.decisions) if not d.accepted]
    if not doubtful:
        larger = _grown(search, model, gone)
        return seen if larger is model else replace(seen, change=larger)
    weakest = min(doubtful, key=lambda k: gains[k].interval[0])
    reason = Refused(model.terms[weakest].candidate.effect, seen.decisions[weakest].reason)
    change = search.fit(model.base, model.without(weakest))
    return replace(seen, change=change, refused=(reason,), gone=frozenset({left_out[weakest]}))


def without_each(search: Search, model: FittedModel) -> list[FittedModel]:
    """The models without each term of a model.

    What acts once stays by the criterion alone, so the others are at their best without it.
    """
    found = []
    for place in range(len(model.terms)):
        less = search.fit(model.base, model.without(place))
        once = is_one_off(search.data, model.predicted - less.predicted)
        found.append(polished(search, less) if once else less)
    return found


def _compared(search: Search, model: FittedModel, gone: LeftOut) -> list[ComparedAlternatives]:
    return [compare_alternatives(search, model, k, gone) for k in range(len(model.terms))]


def _exchanged(
    search: Search, model: FittedModel, comparisons: Sequence[ComparedAlternatives]
) -> tuple[FittedModel, Refused] | None:
    """The model with the best alternative in the place of a term, and what is said of that."""
    ranked = [
        (search.value(c.replacement), k, c.replacement, c.decision.reason)
        for k, c in enumerate(comparisons)
        if c.replacement is not None and c.decision is not None
    ]
    if not ranked:
        return None
    _, place, best, why = min(ranked, key=lambda entry: entry[0])
    new = best.terms[-1].candidate.effect
    reason = f"{new.replace('_', ' ')} in its place is preferred: {why}"
    return best, Refused(model.terms[place].candidate.effect, reason)


def _grown(search: Search, model: FittedModel, gone: LeftOut = frozenset()) -> FittedModel:
    """A model with as many more terms as the acceptance rule accepts.

    A few models are followed at once, because two causes may explain only together what one wrong
    one explains alone.
    """
    best, beam = model, [model]
    for _ in range(MOST_TERMS - len(model.terms)):
        larger = [child for parent in beam for child in _children(search, parent, gone)]
        if not larger:
            break
        beam = _distinct(sorted(larger, key=search.value))[:BEAM_WIDTH]
        beam[0] = polished(search, beam[0])
        best = max([best, *beam], key=lambda other: search.gain(model, other))
    return best


def _children(search: Search, parent: FittedModel, gone: LeftOut) -> list[FittedModel]:
    """Models with one more term that the acceptance rule accepts."""
    scored = [s for s in search.score(parent, gone) if not s.on_edge]
    tried = (_child(search, parent, s) for s in different_first(scored)[:MOST_FITTED])
    return [child for child in tried if child is not None]


def _distinct(ranked: Sequence[FittedModel]) -> list[FittedModel]:
    """The first model of each set of kinds."""
    kept: dict[tuple[tuple[str, ...], ...], FittedModel] = {}
    for model in ranked:
        kept.setdefault(tuple(sorted(_kind(t.candidate) for t in model.terms)), model)
    return list(kept.values())


def different_first(scored: Sequence[ScoredCandidate]) -> list[ScoredCandidate]:
    """The best candidate of each kind, and then the others.

    Parameters
    ----------
    scored : sequence of ScoredCandidate
        The best first.
    """
    best = {_kind(s.candidate): s for s in reversed(scored)}
    return sorted(scored, key=lambda s: s is not best[_kind(s.candidate)])


def _kind(candidate: Candidate) -> tuple[str, ...]:
    """The effect, and the other axes that take part in it.

    A weight that follows the own angle, and one that follows the sum of both, leave different
    things for the next cause.
    """
    return candidate.effect, *axes_of(candidate.source, ())


def _child(search: Search, parent: FittedModel, scored: ScoredCandidate) -> FittedModel | None:
    """A model with one more term, or None where that is not accepted.

    The evidence is collected in the order of its cost: score, fit, cross-validation.
    """
    terms = (*parent.terms, scored.term)
    expected = Evidence(search.expected_gain(scored, parent))
    if not decide(parent.terms, terms, expected).accepted:
        return None
    child = search.fit(parent.base, terms)
    gain = search.gain(parent, child)
    if not decide(parent.terms, child.terms, Evidence(gain)).accepted:
        return None
    held_out = held_out_gain(search.data, parent, child)
    evidence = Evidence(gain, held_out.supported, held_out.one_off)
    return child if decide(parent.terms, child.terms, evidence).accepted else None


# Nonlinear parameters of a model, each term once more beside all the others: a term enters at the
# best values for what was left then.


def polished(search: Search, fitted: FittedModel) -> FittedModel:
    """A model with the nonlinear parameters of each term as they are best beside all the others."""
    for place, term in enumerate(fitted.terms):
        if not term.candidate.form.nonlinear:
            continue
        rest = search.fit(fitted.base, fitted.without(place))
        # the inertia may be free beside this term, and not without it
        others = np.delete(fitted.jacobian, fitted.columns_of(place), axis=1)[search.data.valid]
        basis = orthonormal(others)
        subspace = replace(ResidualSubspace.of(search.data, rest), basis=basis, adds_up=False)
        here, grid = ScoredCandidate(term, np.inf), search.grids[term.candidate]
        better = search.refinements.refined(subspace, here, grid)
        terms = (*fitted.terms[:place], better.term, *fitted.terms[place + 1 :])
        candidate = search.fit(fitted.base, terms)
        if candidate.error < fitted.error:
            fitted = candidate
    return fitted


# Events in samples that the comparison leaves out.
#
# Aliased encoder rounding explains so much and no more. At the start of a recording, only friction
# and play remember what was before it: beside a model in which nothing remembers, an effort that is
# far off there is an event as well.


def with_hidden_events(data: AxisData, model: FittedModel, inertia: float) -> AxisData:
    """The data with samples valid at which something happened; the data itself where nothing did.

    Parameters
    ----------
    model : FittedModel
        That was selected on these data.
    inertia : float
        That turns aliased rounding into effort.
    """
    whole = data if remembers(model.axis.terms) else data.from_start()
    residual = whole.effort - fit(whole, model.template, model.base, model.terms).predicted
    hidden = whole.exceeds_aliasing(residual, inertia)
    if whole.late:
        hidden &= ~whole.near_ends(whole.late_s)
    added = [
        np.arange(len(s.sample_index)) < len(s.sample_index) - len(before.sample_index)
        for s, before in zip(whole.segments, data.segments, strict=True)
    ]
    start = np.concatenate(added)
    if not worth_naming(residual[hidden & start], data.effort[data.valid]):
        hidden &= ~start
    return whole.with_valid(hidden) if np.any(hidden) else data


# A model without what is no part of the axis.


def without_vibrations(data: AxisData, model: FittedModel) -> FittedModel:
    """A model without external vibrations; parameters stay as they were fitted beside them."""
    own = [t.candidate != VIBRATION for t in model.terms]
    return model if all(own) else _without_terms(data, model, own)


def _without_terms(data: AxisData, fitted: FittedModel, kept: Sequence[bool]) -> FittedModel:
    """A fitted model with only some of its terms; all parameters stay as they are."""
    terms = tuple(t for t, keep in zip(fitted.terms, kept, strict=True) if keep)
    sizes = [fitted.base_columns.stop, *(len(t.linear) for t in fitted.terms)]
    columns = np.repeat([True, *kept], sizes)
    axis = build(fitted.template, fitted.base, terms)
    predicted = data.predicted(axis) + own_columns(data) @ fitted.own
    residual = (data.effort - predicted)[data.valid]
    return replace(
        fitted,
        axis=axis,
        terms=terms,
        predicted=predicted,
        rows=(fitted.derivatives.T[columns],),
        free=fitted.free[columns],
        error=float(residual @ residual),
    )

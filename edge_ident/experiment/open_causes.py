"""Which explanations of an axis are still open, and what a further motion rules out.

A diagnosis is open where a cause has an alternative that the recordings do not separate from it, or
where a cause is only suspected. An effect that the motion could not have shown is a question only
where structure is left in the band of the comparison: what is explained needs no other effect, and
lines above the band come from none that is missing there.
"""

from collections.abc import Collection, Iterable
from dataclasses import replace

import numpy as np

from edge_ident.diagnosis.measures import TOLERANCE, Verdict
from edge_ident.diagnosis.result import AxisDiagnosis, Cause
from edge_ident.model.effects import named

Question = frozenset[str]
"""Two effects, one of which is there; or one, where it is whether it is there at all."""


def is_open(axis: AxisDiagnosis) -> bool:
    """Whether more than one explanation is left for an axis."""
    rivals = any(_inseparable(cause) for cause in axis.causes)
    return rivals or bool(axis.suspected) or bool(axis.not_testable)


def questions(axis: AxisDiagnosis, asked: Collection[Question] = ()) -> AxisDiagnosis:
    """The diagnosis of an axis with nothing but what a further motion is to settle.

    Parameters
    ----------
    axis : AxisDiagnosis
    asked : collection of Question
        Those that a motion was made for already. One that stays open is not asked twice.
    """
    if axis.verdict is Verdict.ADEQUATE:
        return without_causes(axis)
    untested = axis.not_testable if structure_in_band(axis) else ()
    return replace(
        axis,
        causes=tuple(_unasked(cause, asked) for cause in axis.causes),
        suspected=tuple(
            _unasked(c, asked) for c in axis.suspected if frozenset({c.term.effect}) not in asked
        ),
        not_testable=tuple(m for m in untested if frozenset({m.effect}) not in asked),
    )


def _unasked(cause: Cause, asked: Collection[Question]) -> Cause:
    own = cause.term.effect
    gone = {
        effect
        for effect in _inseparable(cause)
        if any(question in asked for question in (frozenset({own, effect}), frozenset({effect})))
    }
    return _less(cause, frozenset(gone), "a motion was made for it")


def without_causes(axis: AxisDiagnosis) -> AxisDiagnosis:
    """The diagnosis of an axis whose base model is enough."""
    base = replace(axis.model, terms=axis.model.terms[:1])
    return replace(axis, causes=(), suspected=(), minor=(), curves=(), not_testable=(), model=base)


def explanations(axis: AxisDiagnosis) -> frozenset[str]:
    """Effects that may be the cause of what an axis shows."""
    asked = questions(axis)
    found = {cause.term.effect for cause in (*axis.causes, *axis.minor, *asked.suspected)}
    found |= {
        effect for cause in (*asked.causes, *asked.suspected) for effect in _inseparable(cause)
    }
    return frozenset(found | {missing.effect for missing in asked.not_testable})


def structure_in_band(axis: AxisDiagnosis) -> bool:
    """Whether the residual of an axis that is not explained holds more, in the band of the
    comparison, than `edge_ident.diagnosis.select.acceptance.structure_left` takes for noise."""
    enough = float(np.hypot(axis.noise_floor, TOLERANCE))
    return not axis.verdict.complete and axis.extended.fitted > enough


def tied_to_time(axis: AxisDiagnosis) -> bool:
    """Whether a cause of an axis, or an alternative, belongs to the time of its recording."""
    effects = [c.term.effect for c in axis.causes]
    effects += [effect for cause in axis.causes for effect in _inseparable(cause)]
    return any(named(effect).tied_to_time for effect in effects)


def without(axis: AxisDiagnosis, gone: Iterable[str], evidence: str) -> AxisDiagnosis:
    """The diagnosis of an axis after a motion that would have shown some effects, and did not.

    Parameters
    ----------
    axis : AxisDiagnosis
    gone : iterable of str
        Effects; a supported cause stays.
    evidence : str
        What says so, in one sentence.
    """
    gone = frozenset(gone)
    return replace(
        axis,
        causes=tuple(_less(cause, gone, evidence) for cause in axis.causes),
        suspected=tuple(
            _less(cause, gone, evidence)
            for cause in axis.suspected
            if cause.term.effect not in gone
        ),
        not_testable=tuple(m for m in axis.not_testable if m.effect not in gone),
    )


def _less(cause: Cause, gone: frozenset[str], evidence: str) -> Cause:
    alternatives = tuple(
        replace(a, separable=True, evidence=evidence) if a.effect in gone else a
        for a in cause.alternatives
    )
    return replace(cause, alternatives=alternatives)


def _inseparable(cause: Cause) -> list[str]:
    return [other.effect for other in cause.inseparable]

"""The diagnosis of one axis: search, judgement, what another recording says, and the result."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.content import above_band
from edge_ident.diagnosis.axis_search import AxisSearch, search_axis, with_ripples_everywhere
from edge_ident.diagnosis.budget.account import Missed, fitted_curves
from edge_ident.diagnosis.error_budget import AgreeingCurve
from edge_ident.diagnosis.fit.deviations import friction_line, with_trades
from edge_ident.diagnosis.fit.fitting import FittedModel, contributions, delayed, fit
from edge_ident.diagnosis.fit.summary import (
    base_space,
    model_fit,
    nonzero_rms,
    own_shares,
    timing,
    traces,
)
from edge_ident.diagnosis.judge.above_band_causes import (
    beside_causes,
    orders_in_step,
    supported_orders,
    with_band_content,
    with_ripples,
    without_names,
)
from edge_ident.diagnosis.judge.causes import causes, not_testable, strongest_first
from edge_ident.diagnosis.measures import Validation, Verdict
from edge_ident.diagnosis.nuisances import Difference
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.recording_checks import (
    contradicted,
    effort_findings,
    with_other_axes,
)
from edge_ident.diagnosis.result import AxisDiagnosis, Cause, OutsideVibration
from edge_ident.diagnosis.select.selection import fitted_base
from edge_ident.diagnosis.validation import judge as judge_elsewhere
from edge_ident.diagnosis.validation import with_curves, with_sources
from edge_ident.model.effects import named
from edge_ident.model.inverse import made_physical
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Estimate, Term
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AxisProblem:
    """An axis to diagnose.

    Attributes
    ----------
    recordings : sequence of Recording
        With mended stamps, long ones in parts.
    validates : sequence of Recording
        Another recording, in parts; none if there is none.
    """

    recordings: Sequence[Recording]
    name: str
    template: AxisModel
    validates: Sequence[Recording]
    tolerance: float

    @cached_property
    def data(self) -> AxisData:
        """The recordings, prepared."""
        return self.prepared(self.recordings, self.template)

    def prepared(self, recordings: Sequence[Recording], axis: AxisModel) -> AxisData:
        """The axis in recordings, in step with its motion unless a delay in a model accounts for
        that."""
        return prepare_axis(recordings, self.name, timed=not delayed(axis))


def diagnose_axis(problem: AxisProblem) -> tuple[AxisDiagnosis, Validation | None]:
    """Diagnose one axis.

    Raises
    ------
    DataError
        Hardly any sample shows the axis in motion.
    """
    axis, validation = _in_band(problem)
    if axis.verdict is Verdict.UNEXPLAINED and (axis.causes or axis.curves):
        axis = replace(axis, verdict=Verdict.PARTLY_EXPLAINED)
    return axis, validation


@dataclass(frozen=True)
class _Outcome:
    """An axis after the recordings themselves and, where there is one, another have judged it.

    `vibrations` are not in its model any more. `base` is the base model without the ripples that
    were found above the band, and `above` the rms of what it misses there.
    """

    search: AxisSearch
    vibrations: tuple[Term, ...]
    base: FittedModel
    curves: tuple[AgreeingCurve, ...]
    above: float


def _in_band(problem: AxisProblem) -> tuple[AxisDiagnosis, Validation | None]:
    """A diagnosis in the band of the problem, with the ripples and lines above it."""
    recordings, name, template = problem.recordings, problem.name, problem.template
    data, tolerance = problem.data, problem.tolerance
    content = above_band(recordings, name, data)
    efforts = effort_findings(recordings, name)
    if contradicted(efforts):
        content = without_names(content)
    content, out_of_step = orders_in_step(data, template, content, tolerance)

    def searched(axis: AxisModel) -> AxisSearch:
        found = search_axis(recordings, name, efforts, tolerance, data, axis)
        return with_ripples_everywhere(found, recordings, name, tolerance)

    known = with_ripples(template, content, tolerance)
    found = searched(known)
    content = beside_causes(content, found.judged.supported.model, recordings, name, found.data)
    fewer = with_ripples(template, content, tolerance)
    if fewer != known:
        found = searched(fewer)
    content, doubtful = supported_orders(content, found.judged.rest, found.blocked)
    known = with_ripples(template, content, tolerance)
    found = _without_orders(found, known, (*out_of_step, *doubtful))
    data, start = found.data, found.selected.start
    supported, other = found.judged.supported, None
    judged = replace(found.judged, supported=supported.without_vibrations(data))
    if problem.validates:
        other = problem.prepared(problem.validates, judged.supported.model.axis)
        judged, differs = judge_elsewhere(data, other, start, judged, tolerance)
        found = _with_difference(problem, found, differs)
    base = start if start.template is template else fitted_base(data, template)
    curves: tuple[AgreeingCurve, ...] = ()
    if judged.verdict is Verdict.UNEXPLAINED and not found.blocked:
        judged, curves = with_curves(data, other, judged, found.floor)
    found = replace(found, judged=judged)
    outcome = _Outcome(found, supported.vibrations, base, curves, content.missed)
    result = _axis_diagnosis(outcome, recordings)
    return with_band_content(result, content, template, tolerance), judged.validation


def _with_difference(
    problem: AxisProblem, found: AxisSearch, difference: Difference | None
) -> AxisSearch:
    """The search with the finding on what is not as in the other recording."""
    if difference is None:
        return found
    recording, reference = problem.validates[0], problem.recordings[0]
    differs = difference.finding(recording, reference, problem.name, blocks=False)
    return replace(found, checks=(*found.checks, differs))


def _without_orders(found: AxisSearch, axis: AxisModel, doubtful: tuple[Cause, ...]) -> AxisSearch:
    """The search with its model fitted again, on an axis that lacks the doubtful orders."""
    if not doubtful:
        return found
    judged, model = found.judged, found.judged.supported.model
    supported = replace(judged.supported, model=fit(found.data, axis, model.base, model.terms))
    suspected = strongest_first((*judged.suspected, *doubtful))
    return replace(found, judged=replace(judged, supported=supported, suspected=suspected))


def _axis_diagnosis(outcome: _Outcome, recordings: Sequence[Recording]) -> AxisDiagnosis:
    search, base = outcome.search, outcome.base
    data, judged, selected = search.data, search.judged, search.selected
    model = judged.supported.model
    left = float(np.sqrt(model.error / np.count_nonzero(data.valid)))
    deviations = with_trades(data, selected.start, model, search.floor.rms)
    line = friction_line(data, selected.start, model, search.floor.rms)
    extended = replace(model_fit(data, model, deviations), effective=line)
    found, minor = _named(outcome, deviations, recordings)
    seen = traces(data, base, model, contributions(data, model))
    missed = Missed(data, base, search.floor.rms, seen.contributions, outcome.above)
    written = [
        cause
        for cause in (*found, *minor)
        if judged.validation is None or not named(cause.term.effect).tied_to_time
    ]
    return AxisDiagnosis(
        verdict=judged.verdict,
        causes=found,
        suspected=judged.suspected,
        minor=strongest_first((*minor, *judged.minor)),
        refused=judged.supported.refused,
        external_vibrations=_vibrations(outcome.vibrations, data, recordings),
        converged=judged.supported.converged,
        not_testable=not_testable(selected.search, model, left),
        base=model_fit(data, base, with_trades(data, base, base, search.floor.rms)),
        extended=extended,
        timing=timing(data, model),
        noise_floor=search.floor.rms / nonzero_rms(data.effort[data.valid]),
        noise_floor_source=search.floor.source,
        model=written_model(model.template, extended.estimate, written, data),
        cutoff_hz=max(s.cutoff_hz for s in data.segments),
        knee_hz=max(s.band.knee_hz for s in data.segments),
        traces=seen,
        curves=outcome.curves,
        budget=fitted_curves(missed).budget,
        findings=with_other_axes(search.checks, recordings, data, model, search.floor),
    )


def _named(
    outcome: _Outcome, deviations: Array, recordings: Sequence[Recording]
) -> tuple[tuple[Cause, ...], tuple[Cause, ...]]:
    """Causes and minor causes of the model, the strongest first."""
    search, supported = outcome.search, outcome.search.judged.supported
    data, model = search.data, supported.model
    space = base_space(data, search.selected.start)
    found = causes(supported, own_shares(data, model, space), deviations)
    pairs = list(zip(with_sources(found, data, model, recordings), supported.support, strict=True))
    named_causes = strongest_first(cause for cause, support in pairs if not support.minor)
    return named_causes, strongest_first(cause for cause, support in pairs if support.minor)


def _vibrations(
    terms: Sequence[Term], data: AxisData, recordings: Sequence[Recording]
) -> tuple[OutsideVibration, ...]:
    """External vibrations, each with the recording in which it acts."""
    begins = [(s.motion.clock, float(s.motion.time_s[0])) for s in data.segments]
    sources = dict(zip(begins, (recording.source for recording in recordings), strict=True))
    return tuple(
        OutsideVibration(
            float(term.values["frequency"]),
            math.hypot(term.values["cosine"], term.values["sine"]),
            sources[int(term.values["clock"]), float(term.values["begin"])],
        )
        for term in terms
    )


# The extended model of an axis as a file keeps it: physical, and with the range of each term.

_UNSEEN: Final = 1e-3
"""Share of the effort that an inertia may take which the recording cannot show: a tenth of the
smallest effect worth naming. An axis without inertia cannot be simulated."""


def written_model(
    template: AxisModel, estimate: Estimate, causes: Sequence[Cause], data: AxisData
) -> AxisModel:
    """The model of base parameters and causes.

    Parameters
    ----------
    template : AxisModel
        The axis with the effects that it is known to have; those keep their ranges.
    estimate : Estimate
        Of the base parameters.
    data : AxisData
        What the estimate and the causes come from.
    """
    lowest = [named(BASE).bounds[name][0] for name in PARAMETERS]
    values = dict(zip(PARAMETERS, np.maximum(estimate.parameters, lowest).tolist(), strict=True))
    std = dict(zip(PARAMETERS, estimate.std.tolist(), strict=True))
    supported = data.supported
    added = (replace(cause.term, supported=supported) for cause in causes)
    terms = (Term(BASE, values, std, supported=supported), *template.terms[1:], *added)
    effort, acceleration = (
        nonzero_rms(signal[data.valid]) for signal in (data.effort, data.of_motion("acceleration"))
    )
    return made_physical(replace(template, terms=terms), _UNSEEN * effort / acceleration)

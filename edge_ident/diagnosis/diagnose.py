"""Entry point: diagnose recordings of one machine."""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.content import above_band
from edge_ident.diagnosis.axis_search import AxisSearch, OnRun, search_axis
from edge_ident.diagnosis.data_quality import data_findings
from edge_ident.diagnosis.fit.fitting import FittedModel, delayed, fit
from edge_ident.diagnosis.fit.own_effort import base_space, own_shares
from edge_ident.diagnosis.fit.summary import model_fit, nonzero_rms, timing, traces
from edge_ident.diagnosis.fit.term_effort import contributions
from edge_ident.diagnosis.fit.traded import with_trades
from edge_ident.diagnosis.judge.above_band_causes import (
    beside_causes,
    orders_in_step,
    supported_orders,
    with_band_content,
    with_ripples,
    without_names,
)
from edge_ident.diagnosis.judge.causes import causes, strongest_first
from edge_ident.diagnosis.judge.judgement import Rules
from edge_ident.diagnosis.judge.stability import RUNS
from edge_ident.diagnosis.judge.testability import not_testable
from edge_ident.diagnosis.measures import Validation
from edge_ident.diagnosis.motion_check import with_motion_errors
from edge_ident.diagnosis.pooled import check_pooled
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.parts import in_parts
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.recording_checks import (
    contradicted,
    effort_findings,
    with_unrecorded_axes,
)
from edge_ident.diagnosis.result import AxisDiagnosis, Cause, Diagnosis, OutsideVibration
from edge_ident.diagnosis.ripples_above import with_ripples_everywhere
from edge_ident.diagnosis.select.selection import fitted_base
from edge_ident.diagnosis.shown_in import with_sources
from edge_ident.diagnosis.tolerance import TOLERANCE
from edge_ident.diagnosis.validation import Judged
from edge_ident.diagnosis.validation import judge as judge_elsewhere
from edge_ident.diagnosis.written_model import written_model
from edge_ident.errors import DataError
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Model, Term
from edge_ident.signals.lost_rows import with_mended_stamps
from edge_ident.signals.recording import Recording, chosen_axes

Progress = Callable[[str, int, int], None]
Array = NDArray[np.float64]


def diagnose(
    recordings: Sequence[Recording],
    *,
    model: Model | None = None,
    validate: Recording | None = None,
    tolerance: float = TOLERANCE,
    stability: bool = True,
    keep_minor: bool = False,
    only: Collection[str] = (),
    on_progress: Progress = lambda stage, done, of: None,
) -> Diagnosis:
    """Find what the base model gets wrong, name the cause, and extend the model.

    Parameters
    ----------
    recordings : sequence of Recording
        All have the same axes; they are fitted together. Where one goes on from the first
        (`Recording.begin_s`), so does what changes with time.
    model : Model, optional
        Effects that the machine is known to have.
    validate : Recording, optional
        Another recording, on which the fitted models are scored.
    tolerance : float, optional
        Smallest share of the rms effort that is worth naming. Causes that take less off the
        recorded effort are minor.
    stability : bool, optional
        Whether the search is repeated on disturbed data. A cause that does not come back is only
        suspected.
    keep_minor : bool, optional
        Whether the extended model has the minor causes too.
    only : collection of str
        Names of the axes to diagnose; none for all.
    on_progress : callable
        Gets the stage, the number of its steps done and the number of its steps.

    Returns
    -------
    Diagnosis

    Raises
    ------
    DataError
        There is no recording, no axis of a name in `only`, or a senseless tolerance; an axis hardly
        moves; or the recordings are not of one machine: their axes or units differ, or one is given
        twice.

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.diagnose([edge_ident.simulate()])
    >>> found.axes["x"].verdict.value
    'adequate'
    """
    if not recordings:
        raise DataError("there is no recording to diagnose", "give at least one")
    names = chosen_axes(recordings[0].source, recordings[0].axes, only)
    if not 0.0 <= tolerance < math.inf:
        raise DataError(f"a tolerance of {tolerance}", "give a share of the effort, such as 0.01")
    check_pooled([*recordings, *([validate] if validate else [])])
    begin_s = recordings[0].begin_s
    recordings = [
        with_mended_stamps(replace(each, begin_s=each.begin_s - begin_s)) for each in recordings
    ]
    validates = [with_mended_stamps(validate)] if validate else []
    axes, validations = {}, {}
    rules = Rules(tolerance, stability, keep_minor)
    for done, name in enumerate(names):
        searching = partial(on_progress, "diagnosis", done, len(names))
        searching()
        template = _template(recordings[0], name, model)
        told = partial(_told, on_progress, name, searching)
        parts, said = in_parts(recordings, name)
        others, also_said = in_parts(validates, name)
        found, validation = _diagnose_axis(parts, name, template, others, rules, told)
        axes[name] = replace(found, findings=(*said, *also_said, *found.findings))
        if validation is not None:
            validations[name] = validation
    on_progress("diagnosis", len(names), len(names))
    on_progress("simulated motion", 0, 1)
    diagnosis = Diagnosis(axes, data_findings([*recordings, *validates], axes), validations)
    return with_motion_errors(diagnosis, recordings)


def _told(on_progress: Progress, name: str, searching: Callable[[], None], done: int) -> None:
    """Tell how many disturbed runs of an axis are done; after the last one, the search goes on."""
    on_progress(f"stability, axis {name}", done, RUNS)
    if done == RUNS:
        searching()


def _template(recording: Recording, name: str, model: Model | None) -> AxisModel:
    """The axis with the effects that it is known to have."""
    axis = recording.axes[name]
    known: tuple[Term, ...] = ()
    if model is not None and name in model.axes:
        known = model.axes[name].terms[1:]
    base = Term(BASE, dict.fromkeys(PARAMETERS, 0.0))
    return AxisModel((base, *known), *axis.units)


@dataclass(frozen=True)
class _Outcome:
    """An axis after the recordings themselves and, where there is one, another have judged it.

    `base` is the base model without the ripples that were found above the band.
    """

    search: AxisSearch
    base: FittedModel
    carried: Judged


def _diagnose_axis(
    recordings: Sequence[Recording],
    name: str,
    template: AxisModel,
    validates: Sequence[Recording],
    rules: Rules,
    on_run: OnRun,
) -> tuple[AxisDiagnosis, Validation | None]:
    data = _prepared(recordings, name, template)
    content = above_band(recordings, name, data)
    efforts = effort_findings(recordings, name)
    if contradicted(efforts):
        content = without_names(content)
    content, out_of_step = orders_in_step(data, template, content, rules.tolerance)

    def searched(axis: AxisModel) -> AxisSearch:
        found = search_axis(recordings, name, efforts, rules, on_run, data, axis)
        return with_ripples_everywhere(found, recordings, name, rules.tolerance)

    known = with_ripples(template, content, rules.tolerance)
    found = searched(known)
    content = beside_causes(content, found.judged.supported.model, recordings, name, found.data)
    fewer = with_ripples(template, content, rules.tolerance)
    if fewer != known:
        found = searched(fewer)
    content, doubtful = supported_orders(content, found.judged.rest, found.blocked)
    known = with_ripples(template, content, rules.tolerance)
    found = _without_orders(found, known, (*out_of_step, *doubtful))
    data, start = found.data, found.selected.start
    carried = Judged(found.judged.supported.without_vibrations(data))
    if validates:
        other = _prepared(validates, name, carried.supported.model.axis)
        carried = judge_elsewhere(data, other, start, carried.supported, rules.tolerance)
    base = start if start.template is template else fitted_base(data, template)
    result = _axis_diagnosis(_Outcome(found, base, carried), known, recordings)
    return with_band_content(result, content, template, rules.tolerance), carried.validation


def _without_orders(found: AxisSearch, axis: AxisModel, doubtful: tuple[Cause, ...]) -> AxisSearch:
    """The search with its model fitted again, on an axis that lacks the doubtful orders."""
    if not doubtful:
        return found
    judged, model = found.judged, found.judged.supported.model
    supported = replace(judged.supported, model=fit(found.data, axis, model.base, model.terms))
    suspected = strongest_first((*judged.suspected, *doubtful))
    return replace(found, judged=replace(judged, supported=supported, suspected=suspected))


def _axis_diagnosis(
    outcome: _Outcome, template: AxisModel, recordings: Sequence[Recording]
) -> AxisDiagnosis:
    search, base = outcome.search, outcome.base
    data, judged, selected = search.data, search.judged, search.selected
    model = outcome.carried.supported.model
    left = float(np.sqrt(model.error / np.count_nonzero(data.valid)))
    deviations = with_trades(data, selected.start, model, search.floor.rms)
    extended = model_fit(data, model, deviations)
    found, minor = _named(outcome, deviations, recordings)
    written = outcome.carried.carried((*found, *minor))
    return AxisDiagnosis(
        verdict=outcome.carried.verdict(judged.verdict),
        causes=found,
        suspected=strongest_first((*judged.suspected, *outcome.carried.suspected)),
        minor=strongest_first((*minor, *judged.minor)),
        refused=judged.supported.refused,
        external_vibrations=_vibrations(judged.supported.vibrations, data, recordings),
        converged=judged.supported.converged,
        not_testable=not_testable(selected.search, model, left),
        base=model_fit(data, base, with_trades(data, base, base, search.floor.rms)),
        extended=extended,
        timing=timing(data, model),
        noise_floor=search.floor.rms / nonzero_rms(data.effort[data.valid]),
        noise_floor_source=search.floor.source,
        model=written_model(template, extended.estimate, written, data),
        cutoff_hz=max(s.cutoff_hz for s in data.segments),
        knee_hz=max(s.band.knee_hz for s in data.segments),
        traces=traces(data, base, model, contributions(data, model)),
        findings=with_unrecorded_axes(search.checks, recordings, data, model, search.floor),
    )


def _named(
    outcome: _Outcome, deviations: Array, recordings: Sequence[Recording]
) -> tuple[tuple[Cause, ...], tuple[Cause, ...]]:
    """Causes and minor causes of the model, the strongest first."""
    search, supported = outcome.search, outcome.carried.supported
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


def _prepared(recordings: Sequence[Recording], name: str, axis: AxisModel) -> AxisData:
    """The axis, in step with its motion unless a delay in its model accounts for that."""
    return prepare_axis(recordings, name, timed=not delayed(axis))

"""The front door: diagnose recordings of one machine."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from edge_ident.diagnosis.fit.fitting import FittedModel, delayed, fit
from edge_ident.diagnosis.fit.held_out import standard_deviations
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor, noise_floor
from edge_ident.diagnosis.fit.summary import (
    contributions,
    model_fit,
    nonzero_rms,
    timing,
    traces,
)
from edge_ident.diagnosis.fit.traded import with_trades
from edge_ident.diagnosis.measures import Validation
from edge_ident.diagnosis.motion_check import with_motion_errors
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.data_quality import data_findings
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.recording_checks import findings
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis, Verdict
from edge_ident.diagnosis.select.acceptance import structure_left
from edge_ident.diagnosis.select.backward_elimination import SupportedModel, eliminate_backward
from edge_ident.diagnosis.select.causes import causes, strongest_first
from edge_ident.diagnosis.select.forward_selection import select_forward
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.testability import not_testable
from edge_ident.diagnosis.validation import Judged, judge, with_sources
from edge_ident.diagnosis.written_model import written_model
from edge_ident.errors import DataError
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Estimate, Model, Term
from edge_ident.signals.data_checks import check_efforts
from edge_ident.signals.recording import Recording

Progress = Callable[[str, int, int], None]

_START: Final = np.array([1.0, 0.0, 0.0, 0.0])
"""Base parameters that the first fit starts from."""


def diagnose(
    recordings: Sequence[Recording],
    *,
    model: Model | None = None,
    validate: Recording | None = None,
    only: Collection[str] = (),
    on_progress: Progress = lambda stage, done, of: None,
) -> Diagnosis:
    """Find what the base model gets wrong, name the cause, and extend the model.

    Parameters
    ----------
    recordings : sequence of Recording
        All have the same axes; they are fitted together.
    model : Model, optional
        Effects that the machine is known to have.
    validate : Recording, optional
        Another recording, on which the fitted models are scored.
    only : collection of str
        Names of the axes to diagnose; none for all.
    on_progress : callable
        Gets the stage, the number of axes done and the number of axes.

    Returns
    -------
    Diagnosis

    Raises
    ------
    DataError
        An axis hardly moves, or is not in every recording.

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.diagnose([edge_ident.simulate()])
    >>> found.axes["x"].verdict.value
    'adequate'
    """
    names = [name for name in recordings[0].axes if name in (only or recordings[0].axes)]
    _check_axes([*recordings, *([validate] if validate else [])])
    axes, validations = {}, {}
    for done, name in enumerate(names):
        on_progress("diagnosis", done, len(names))
        template = _template(recordings[0], name, model)
        axes[name], validation = _diagnose_axis(recordings, name, template, validate)
        if validation is not None:
            validations[name] = validation
    on_progress("diagnosis", len(names), len(names))
    on_progress("simulated motion", 0, 1)
    found = Diagnosis(axes, data_findings(recordings, axes), validations)
    return with_motion_errors(found, recordings)


def _check_axes(recordings: Sequence[Recording]) -> None:
    """Raise DataError where recordings have different axes, or an effort that never changes."""
    first = recordings[0]
    for recording in recordings:
        check_efforts(recording)
    for other in recordings[1:]:
        if set(other.axes) != set(first.axes):
            raise DataError(
                f"{other.source} has axes {', '.join(other.axes)}, {first.source} has "
                f"{', '.join(first.axes)}",
                "give recordings of the same machine, or rename columns with --column",
            )


def _template(recording: Recording, name: str, model: Model | None) -> AxisModel:
    """The axis with the effects that it is known to have."""
    axis = recording.axes[name]
    known: tuple[Term, ...] = ()
    if model is not None and name in model.axes:
        known = model.axes[name].terms[1:]
    base = Term(BASE, dict.fromkeys(PARAMETERS, 0.0))
    return AxisModel((base, *known), axis.position_unit, axis.effort_unit)


@dataclass(frozen=True)
class _Selected:
    """The base model of an axis, and the model that the selection ends with."""

    search: Search
    start: FittedModel
    supported: SupportedModel


def _diagnose_axis(
    recordings: Sequence[Recording],
    name: str,
    template: AxisModel,
    validate: Recording | None,
) -> tuple[AxisDiagnosis, Validation | None]:
    data, selected = _selected(_prepared(recordings, name, template), template)
    search, start = selected.search, selected.start
    supported = selected.supported.without_vibrations(data)
    judged = Judged(supported)
    if validate is not None:
        judged = judge(data, _prepared([validate], name, supported.model.axis), start, supported)
    supported, model = judged.supported, judged.supported.model
    floor = noise_floor(data, start, float(model.base[0]))
    left = float(np.sqrt(model.error / np.count_nonzero(data.valid)))
    deviations = with_trades(data, start, model, floor.rms)
    estimate = Estimate(model.base, deviations[: len(PARAMETERS)])
    parts = contributions(data, model)
    found = causes(data, supported, parts, deviations)
    found = strongest_first(with_sources(found, data, model, recordings))
    diagnosis = AxisDiagnosis(
        verdict=judged.verdict(_verdict(search, model, floor, left)),
        causes=found,
        suspected=judged.suspected,
        refused=supported.refused,
        external_vibrations=selected.supported.vibrations,
        converged=supported.converged,
        not_testable=not_testable(search, model, left),
        base=model_fit(data, start, standard_deviations(data, start)),
        extended=model_fit(data, model, deviations),
        timing=timing(data, model),
        noise_floor=floor.rms / nonzero_rms(data.effort[data.valid]),
        noise_floor_source=floor.source,
        model=written_model(template, estimate, judged.carried(found), data),
        cutoff_hz=max(s.cutoff_hz for s in data.segments),
        knee_hz=max(s.band.knee_hz for s in data.segments),
        traces=traces(data, start, model, parts),
        findings=findings(recordings, name, data, start, selected.supported.model),
    )
    return diagnosis, judged.validation


def _prepared(recordings: Sequence[Recording], name: str, axis: AxisModel) -> AxisData:
    """The axis, in step with its motion unless a delay in its model accounts for that."""
    return prepare_axis(recordings, name, timed=not delayed(axis))


def _selected(data: AxisData, template: AxisModel) -> tuple[AxisData, _Selected]:
    """Select a model; repeat it where aliasing hides an event, with those samples valid."""
    selected = _select(data, template)
    residual = data.effort - selected.supported.model.predicted
    hidden = data.exceeds_aliasing(residual, float(selected.start.base[0]))
    if np.any(hidden):
        data = data.with_valid(hidden)
        selected = _select(data, template)
    return data, selected


def _select(data: AxisData, template: AxisModel) -> _Selected:
    start = fit(data, template, _START, ())
    search = Search.of(data, template, start)
    selection = select_forward(search, start)
    search = search.with_samples(selection.samples)
    return _Selected(search, start, eliminate_backward(search, selection.model))


def _verdict(search: Search, model: FittedModel, floor: NoiseFloor, left: float) -> Verdict:
    """The verdict on a model whose residual has the rms `left`."""
    samples = np.count_nonzero(search.data.valid)
    discrepancy = float(np.sqrt(search.criterion.discrepancy(model) / samples))
    if structure_left(left, floor.rms, floor.uncertainty, discrepancy):
        return Verdict.UNEXPLAINED
    return Verdict.EXPLAINED if model.terms else Verdict.ADEQUATE

"""Entry point: diagnose recordings of one machine."""

import math
import warnings
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from edge_ident.diagnosis.axis_diagnosis import AxisProblem, diagnose_axis
from edge_ident.diagnosis.measures import TOLERANCE
from edge_ident.diagnosis.motion_check import with_motion_errors
from edge_ident.diagnosis.prepare.preparation import TooShortError, in_parts
from edge_ident.diagnosis.recording_checks import check_pooled
from edge_ident.diagnosis.result import DataFinding, Diagnosis
from edge_ident.errors import DataError
from edge_ident.estimation.trust import Finding, check_tracking
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Model, Term
from edge_ident.model.model_files import GivenModel, given_model
from edge_ident.signals.recording import AxisRecord, Recording, chosen_axes
from edge_ident.signals.recording_files import Given, given_recording, given_recordings
from edge_ident.signals.scale_checks import check_scale
from edge_ident.signals.time_stamps import (
    GAP,
    EvenGrid,
    clipped,
    even_rows_sentence,
    lost_rows_sentence,
    with_mended_stamps,
)
from edge_ident.support.given import number
from edge_ident.support.words import listed

Progress = Callable[[str, int, int], None]

_LARGEST: Final = math.nextafter(1.0, 0.0)
"""Largest tolerance: a share that is less than the whole."""


def diagnose(
    recordings: Given | Iterable[Given],
    *,
    model: GivenModel | None = None,
    validate: Given | None = None,
    tolerance: float = TOLERANCE,
    stability: bool | None = None,
    keep_minor: bool | None = None,
    only: str | Collection[str] = (),
    on_progress: Progress = lambda stage, done, of: None,
) -> Diagnosis:
    """Find what the base model gets wrong, name the cause, and extend the model.

    Parameters
    ----------
    recordings : Recording, str, Path or data frame, or a sequence of these
        One, or several of one machine; from a path or a data frame `load_recording` makes one. All
        have the same axes, and each is fitted to those in which it is driven. Where one goes on
        from the first (`Recording.begin_s`), so does what changes with time.
    model : Model, result with a model, str or Path, optional
        Effects that the machine is known to have.
    validate : Recording, str, Path or data frame, optional
        Another recording, on which the fitted models are scored.
    tolerance : float, optional
        Smallest share of the rms effort that is worth naming, below one. Causes that take less off
        the recorded effort are minor.
    stability : bool, optional
        Deprecated, and without effect: no search is repeated on disturbed data any more.
    keep_minor : bool, optional
        Deprecated, and without effect: the extended model has the minor causes.
    only : str or collection of str
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
    >>> found = edge_ident.diagnose(edge_ident.simulate())
    >>> found.axes["x"].verdict.value
    'adequate'
    """
    for old, value in (("stability", stability), ("keep_minor", keep_minor)):
        if value is not None:
            unused = f"`{old}` has no effect: leave it out"
            warnings.warn(unused, DeprecationWarning, stacklevel=2)
    number("tolerance", tolerance, 0.0, _LARGEST, "give a share of the effort, such as 0.01")
    every = given_recordings(recordings)
    validate = None if validate is None else given_recording(validate, "validate")
    model = None if model is None else given_model(model)
    only = [only] if isinstance(only, str) else only
    names = _axes_to_diagnose(every, validate, only)
    begin_s = every[0].begin_s
    every = [with_mended_stamps(replace(each, begin_s=each.begin_s - begin_s)) for each in every]
    validates = [with_mended_stamps(validate)] if validate else []
    axes, validations = {}, {}
    for done, name in enumerate(names):
        on_progress("diagnosis", done, len(names))
        parts, places, said = in_parts(every, name)
        others, _, also_said = in_parts(validates, name)
        problem = AxisProblem(parts, name, _template(parts[0], name, model), others, tolerance)
        problem, places, short = _without_short(problem, places)
        found, validation = diagnose_axis(problem)
        given = replace(found.traces, recording=np.array(places)[found.traces.file])
        told_first = (*said, *short, *also_said, *check_tracking(every, name))
        axes[name] = replace(found, findings=(*told_first, *found.findings), traces=given)
        if validation is not None:
            validations[name] = validation
    on_progress("diagnosis", len(names), len(names))
    on_progress("simulated motion", 0, 1)
    diagnosis = Diagnosis(axes, data_findings([*every, *validates], axes), validations)
    return with_motion_errors(diagnosis, every)


def _without_short(
    problem: AxisProblem, places: list[int]
) -> tuple[AxisProblem, list[int], list[Finding]]:
    """A problem without the recordings that show nothing of its axis, the places of the others, and
    which are left out."""
    try:
        _ = problem.data  # it is kept
    except TooShortError as short:
        kept = [k for k in range(len(places)) if k not in short.places]
        left_out = listed(dict.fromkeys(problem.recordings[k].source for k in short.places))
        finding = Finding(
            "recording_left_out",
            f"{left_out}: no sample lies away from standstill and reversals, so it is left out",
            short.next_step,
            blocks=False,
        )
        recordings = [problem.recordings[k] for k in kept]
        return replace(problem, recordings=recordings), [places[k] for k in kept], [finding]
    return problem, places, []


def _axes_to_diagnose(
    recordings: Sequence[Recording], validate: Recording | None, only: Collection[str]
) -> list[str]:
    """Names of the axes that a drive moves in a recording, once all recordings are checked."""
    if not recordings:
        raise DataError("there is no recording to diagnose", "give at least one")
    driven = dict.fromkeys(name for recording in recordings for name in recording.axes)
    names = chosen_axes(recordings[0].source, driven, only)
    check_pooled([*recordings, *([validate] if validate else [])])
    if validate and not any(name in validate.axes for name in names):
        raise DataError(
            f"{validate.source} tests nothing: no drive moves axis {listed(names)} in it",
            "give a recording in which an axis of the diagnosis moves",
        )
    return names


def _template(recording: Recording, name: str, model: Model | None) -> AxisModel:
    """The axis with the effects that it is known to have."""
    axis = recording.axes[name]
    known: tuple[Term, ...] = ()
    if model is not None and name in model.axes:
        known = model.axes[name].terms[1:]
    base = Term(BASE, dict.fromkeys(PARAMETERS, 0.0))
    return AxisModel((base, *known), *axis.units)


# Defects of the data: gaps, uneven sampling, clipped efforts, doubtful units.


def data_findings(recordings: Sequence[Recording], axes: Iterable[str]) -> tuple[DataFinding, ...]:
    """Find the defects of the data, each once.

    Parameters
    ----------
    recordings : sequence of Recording
        Of several, the findings say which.
    axes : iterable of str
        Names of the axes to check.
    """
    found = [
        replace(finding, message=f"{recording.source}: {finding.message}")
        if len(recordings) > 1
        else finding
        for recording in recordings
        for name in axes
        if name in recording.axes
        for finding in _of_axis(recording, name)
    ]
    return tuple(dict.fromkeys(found))


def _of_axis(recording: Recording, name: str) -> list[DataFinding]:
    return [
        *_timing(recording, name),
        *_clipping(recording.axes[name], name),
        *_units(recording, name),
    ]


def _timing(recording: Recording, name: str) -> list[DataFinding]:
    found = []
    if recording.stamp_jitter:
        message = even_rows_sentence(recording.stamp_jitter)
        found.append(DataFinding("jittering_stamps", name, message))
    if recording.lost_rows:
        message = lost_rows_sentence(recording.lost_rows)
        found.append(DataFinding("lost_rows", name, message))
    if found:
        return [*found, *_gaps(recording, name)]
    return _gaps(recording, name) or _uneven(recording, name)


def _gaps(recording: Recording, name: str) -> list[DataFinding]:
    steps = np.diff(recording.time_s)
    gaps = int(np.count_nonzero(steps > GAP * np.median(steps)))
    if gaps:
        longest = float(np.max(steps))
        what = "a gap of" if gaps == 1 else f"{gaps} gaps of up to"
        were = "was" if gaps == 1 else "were"
        message = f"{what} {longest:.3g} s in the time stamps {were} bridged"
        return [DataFinding("gaps", name, message)]
    return []


def _uneven(recording: Recording, name: str) -> list[DataFinding]:
    grid = EvenGrid.of(recording.time_s)
    if grid.uneven:
        message = (
            f"time stamps are up to {grid.jitter:.2g} periods off an even grid; samples "
            "were interpolated"
        )
        return [DataFinding("uneven_sampling", name, message)]
    return []


def _clipping(axis: AxisRecord, name: str) -> list[DataFinding]:
    share = float(np.mean(clipped(axis.effort)))
    if not share:
        return []
    low, high = float(np.min(axis.effort)), float(np.max(axis.effort))
    message = (
        f"{share:.1%} of the samples have exactly the highest or lowest effort ({low:.4g} to "
        f"{high:.4g} {axis.effort_unit}): the effort is clipped there, and these samples are left "
        "out; record with a larger range, or a gentler motion"
    )
    return [DataFinding("clipped", name, message)]


def _units(recording: Recording, name: str) -> list[DataFinding]:
    """Questions that a recording raises and cannot answer."""
    return [
        DataFinding(question.code, name, f"{question.message} {_sentence(question.next_step)}")
        for question in check_scale(recording, name)
    ]


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:]

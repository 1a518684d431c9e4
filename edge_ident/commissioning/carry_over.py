"""The diagnosis of a run, and whether what it found carries over to the second motion.

Every axis whose base model is not enough is diagnosed on the first motion. What stays open is
separated by further motions. One motion may hide an effect that another one shows: on one sinusoid,
a spring is a smaller inertia. The second motion of a trial is recorded anyway. So the model is
fitted to it as well. Where that is not enough, or gives other parameters, the recording joins those
of the identification, and all are diagnosed together.
"""

import logging
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from edge_ident.commissioning.gains.trial import Recorded
from edge_ident.commissioning.study.computing import OutOfTimeError, Progress
from edge_ident.commissioning.study.identification_motions import (
    IdentificationMotion,
    Study,
    with_diagnoses,
)
from edge_ident.commissioning.study.separation import Separation, judged, separate
from edge_ident.errors import DataError
from edge_ident.identification.adequacy import LARGEST_MOVE, SIGNIFICANT
from edge_ident.identification.identify import identify
from edge_ident.identification.result import AxisIdentification, Identification
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, Model
from edge_ident.signals.recording import Recording

if TYPE_CHECKING:
    from edge_ident.diagnosis.result import AxisDiagnosis

log = logging.getLogger(__name__)


def diagnosed(study: Study, separation: Separation, second: Recorded | None) -> Separation:
    """Find out what the base model lacks, within the time that the study has for it.

    Parameters
    ----------
    study : Study
    separation : Separation
        The first motion alone.
    second : Recorded or None
        The second motion of a trial, with the gains in force before.

    Returns
    -------
    Separation
        With all motions that were made for it, and what is known then.

    Raises
    ------
    LinkError, BoardError
        A motion that is designed to separate what is left did not get to its end.
    """
    try:
        first, missed = _diagnosed_first(study, separation.motions[0])
        separation = Separation((first,), missed)
        if missed:
            study.tell(missed)
            return separation
        separation = separate(study, [first])
        return separation if second is None else _reconsidered(study, separation, second)
    except OutOfTimeError as error:
        study.tell(error.cause)
        return replace(separation, ended=error.cause)


def _diagnosed_first(study: Study, first: IdentificationMotion) -> tuple[IdentificationMotion, str]:
    """The first motion with a diagnosis of each axis whose base model is not enough; and what to
    say where time did not allow that of every axis."""
    found: dict[str, AxisDiagnosis] = {}
    missed = ""
    for name, axis in first.found.axes.items():
        if axis.adequacy.adequate:
            continue
        try:
            found[name] = study.computed(partial(_of_axis, first.recording, name, study.model))
        except DataError as error:
            study.tell(f"axis {name} could not be diagnosed: {error.cause}")
        except OutOfTimeError as error:
            missed = error.cause
            break
    if found:
        first = replace(first, found=with_diagnoses(study, first.recording, found))
    return first, missed


def _of_axis(
    recording: Recording, name: str, model: Model | None, on_progress: Progress
) -> "AxisDiagnosis":
    from edge_ident.diagnosis.diagnose import diagnose

    # what is too small to be named still moves parameters
    found = diagnose(
        [recording], model=model, keep_minor=True, only=[name], on_progress=on_progress
    )
    return found.axes[name]


def _reconsidered(study: Study, separation: Separation, second: Recorded) -> Separation:
    """The motions of a run with the second one of a trial, if that contradicts what was found."""
    if len(separation.motions) >= study.most_motions:
        return separation
    try:
        against = contradictions(separation.found, second.capture.recording)
        if not against:
            return separation
        for name, sentences in against.items():
            said = "; ".join(sentences)
            study.tell(f"axis {name}: {said}; {second.file} joins the identification")
        trajectory, capture, found = second.motion.trajectory, second.capture, separation.found
        made = IdentificationMotion(second.file, trajectory, capture, found, None, {}, against)
        motions = separation.motions
        return separate(study, [*motions, judged(study, motions, made)])
    except DataError as error:
        log.info("the second motion cannot be judged: %s", error.cause)
        return separation


def contradictions(found: Identification, recording: Recording) -> dict[str, tuple[str, ...]]:
    """What another recording of the machine says against what was identified.

    Parameters
    ----------
    found : Identification
    recording : Recording
        Not used for it.

    Returns
    -------
    mapping of axis name to tuple of str
        Sentences; axes without any are left out. An axis is not judged if a term of its model
        belongs to the time of the recordings before.

    Raises
    ------
    DataError
        Hardly any sample shows an axis in motion.
    """
    seen = identify(recording, model=found.model, diagnose=False)
    said = {
        name: _against(axis, seen.axes[name])
        for name, axis in found.axes.items()
        if not any(named(effect).tied_to_time for effect in axis.compensated_effects)
    }
    return {name: sentences for name, sentences in said.items() if sentences}


def _against(before: AxisIdentification, now: AxisIdentification) -> tuple[str, ...]:
    """What the same model, fitted to another recording, says against it."""
    adequacy = now.adequacy
    found = () if adequacy.adequate else (f"on the second motion, {adequacy.reason}",)
    return found + tuple(
        f"the second motion's {name} is {value:.3g} and not {expected:.3g} {unit}"
        for name, value, expected, unit in _moved(before, now)
    )


def _moved(
    before: AxisIdentification, now: AxisIdentification
) -> Iterator[tuple[str, float, float, str]]:
    """Parameters that both recordings claim to know, and of which they know different values.

    The offset is left out: it drifts, and both motions show it.
    """
    old, new = before.estimate, now.estimate
    apart = np.abs(new.parameters - old.parameters)
    size = np.maximum(np.abs(new.parameters), np.abs(old.parameters))
    moved = (apart > LARGEST_MOVE * size) & (apart > SIGNIFICANT * np.hypot(old.std, new.std))
    for n, name in enumerate(PARAMETERS[:3]):
        if moved[n]:
            yield name.replace("_", " "), new.parameters[n], old.parameters[n], before.units[n]

"""Entry point: identify and diagnose every recording of a folder, and compare the units."""

import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Final

import numpy as np

from edge_ident.diagnosis.measures import TOLERANCE
from edge_ident.fleet.analysis import Options, failure_of
from edge_ident.fleet.between_units import FEWEST_UNITS, distances, spread_of
from edge_ident.fleet.folder import Found, Units, find_recordings
from edge_ident.fleet.result import (
    Comparison,
    Failed,
    Survey,
    SurveyedAxis,
    SurveyedCause,
    SurveyedRecording,
    UnitValue,
    Value,
)
from edge_ident.fleet.workers import Outcomes, Task, run_on_cluster, run_processes
from edge_ident.model.effects import named
from edge_ident.model.model import NORMAL_95, PARAMETERS, Array
from edge_ident.model.model_files import GivenModel, given_model
from edge_ident.signals.read_columns import ReadOptions
from edge_ident.support.documents import file_sha256, read_json, to_json, write_json
from edge_ident.support.given import check_type, path
from edge_ident.support.given import number as check_number
from edge_ident.support.version import VERSION

Progress = Callable[[str, int, int], None]


def survey(
    folder: str | Path,
    *,
    units: Units = "file",
    pattern: str | None = None,
    options: ReadOptions | None = None,
    model: GivenModel | None = None,
    diagnose: bool = True,
    jobs: int | None = None,
    cluster: str | None = None,
    output: str | Path | None = None,
    on_progress: Progress = lambda stage, done, of: None,
    on_recording: Callable[[SurveyedRecording], None] = lambda recording: None,
) -> Survey:
    """Identify and diagnose every recording of a folder, and compare the units.

    A recording that cannot be used is a row that says why, and stops no other.

    Parameters
    ----------
    folder : str or Path
        Subfolders count, too.
    units : {"file", "folder"}
        Whether each recording is a unit, or all recordings of one subfolder are.
    pattern : str, optional
        Of the files to take, such as `*.csv`. Default: every ending of a recording.
    options : ReadOptions, optional
        How the files are read, the same for all.
    model : Model, result with a model, str or Path, optional
        Effects that the units are known to have.
    diagnose : bool
        Whether an axis whose base model is not adequate is diagnosed.
    jobs : int, optional
        Recordings side by side, each in a process. Default: one for each core.
    cluster : str, optional
        Address of a Dask scheduler, `tcp://HOST:PORT`, whose workers take the place of processes.
    output : str or Path, optional
        Folder that keeps the result of each recording as soon as it is there. Results of an
        earlier survey with the same options are taken from it, unless a recording has changed.
    on_progress : callable
        Gets the stage, the number of its recordings done and the number of its recordings.
    on_recording : callable
        Gets the result of each recording that is analysed.

    Returns
    -------
    Survey

    Raises
    ------
    DataError
        There is no such folder, it holds no recording, or Dask is missing.
    LinkError
        There is no cluster at the address.
    OSError
        A result cannot be written.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_recording(edge_ident.simulate(), "machines/first.csv")
    >>> found = edge_ident.survey("machines", jobs=1)
    >>> found.table()["verdict"]
    ['adequate', 'adequate']
    """
    kept = None if output is None else path(output, "a folder for the results")
    files, left_out = find_recordings(path(folder, "the recordings' folder"), units, pattern, kept)
    if kept is not None:
        kept.mkdir(parents=True, exist_ok=True)  # before the work, not after it
    common, tasks = _options(options, model, diagnose), list[Task]()
    done = dict[Found, SurveyedRecording]()
    for number, file in enumerate(files):
        on_progress("looking for results", number, len(files))
        known = _task_or_result(file, common, kept)
        if isinstance(known, Task):
            tasks.append(known)
        else:
            done[file] = known
            if known.failed:
                on_recording(known)
    on_progress("recordings", 0, len(tasks))
    with closing(_outcomes(tasks, jobs or _cores(), cluster)) as outcomes:
        for number, (task, document) in enumerate(outcomes, start=1):
            if kept is not None and document["failed"] is None:
                keep(kept, task.key, document)
            found = recording_of(document, task.found.name, task.found.unit, task.sha256)
            done[task.found] = found
            on_recording(found)
            on_progress("recordings", number, len(tasks))
    rows = tuple(map(done.__getitem__, files))
    return Survey(rows, compare_units(rows), left_out)


def _options(
    options: ReadOptions | None, model: GivenModel | None, diagnose: bool
) -> Mapping[str, Any]:
    check_type(options, (ReadOptions, type(None)), "give ReadOptions(...)")
    known = None if model is None else given_model(model)
    return Options(options or ReadOptions(), known, diagnose).document()


def _task_or_result(
    file: Found, options: Mapping[str, Any], kept: Path | None
) -> Task | SurveyedRecording:
    """What is to be done, or what is known of a file: a kept result, or that nobody can read it."""
    try:
        sha256 = file_sha256(file.path)
    except OSError as error:
        return SurveyedRecording(file.name, file.unit, "", {}, failure_of(error), 0.0)
    key = key_of(sha256, file.path.suffix, options)
    before = load_kept(kept, key) if kept else None
    if before is None:
        return Task(file, sha256, key, options)
    return recording_of(before, file.name, file.unit, sha256)


def _outcomes(tasks: list[Task], jobs: int, cluster: str | None) -> Outcomes:
    check_number("jobs", jobs, 1, 10_000, "give the number of processes, or leave it out")
    if cluster is not None and tasks:
        return run_on_cluster(tasks, cluster)
    return run_processes(tasks, jobs)


def _cores() -> int:
    """Processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


# Which quantities of the units are compared, and with what values.
#
# - Every parameter of every axis.
# - Every effect that is a supported cause anywhere, by its share of the rms effort. Effects that a
#   recording does not separate are one quantity. Where an effect was not found, its share is zero
#   within the tolerance; where it is only suspected, or the motion could not show it, the unit is
#   left out. An effect tied to time belongs to a recording and not to a unit: it is not compared.
#
# An axis that is not trusted is not compared. Several recordings of a unit become one value.

Axes = Sequence[tuple[str, SurveyedAxis]]
"""One axis of several recordings, each with its unit."""
Measured = Mapping[str, list[tuple[float, float]]]
"""Values with their deviations, by unit."""

# Deviation of the share of an effect not found: 95 % sure to be below what is worth naming.
_NOT_FOUND_STD: Final = TOLERANCE / NORMAL_95


def compare_units(recordings: Iterable[SurveyedRecording]) -> tuple[Comparison, ...]:
    """Compare the units in every quantity.

    Parameters
    ----------
    recordings : iterable of SurveyedRecording
    """
    axes: dict[tuple[str, str], list[tuple[str, SurveyedAxis]]] = {}
    for recording in recordings:
        for name, axis in recording.axes.items():
            if axis.trusted:
                kind = (name, axis.parameters[PARAMETERS[0]].unit)
                axes.setdefault(kind, []).append((recording.unit, axis))
    found = [
        (name, *quantity)
        for (name, _), of_axis in axes.items()
        for quantity in (*_parameters(of_axis), *_effects(of_axis))
    ]
    values = [_unit_values(measured) for *_, measured in found]
    judged = sum(len(of) >= FEWEST_UNITS for of in values)
    return tuple(
        _comparison(axis, quantity, unit, of, judged)
        for (axis, quantity, unit, _), of in zip(found, values, strict=True)
    )


def _parameters(axes: Axes) -> Iterator[tuple[str, str, Measured]]:
    for name in PARAMETERS:
        measured: dict[str, list[tuple[float, float]]] = {}
        for unit, axis in axes:
            found = axis.parameters[name]
            if found.std:
                measured.setdefault(unit, []).append((found.value, found.std))
        yield name, axes[0][1].parameters[name].unit, measured


def _effects(axes: Axes) -> Iterator[tuple[str, str, Measured]]:
    for group in effect_groups(axis for _, axis in axes):
        measured: dict[str, list[tuple[float, float]]] = {}
        for unit, axis in axes:
            share = _share(axis, group)
            if share is not None:
                measured.setdefault(unit, []).append(share)
        yield "/".join(sorted(group)), "", measured


def effect_groups(axes: Iterable[SurveyedAxis]) -> list[frozenset[str]]:
    """Effects that are a supported cause anywhere, together where a recording does not separate
    them."""
    found = [cause for axis in axes for cause in axis.causes if cause.kind != "suspected"]
    names = {cause.effect for cause in found}
    groups: list[frozenset[str]] = []
    for linked in ({cause.effect, *(names & {*cause.alternatives})} for cause in found):
        touched = [group for group in groups if group & linked]
        groups = [group for group in groups if group not in touched]
        groups.append(frozenset(linked).union(*touched))
    supported = {cause.effect for cause in found if cause.kind == "supported"}
    lasting = (group for group in groups if not any(named(one).tied_to_time for one in group))
    return sorted((group for group in lasting if group & supported), key=sorted)


def _share(axis: SurveyedAxis, group: frozenset[str]) -> tuple[float, float] | None:
    """Share of the effort with its deviation; None where the recording does not say."""
    of_group = [cause for cause in axis.causes if cause.effect in group]
    certain = [cause for cause in of_group if cause.kind != "suspected"]
    if certain:
        share = float(np.hypot.reduce([cause.share for cause in certain]))
        return share, float(np.hypot.reduce([cause.share_std for cause in certain]))
    if of_group or axis.verdict is None or group & {*axis.not_testable}:
        return None
    return 0.0, _NOT_FOUND_STD


def _unit_values(measured: Measured) -> dict[str, tuple[float, float]]:
    """One value a unit: that of its recording, or the centre of those of several."""
    values = {}
    for unit, of in measured.items():
        value, std = np.array(of).T
        if len(of) > 1:
            pooled = spread_of(value, std, np.ones((1, len(of)), dtype=np.bool_))
            value, std = pooled.centre, pooled.std
        values[unit] = (float(value[0]), float(std[0]))
    return values


def _if_alike(share: Array, std: Array) -> Array:
    """Deviations that shares of an effect have in units that are all alike.

    They grow with the share. Whether a unit differs from others that do not have the effect is a
    question of what they may hide, and not of how well the size of its own is known.
    """
    relative = np.divide(std, share, out=np.zeros_like(std), where=share > 0.0)
    return np.minimum(std, np.maximum(_NOT_FOUND_STD, relative * np.median(share)))


def _comparison(
    axis: str, quantity: str, unit: str, values: Mapping[str, tuple[float, float]], judged: int
) -> Comparison:
    value, std = np.array([*values.values()]).reshape(-1, 2).T
    found = distances(value, std if unit else _if_alike(value, std), judged)
    return Comparison(
        axis=axis,
        quantity=quantity,
        of_effect=not unit,
        unit=unit,
        centre=found.centre if found else None,
        between=found.between if found else None,
        units={
            name: UnitValue(
                *values[name],
                float(found.distance[i]) if found else None,
                bool(found.stands_out[i]) if found else False,
            )
            for i, name in enumerate(values)
        },
    )


# Results that are kept, so that a second survey does only what is missing.
#
# A result is known by a hash of all that it follows from: the content of the recording, the
# options, and the version of edge-ident. What failed is not kept: it is tried again.

SCHEMA: Final = "edge-ident/survey-recording/1"
FOLDER: Final = "recordings"


def key_of(sha256: str, ending: str, options: Mapping[str, Any]) -> str:
    """Hash of what a result follows from.

    Parameters
    ----------
    sha256 : str
        Of the recording.
    ending : str
        Of its name, which tells the format.
    options : mapping
    """
    parts = {
        "schema": SCHEMA,
        "version": VERSION,
        "sha256": sha256,
        "ending": ending.lower(),
        "options": options,
    }
    return hashlib.sha256(to_json(parts).encode()).hexdigest()


def load_kept(folder: Path, key: str) -> dict[str, Any] | None:
    """A result that was kept; None where there is none that can be read."""
    try:
        document = read_json(folder / FOLDER / f"{key}.json")
        recording_of(document, "", "", "")  # complete
    except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError):
        return None
    return document if document.get("schema") == SCHEMA else None


def keep(folder: Path, key: str, document: Mapping[str, Any]) -> None:
    """Keep a result, whole or not at all.

    Raises
    ------
    OSError
        It cannot be written.
    """
    write_json({"schema": SCHEMA, **document}, folder / FOLDER / f"{key}.json")


def recording_of(
    document: Mapping[str, Any], file: str, unit: str, sha256: str
) -> SurveyedRecording:
    """A result document as the result of a file.

    Raises
    ------
    KeyError, TypeError
        The document is not what `edge_ident.fleet.analysis.analyse` returns.
    """
    failed = document["failed"]
    return SurveyedRecording(
        file=file,
        unit=unit,
        sha256=sha256,
        axes={name: _axis(axis) for name, axis in document["axes"].items()},
        failed=None if failed is None else Failed(**failed),
        duration_s=float(document["duration_s"]),
    )


def _axis(document: Mapping[str, Any]) -> SurveyedAxis:
    return SurveyedAxis(
        **{
            **document,
            "parameters": _values(document["parameters"]),
            "causes": tuple(_cause(cause) for cause in document["causes"]),
            "not_testable": tuple(document["not_testable"]),
            "warnings": {code: tuple(said) for code, said in document["warnings"].items()},
        }
    )


def _cause(document: Mapping[str, Any]) -> SurveyedCause:
    return SurveyedCause(
        **{
            **document,
            "parameters": _values(document["parameters"]),
            "alternatives": tuple(document["alternatives"]),
        }
    )


def _values(document: Mapping[str, Any]) -> dict[str, Value]:
    return {name: Value(**value) for name, value in document.items()}

"""Entry point: identify and diagnose every recording of a folder, and compare the units."""

import os
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

from edge_ident.fleet.analysis import Options, failure_of
from edge_ident.fleet.cluster import run_on_cluster
from edge_ident.fleet.comparison import compare_units
from edge_ident.fleet.folder import Found, Units, find_recordings
from edge_ident.fleet.kept import keep, key_of, load_kept, recording_of
from edge_ident.fleet.processes import run_processes
from edge_ident.fleet.result import Survey, SurveyedRecording
from edge_ident.fleet.tasks import Outcomes, Task
from edge_ident.model.given_model import GivenModel, given_model
from edge_ident.signals.read_options import ReadOptions
from edge_ident.support.given import check_type, path
from edge_ident.support.given import number as check_number
from edge_ident.support.hashing import file_sha256

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

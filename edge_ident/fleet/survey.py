"""Entry point: identify and diagnose every recording of a folder, and compare the units."""

import hashlib
import os
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, Final, Literal

from edge_ident.errors import DataError
from edge_ident.files.reading import ENDINGS
from edge_ident.fleet import between_units, result
from edge_ident.fleet.analysis import Options, failure_of
from edge_ident.fleet.workers import Outcomes, Task, run_on_cluster, run_processes
from edge_ident.model.model_files import GivenModel, given_model
from edge_ident.signals.read_columns import ReadOptions
from edge_ident.support import documents
from edge_ident.support.given import check_type, path
from edge_ident.support.given import number as check_number
from edge_ident.support.version import VERSION

Progress = Callable[[str, int, int], None]
Units = Literal["file", "folder"]
"""What makes a unit: a recording, or all recordings of one subfolder."""


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
    on_recording: Callable[[result.SurveyedRecording], None] = lambda recording: None,
) -> result.Survey:
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
    done = dict[result.Found, result.SurveyedRecording]()
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
    return result.Survey(rows, between_units.compare_units(rows), left_out)


def _options(
    options: ReadOptions | None, model: GivenModel | None, diagnose: bool
) -> Mapping[str, Any]:
    check_type(options, (ReadOptions, type(None)), "give ReadOptions(...)")
    known = None if model is None else given_model(model)
    return Options(options or ReadOptions(), known, diagnose).document()


def _task_or_result(
    file: result.Found, options: Mapping[str, Any], kept: Path | None
) -> Task | result.SurveyedRecording:
    """What is to be done, or what is known of a file: a kept result, or that nobody can read it."""
    try:
        sha256 = documents.file_sha256(file.path)
    except OSError as error:
        return result.SurveyedRecording(file.name, file.unit, "", {}, failure_of(error), 0.0)
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


# The recordings of a folder, and whose they are.

RESULT: Final = "survey.json"
"""What a folder of results has in it; its tables are no recordings."""
# Files that `edge-ident run` and `capture` write into the folder of a recording.
_BESIDE_CAPTURES: Final = ("log.txt",)


def find_recordings(
    folder: Path, units: Units, pattern: str | None, output: Path | None
) -> tuple[list[result.Found], tuple[str, ...]]:
    """Find the recordings of a folder and its subfolders, by name.

    Parameters
    ----------
    folder : Path
    units : {"file", "folder"}
    pattern : str or None
        Of the files to take, such as `*.csv`; None: by the endings that are known.
    output : Path or None
        Folder of results, which is left out, as every one with a `survey.json` is.

    Returns
    -------
    list of Found
    tuple of str
        Names of the files that were left out.

    Raises
    ------
    DataError
        There is no such folder, no recording in it, it lies in that of the results, or it holds
        more than `edge_ident.support.documents` allow.
    """
    if not folder.is_dir():
        raise DataError(f"{folder}: no such folder", "give the folder that holds the recordings")
    if output is not None and folder.resolve().is_relative_to(output.resolve()):
        raise DataError(
            f"{output}: the recordings are in the folder for the results",
            "choose another folder for the results with --output",
        )
    try:
        every = sorted(_files_below(folder))
    except documents.TooLargeError as error:
        raise DataError(f"{folder}: {error}", "give a folder that holds recordings") from error
    results = {path.parent for path in every if path.name == RESULT}
    skipped = {path.resolve() for path in results | ({output} if output else set())}
    files = [
        path
        for path in every
        if path.is_file()
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        and not skipped.intersection(path.resolve().parents)
    ]
    taken = [path for path in files if _taken(path, pattern)]
    if not taken:
        which = f"that is called {pattern}" if pattern else f"ending in {', '.join(ENDINGS)}"
        raise DataError(
            f"{folder}: there is no recording {which}",
            "give the folder that holds the recordings, or choose them with --files PATTERN",
        )
    names = _unit_names(folder, taken, units)
    found = [result.Found(path, path.relative_to(folder).as_posix(), names[path]) for path in taken]
    left = tuple(path.relative_to(folder).as_posix() for path in files if path not in names)
    return found, left


def _files_below(folder: Path) -> list[Path]:
    """All that is no folder; links to folders are not followed.

    Raises
    ------
    TooLargeError
        There are too many, or folders in folders go too deep.
    """
    found: list[Path] = []
    level = [folder]
    for _ in range(documents.DEEPEST):
        inner: list[Path] = []
        for one in level:
            with suppress(PermissionError), os.scandir(one) as entries:
                for entry in entries:
                    (inner if entry.is_dir(follow_symlinks=False) else found).append(
                        one / entry.name
                    )
        documents.check_size("files", len(found), documents.MOST_FILES)
        if not inner:
            return found
        level = inner
    raise documents.TooLargeError(
        f"it is nested too deeply: at most {documents.DEEPEST} levels are read"
    )


def _taken(path: Path, pattern: str | None) -> bool:
    if pattern:
        return path.match(pattern)
    return path.name.lower().endswith(ENDINGS) and path.name not in _BESIDE_CAPTURES


def _unit_names(folder: Path, files: list[Path], units: Units) -> dict[Path, str]:
    """Units by subfolder; by file, without the ending where that is not needed."""
    inside = {path: path.relative_to(folder) for path in files}
    if units == "folder":
        return {
            path: name.parent.as_posix() if len(name.parts) > 1 else _without_ending(name)
            for path, name in inside.items()
        }
    short = {path: _without_ending(name) for path, name in inside.items()}
    often = Counter(short.values())
    return {
        path: short[path] if often[short[path]] == 1 else inside[path].as_posix() for path in files
    }


def _without_ending(name: Path) -> str:
    plain = name.with_suffix("") if name.suffix.lower() == ".gz" else name
    return plain.with_suffix("").as_posix()


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
    return hashlib.sha256(documents.to_json(parts).encode()).hexdigest()


def load_kept(folder: Path, key: str) -> dict[str, Any] | None:
    """A result that was kept; None where there is none that can be read."""
    try:
        document = documents.read_json(folder / FOLDER / f"{key}.json")
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
    documents.write_json({"schema": SCHEMA, **document}, folder / FOLDER / f"{key}.json")


def recording_of(
    document: Mapping[str, Any], file: str, unit: str, sha256: str
) -> result.SurveyedRecording:
    """A result document as the result of a file.

    Raises
    ------
    KeyError, TypeError
        The document is not what `edge_ident.fleet.analysis.analyse` returns.
    """
    failed = document["failed"]
    return result.SurveyedRecording(
        file=file,
        unit=unit,
        sha256=sha256,
        axes={name: _axis(axis) for name, axis in document["axes"].items()},
        failed=None if failed is None else result.Failed(**failed),
        duration_s=float(document["duration_s"]),
    )


def _axis(document: Mapping[str, Any]) -> result.SurveyedAxis:
    return result.SurveyedAxis(
        **{
            **document,
            "parameters": _values(document["parameters"]),
            "causes": tuple(_cause(cause) for cause in document["causes"]),
            "not_testable": tuple(document["not_testable"]),
            "warnings": {code: tuple(said) for code, said in document["warnings"].items()},
        }
    )


def _cause(document: Mapping[str, Any]) -> result.SurveyedCause:
    return result.SurveyedCause(
        **{
            **document,
            "parameters": _values(document["parameters"]),
            "alternatives": tuple(document["alternatives"]),
        }
    )


def _values(document: Mapping[str, Any]) -> dict[str, result.Value]:
    return {name: result.Value(**value) for name, value in document.items()}

"""The recordings of a folder, and whose they are."""

import os
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from edge_ident.errors import DataError
from edge_ident.files.reading import ENDINGS
from edge_ident.support.documents import DEEPEST, MOST_FILES, TooLargeError, check_size

Units = Literal["file", "folder"]
"""What makes a unit: a recording, or all recordings of one subfolder."""
RESULT: Final = "survey.json"
"""What a folder of results has in it; its tables are no recordings."""
# Files that `edge-ident run` and `capture` write into the folder of a recording.
_BESIDE_CAPTURES: Final = ("log.txt",)


@dataclass(frozen=True)
class Found:
    """A file of the folder.

    Attributes
    ----------
    path : Path
    name : str
        Path inside the folder, with slashes.
    unit : str
    """

    path: Path
    name: str
    unit: str


def find_recordings(
    folder: Path, units: Units, pattern: str | None, output: Path | None
) -> tuple[list[Found], tuple[str, ...]]:
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
    except TooLargeError as error:
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
    found = [Found(path, path.relative_to(folder).as_posix(), names[path]) for path in taken]
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
    for _ in range(DEEPEST):
        inner: list[Path] = []
        for one in level:
            with suppress(PermissionError), os.scandir(one) as entries:
                for entry in entries:
                    (inner if entry.is_dir(follow_symlinks=False) else found).append(
                        one / entry.name
                    )
        check_size("files", len(found), MOST_FILES)
        if not inner:
            return found
        level = inner
    raise TooLargeError(f"it is nested too deeply: at most {DEEPEST} levels are read")


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

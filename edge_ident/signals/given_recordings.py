"""The recordings that a caller gives: recordings, paths or data frames, one or several."""

import os
from collections.abc import Iterable

from edge_ident.errors import DataError
from edge_ident.files.frames import is_frame
from edge_ident.signals.python_words import speaking_python
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import Source, load_recording
from edge_ident.support.given import type_of

Given = Recording | Source
"""A recording, or what `load_recording` makes one of."""

_WANTED = "give a Recording, the path of a file, or a data frame"


def given_recording(given: "Given | Iterable[Given]", job: str) -> Recording:
    """The one recording that is meant.

    Parameters
    ----------
    given : Recording, str, Path, data frame, or one of these in a sequence
    job : str
        What is to be done with it, for messages.

    Raises
    ------
    DataError
        As of `load_recording`; there is none, or there are several.
    """
    found = given_recordings(given)
    if len(found) != 1:
        raise DataError(
            f"{len(found)} recordings to {job}: it takes one at a time",
            f"call {job} for each of them; diagnose takes several of one machine together",
        )
    return found[0]


def given_recordings(given: "Given | Iterable[Given]") -> list[Recording]:
    """The recordings that are meant, in their order.

    Raises
    ------
    DataError
        As of `load_recording`; something is neither a recording nor what one is made of.
    """
    if isinstance(given, Recording | str | os.PathLike) or is_frame(given):
        return [_one(given)]
    if not isinstance(given, Iterable):
        raise DataError(f"{type_of(given)} is no recording", _WANTED)
    return [_one(each) for each in given]


def _one(given: object) -> Recording:
    if isinstance(given, Recording):
        return given
    if isinstance(given, str | os.PathLike):
        with speaking_python():
            return load_recording(os.fspath(given))
    if is_frame(given):
        return load_recording(given)  # type: ignore[arg-type]  # by what it can do
    raise DataError(f"{type_of(given)} is no recording", _WANTED)

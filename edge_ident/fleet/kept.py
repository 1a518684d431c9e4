"""Results that are kept, so that a second survey does only what is missing.

A result is known by a hash of all that it follows from: the content of the recording, the options,
and the version of edge-ident. What failed is not kept: it is tried again.
"""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from edge_ident.fleet.result import Failed, SurveyedAxis, SurveyedCause, SurveyedRecording, Value
from edge_ident.support.json_text import read_json, to_json, write_json
from edge_ident.support.version import VERSION

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

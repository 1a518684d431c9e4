"""What is to be done, and what came of it; the same for processes and for a cluster."""

from collections.abc import Generator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from edge_ident.fleet.folder import Found
from edge_ident.fleet.result import Failed


@dataclass(frozen=True)
class Task:
    """A recording to be analysed.

    Attributes
    ----------
    found : Found
    sha256, key : str
        Of its content; of all that its result follows from.
    options : mapping
        As JSON.
    """

    found: Found
    sha256: str
    key: str
    options: Mapping[str, Any]


Outcome = tuple[Task, dict[str, Any]]
"""A task, and the document of `edge_ident.fleet.analysis.analyse`."""
Outcomes = Generator[Outcome, None, None]
"""Outcomes as they come; closing it ends what works on the rest."""


def ended(why: str) -> dict[str, Any]:
    """The document of a task whose worker came to an end."""
    failed = Failed(
        "ended",
        f"the process that analysed it ended: {why}",
        "run the survey again; if it happens again, use fewer --jobs, or identify the file alone",
    )
    return {"axes": {}, "failed": asdict(failed), "duration_s": 0.0}

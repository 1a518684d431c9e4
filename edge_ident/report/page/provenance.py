"""Where a page comes from: recordings with hashes, version, command line."""

import os
import shlex
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from edge_ident.support.documents import file_sha256
from edge_ident.support.version import VERSION
from edge_ident.support.words import listed


@dataclass(frozen=True)
class Provenance:
    """What somebody needs to repeat a result.

    Attributes
    ----------
    files : tuple of (name, sha256)
        The recordings.
    command : str
        As it was typed, but for what was hidden in a virtual drive.
    version : str
        Of edge-ident.
    validation : (name, sha256) or None
        The recording that models were judged on.
    machine : str
        As its owner calls it; empty where that is not known.
    date : str
        Of the page; that of SOURCE_DATE_EPOCH where a page is to be the same again.
    """

    files: tuple[tuple[str, str], ...]
    command: str
    version: str
    validation: tuple[str, str] | None = None
    machine: str = ""
    date: str = ""

    @classmethod
    def of(
        cls, files: Iterable[Path], validation: Path | None = None, machine: str = ""
    ) -> "Provenance":
        """Provenance of what this process makes of some recordings."""
        typed = shlex.join([Path(sys.argv[0]).name, *_discreet(sys.argv[1:])])
        judged = _hashed(validation) if validation else None
        return cls(tuple(map(_hashed, files)), typed, VERSION, judged, machine, today())

    @property
    def heading(self) -> str:
        """Machine, date and recordings, in a line."""
        names = listed(name for name, _ in self.files)
        recordings = f"recording{'s' if len(self.files) > 1 else ''} {names}" if names else ""
        machine = f"machine {self.machine}" if self.machine else ""
        return " · ".join(part for part in (machine, self.date, recordings) if part)


def today() -> str:
    """The date, as 2026-01-31."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if epoch.isdigit():
        return datetime.fromtimestamp(int(epoch), UTC).date().isoformat()
    return datetime.now().astimezone().date().isoformat()


def _discreet(words: Sequence[str]) -> list[str]:
    """Words of a command line without what they hide in a virtual drive."""
    told, secret = [], False
    for word in words:
        option, given, _ = word.partition("=")
        hides = option in ("--hide", "--hide-seed", "--used", "--wear", "--friction")
        told.append("..." if secret else f"{option}=..." if hides and given else word)
        secret = hides and not given
    return told


def _hashed(file: Path) -> tuple[str, str]:
    return file.name, file_sha256(file)

"""Where a page comes from: recordings with hashes, version, command line."""

import shlex
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from edge_ident.support.hashing import file_sha256
from edge_ident.support.version import VERSION


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
    """

    files: tuple[tuple[str, str], ...]
    command: str
    version: str
    validation: tuple[str, str] | None = None

    @classmethod
    def of(cls, files: Iterable[Path], validation: Path | None = None) -> "Provenance":
        """Provenance of what this process makes of some recordings."""
        typed = shlex.join([Path(sys.argv[0]).name, *_discreet(sys.argv[1:])])
        judged = _hashed(validation) if validation else None
        return cls(tuple(map(_hashed, files)), typed, VERSION, judged)


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

"""Where a page comes from: recordings with hashes, version, command line."""

import shlex
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from edge_ident.support.hashing import file_sha256


@dataclass(frozen=True)
class Provenance:
    """What somebody needs to repeat a result.

    Attributes
    ----------
    files : tuple of (name, sha256)
        The recordings.
    command : str
        As it was typed.
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
        typed = shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])
        judged = _hashed(validation) if validation else None
        return cls(tuple(map(_hashed, files)), typed, version("edge-ident"), judged)


def _hashed(file: Path) -> tuple[str, str]:
    return file.name, file_sha256(file)

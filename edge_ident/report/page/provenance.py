"""Where a page comes from: recordings with hashes, version, command line."""

import hashlib
import shlex
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path


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
    """

    files: tuple[tuple[str, str], ...]
    command: str
    version: str

    @classmethod
    def of(cls, files: Iterable[Path]) -> "Provenance":
        """Provenance of what this process makes of some recordings."""
        hashed = tuple((file.name, hashlib.sha256(file.read_bytes()).hexdigest()) for file in files)
        typed = [Path(sys.argv[0]).name, *sys.argv[1:]]
        return cls(hashed, shlex.join(typed), version("edge-ident"))

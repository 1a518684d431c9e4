"""Packages that only some files need, and what they make of a file that is none of theirs."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from edge_ident.errors import DataError, EdgeIdentError
from edge_ident.support.limits import TooLargeError


def needed(package: str, extra: str, source: str) -> Any:
    """Load a package, or say which extra of edge-ident has it.

    Raises
    ------
    DataError
        It is not installed.
    """
    try:
        return import_module(package)
    except ImportError as error:
        raise DataError(
            f"{source}: reading it needs {package.partition('.')[0]}, which is not installed",
            f"pip install 'edge-ident[{extra}]' (or [files], for all formats)",
        ) from error


@contextmanager
def reading(source: str, kind: str) -> Iterator[None]:
    """Read a file with the reader of its format: whatever that raises, the file is none of it.

    Such readers have no common error: what is damaged shows as a wrong key, an index or a type.

    Raises
    ------
    DataError
        The reader refuses the file.
    TooLargeError, MemoryError
        As they come: the file may be as its format has it.
    """
    try:
        yield
    except (EdgeIdentError, TooLargeError, MemoryError):
        raise
    except Exception as error:
        raise unreadable(source, kind, error) from error


def unreadable(source: str, kind: str, error: Exception) -> DataError:
    """The error for a file that its own format's reader refuses."""
    said = (str(error).splitlines() or [type(error).__name__])[0]
    return DataError(
        f"{source}: not a readable {kind} file ({said})", "write it again, or use .csv"
    )

"""Packages that only some files need: loaded when such a file is read."""

from importlib import import_module
from typing import Any

from edge_ident.errors import DataError


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


def unreadable(source: str, kind: str, error: Exception) -> DataError:
    """The error for a file that its own format's reader refuses."""
    said = str(error).splitlines()[0] if str(error) else type(error).__name__
    return DataError(
        f"{source}: not a readable {kind} file ({said})", "write it again, or use .csv"
    )

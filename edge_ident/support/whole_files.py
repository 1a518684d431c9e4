"""Files that are there whole or not at all: written under another name, then renamed."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a name beside `path` to write to; what was written there gets the name `path`.

    Where the body fails, nothing is left and an older file stays. Folders are made as needed. The
    name keeps its suffix, from which some writers tell the format.

    Raises
    ------
    OSError
        The disk is full, or no writing there is allowed; names the file.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".partial-{path.name}")
    try:
        yield partial
        partial.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        partial.unlink(missing_ok=True)

"""Atomic writes: a file appears complete or not at all, because it is written and then renamed."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a name beside `path` to write to; the file written there is renamed to `path`.

    If the body fails, nothing is left and an older file stays. Missing folders are made. The name
    keeps its suffix, from which some writers tell the format, and is that of this process alone.

    Raises
    ------
    OSError
        The disk is full, or writing there is not allowed. The error names the file.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".partial-{os.getpid()}-{path.name}")
    try:
        yield partial
        partial.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        partial.unlink(missing_ok=True)

"""Atomic writes: a file appears complete or not at all, because it is written and then renamed."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def atomic_write(path: Path, *, lasting: bool = True) -> Iterator[Path]:
    """Yield a name beside `path` to write to; the file written there is renamed to `path`.

    If the body fails, nothing is left and an older file stays. Missing folders are made. The name
    keeps its suffix, from which some writers tell the format, and is that of this process alone.

    Parameters
    ----------
    path : Path
    lasting : bool
        Wait until the disk has the file, so that it is there whole after a power cut, too. That
        may take as long as a second. Without it the file may be lost or empty then.

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
        if lasting:
            _wait_for_disk(partial, os.O_RDWR)
        partial.replace(path)
        if lasting:
            with suppress(OSError):  # not every system opens a folder
                _wait_for_disk(path.parent, os.O_RDONLY)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        partial.unlink(missing_ok=True)


def _wait_for_disk(path: Path, how: int) -> None:
    number = os.open(path, how)
    try:
        os.fsync(number)
    finally:
        os.close(number)


# What stands where a file should be.


def no_file(path: Path) -> str:
    """Why a path is no file that can be read, with the path."""
    if path.is_dir():
        return f"{path}: it is a folder"
    return f"{path}: {'it is no file' if path.exists() else 'no such file'}"

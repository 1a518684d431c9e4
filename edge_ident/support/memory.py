"""Memory that a process gives back to the system while it runs, or keeps."""

import ctypes
import sys
from typing import Final

_TRIM_THRESHOLD: Final = -1
_MMAP_THRESHOLD: Final = -3
"""Numbers of these parameters of glibc's `mallopt`."""
_LARGE_BYTES: Final = 1 << 19
"""Size from which memory goes back as soon as it is free. Below, that takes longer than what is
computed there."""
_ALL_BYTES: Final = 1 << 30
"""More than any array of a diagnosis."""


def give_back() -> None:
    """Give free memory back to the system, and from now on what is large as soon as it is free.

    glibc alone can be told so; with other C libraries nothing happens.
    """
    if library := _glibc():
        library.mallopt(_MMAP_THRESHOLD, _LARGE_BYTES)
        library.malloc_trim(0)


def keep() -> None:
    """Keep free memory for what is computed next: for a process that computes, and ends.

    Large arrays come and go, and the system clears all memory that it gives. glibc alone can be
    told so; with other C libraries nothing happens.
    """
    if library := _glibc():
        library.mallopt(_MMAP_THRESHOLD, _ALL_BYTES)
        library.mallopt(_TRIM_THRESHOLD, _ALL_BYTES)


def _glibc() -> ctypes.CDLL | None:
    """The C library of the process, where it is glibc."""
    library = ctypes.CDLL(None) if sys.platform == "linux" else None
    return library if hasattr(library, "malloc_trim") else None

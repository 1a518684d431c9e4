"""Memory that a process gives back to the system while it runs."""

import ctypes
import sys
from typing import Final

_MMAP_THRESHOLD: Final = -3
"""Number of this parameter of glibc's `mallopt`."""
_LARGE_BYTES: Final = 1 << 19
"""Size from which memory goes back as soon as it is free. Below, that takes longer than what is
computed there."""


def give_back() -> None:
    """Give free memory back to the system, and from now on what is large as soon as it is free.

    glibc alone can be told so; with other C libraries nothing happens.
    """
    if sys.platform != "linux":
        return
    library = ctypes.CDLL(None)
    if hasattr(library, "malloc_trim"):
        library.mallopt(_MMAP_THRESHOLD, _LARGE_BYTES)
        library.malloc_trim(0)

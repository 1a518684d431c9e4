"""Memory that goes back to the system, or stays."""

import ctypes
import subprocess
import sys

import pytest

_FREED = """
import pathlib
from edge_ident.support.stopwatch import give_back

def resident():
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1])

blocks = [bytearray(100_000) for _ in range(400)]
last, before = blocks.pop(), resident()
del blocks
give_back()
print(resident() / before)
"""

_KEPT = """
import resource
from edge_ident.support.stopwatch import keep

def pages(times):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(times):
        bytearray(50_000_000)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

keep()
pages(1)
print(pages(10))
"""

needs_glibc = pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="needs glibc"
)


def printed(program: str) -> float:
    """What a program prints."""
    command = [sys.executable, "-c", program]
    ran = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    return float(ran.stdout)


@needs_glibc
def test_what_is_free_goes_back_though_what_lies_behind_it_is_used() -> None:
    assert printed(_FREED) < 0.5


@needs_glibc
def test_what_is_free_stays_for_what_comes_next() -> None:
    assert printed(_KEPT) < 100

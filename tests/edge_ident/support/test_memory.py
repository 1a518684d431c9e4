"""Memory that goes back to the system."""

import ctypes
import subprocess
import sys

import pytest

_FREED = """
import pathlib
from edge_ident.support.memory import give_back

def resident():
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1])

blocks = [bytearray(100_000) for _ in range(400)]
last, before = blocks.pop(), resident()
del blocks
give_back()
print(resident() / before)
"""


@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="needs glibc"
)
def test_what_is_free_goes_back_though_what_lies_behind_it_is_used() -> None:
    ran = subprocess.run(
        [sys.executable, "-c", _FREED], capture_output=True, text=True, check=True, timeout=60
    )
    assert float(ran.stdout) < 0.5

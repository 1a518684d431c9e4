"""The tool that times requests: every client gets its answers, and the figures are in order."""

import json
import subprocess
import sys
from pathlib import Path

TOOL = Path(__file__).parents[1] / "tools" / "link_overhead.py"


def test_three_clients_are_timed() -> None:
    done = subprocess.run(
        [sys.executable, TOOL, "--requests", "20", "--json"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    times = json.loads(done.stdout)["ms"]
    assert list(times) == ["edge-ident", "pymodbus", "line"]
    for quantiles in times.values():
        assert 0.0 < quantiles[0] <= quantiles[1] <= quantiles[2]

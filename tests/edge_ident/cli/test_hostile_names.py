"""Names from files, as a terminal gets them: on stdout, on stderr, and in JSON."""

import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.edge_ident.files.test_formats import POSITION_RAD, TIME_S, TORQUE_NM
from tests.edge_ident.support.test_words import ACTING, is_seen

NAME = "".join(ACTING[kind] for kind in ("a title of the window", "C1", "direction", "no width"))
COMMAND = [sys.executable, "-m", "edge_ident"]


def run(*arguments: object, code: int) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [*COMMAND, *map(str, arguments)],
        capture_output=True, encoding="utf-8", timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    for said in (done.stdout, done.stderr):
        assert is_seen(said), said
    return done


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / f"{NAME}.npz"
    columns = {"time [s]": TIME_S, "x.pos [rad]": POSITION_RAD, "x.torque [Nm]": TORQUE_NM}
    np.savez(path, **columns, **{f"{NAME} [V]": TORQUE_NM})
    return path


def test_the_columns_of_a_file_are_shown(recording: Path) -> None:
    done = run("import", recording, code=0)
    assert "\\u001b]0;owned\\u0007" in done.stdout
    document = json.loads(run("import", recording, "--json", code=0).stdout)
    assert document["columns"][-1]["heading"] == f"{NAME} [V]"


def test_errors_and_wrong_usage_quote_names(recording: Path, tmp_path: Path) -> None:
    forged = tmp_path / f"{NAME}\nerror: forged.csv"
    done = run("import", forged, code=5)
    assert done.stderr.count("error: ") == 2  # both on the line of the one
    assert len(done.stderr.splitlines()) == 2
    assert "\\u001b" in done.stderr
    assert "1b]0;owned" in run("import", recording, f"--{NAME}", code=2).stderr
    document = json.loads(run("import", forged, "--json", code=5).stdout)
    assert NAME in document["cause"]


def test_a_terminal_gets_them_the_same(recording: Path) -> None:
    """Nothing but its own styles acts, where colours are on."""
    reading, writing = pty.openpty()
    arguments = ["identify", "--no-diagnose", str(recording)]
    with subprocess.Popen([*COMMAND, *arguments], stdout=writing, stderr=writing) as process:
        os.close(writing)
        said = b""
        try:
            while part := os.read(reading, 1 << 16):
                said += part
        except OSError:  # as Linux ends a terminal
            pass
        process.wait(timeout=120)
    os.close(reading)
    text = said.decode()
    assert "axis" in text
    assert "\\u001b]0;owned\\u0007" in text
    for kind in ("\x1b]", "\x07", "\x9b", "\x9d", "\u202e", "\u200b"):
        assert kind not in text

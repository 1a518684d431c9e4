"""The command profile in processes as a user starts it, and how it leaves a board.

Cold repetitions have processes of their own, each of which commits gains and takes them back.
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from edge_ident.drive.description import drive_text
from firmware_interface.board import Board
from firmware_interface.connection import open_link
from firmware_interface.gains import CONSERVATIVE_GAINS
from tests.boards import served_board
from tests.processes import running
from tests.short_runs import brief_drive

PROFILE = [sys.executable, "-m", "edge_ident", "profile"]
INTERRUPTED = 130
START_UP, STAGED = CONSERVATIVE_GAINS.proportional, 35.0


@contextmanager
def opened(device: str) -> Iterator[Board]:
    board = Board.connect(open_link(device))
    try:
        yield board
    finally:
        board.close()


def stage(device: str) -> None:
    gains = replace(CONSERVATIVE_GAINS, proportional=STAGED)
    with opened(device) as board:
        board.stage_gains(dict.fromkeys(("x", "z"), gains))


def proportionals(device: str) -> tuple[float, float]:
    """Of the gains in force and of those staged."""
    with opened(device) as board:
        assert not board.status().unconfirmed
        assert not board.status().enabled
        assert board.status().staged_crc_ok
        return board.active_gains()["x"].proportional, board.staged_gains()["x"].proportional


def test_profile_times_every_stage_and_leaves_the_gains_as_they_were() -> None:
    with served_board() as device:
        stage(device)
        done = subprocess.run(
            [*PROFILE, "--device", device, "--repetitions", "1", "--json"],
            capture_output=True, text=True, timeout=120, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert proportionals(device) == (START_UP, STAGED)
    runs = json.loads(done.stdout)["runs"]
    measured = {(run["start"], run["precision"]) for run in runs}
    assert measured == {(s, p) for s in ("warm", "cold") for p in ("fp32", "int8")}
    for run in runs:
        middle = {stage: times["p50"] for stage, times in run["stages_ms"].items()}
        assert {"signals", "network", "estimate", "gains", "commit", "verify"} <= set(middle)
        assert min(middle.values()) > 0.0
        assert middle["total"] > middle["signals"] + middle["network"] + middle["estimate"]


def test_ctrl_c_in_a_cold_repetition_leaves_the_gains_as_they_were(tmp_path: Path) -> None:
    """The process of that repetition has time to put them back."""
    drive = tmp_path / "brief.toml"
    drive.write_text(drive_text(brief_drive(), {}), encoding="utf-8")
    command = [*PROFILE, "--drive", str(drive), "--repetitions", "50", "--verbose", "--device"]
    with served_board(where="tcp_port=0") as device:
        stage(device)
        with running([*command, device], own_session=True) as process:
            assert process.stderr is not None
            warm = next(line for line in process.stderr if line.startswith("warm, int8: "))
            assert warm  # the cold ones follow
            with opened(device) as another:
                while process.poll() is None and not another.status().unconfirmed:
                    pass
            os.killpg(process.pid, signal.SIGINT)  # as a terminal does
            _, errors = process.communicate(timeout=60)
        assert process.returncode == INTERRUPTED, errors
        assert "Traceback" not in errors
        assert proportionals(device) == (START_UP, STAGED)

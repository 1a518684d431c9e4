"""The work of `latency` from the start of a process on: each repetition in one of its own."""

import json
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from edge_ident.commissioning import gain_transfer, run, safety
from edge_ident.errors import BoardError, EdgeIdentError
from edge_ident.estimation.manifest import Variant, variant_named
from edge_ident.estimation.network import Network, load_network
from edge_ident.identification.identify import identify
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording
from edge_ident.support.process import deaf_to_interrupts, end_as_by_ctrl_c, uncut
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board import Board
from firmware_interface.connection import open_link

_MODULE: Final = "edge_ident.commissioning.cold_latency"
_END_S: Final = 20.0  # longest time that a process takes to leave the board as it was


@uncut
def cold_ms(url: str, baud_rate: int, file: Path, precision: Variant) -> dict[str, float]:
    """Time of each stage in a new process, ms.

    Raises
    ------
    BoardError
        What ended the process.
    """
    arguments = [url, str(baud_rate), str(file), precision, repr(time.time())]
    command = [sys.executable, "-m", _MODULE, *arguments]
    with subprocess.Popen(  # out of reach of the terminal's Ctrl-C, which this process passes on
        command, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        try:
            told = _told(process.communicate()[0])
        except BaseException as reason:
            with deaf_to_interrupts():
                _note(reason, _told(_last_words(process)))
            raise
    if "cause" in told:
        error = BoardError(told["cause"], told["next_step"])
        _note(error, told)
        raise error
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return told


def _told(documents: str) -> dict[str, Any]:
    """The last that a process said; nothing where it was killed."""
    found: dict[str, Any] = json.loads((documents.splitlines() or ["{}"])[-1])
    return found


def _note(error: BaseException, told: Mapping[str, Any]) -> None:
    for note in told.get("notes", ()):
        error.add_note(note)


def _last_words(process: subprocess.Popen[str]) -> str:
    """What a process says that is told to end, and has time to leave the board as it was."""
    process.terminate()
    try:
        return process.communicate(timeout=_END_S)[0]
    except subprocess.TimeoutExpired:
        process.kill()
        return process.communicate()[0]


def _measure(url: str, baud_rate: str, file: str, precision: str, started_s: str) -> None:
    """One repetition, in the process that exists for it; prints its times as JSON."""
    recording = load_recording(Path(file))
    network = load_network(variant_named(precision))
    start_ms = 1e3 * (time.time() - float(started_s))
    watch = Stopwatch()
    with closing(Board.connect(open_link(url, baud_rate=int(baud_rate)))) as board:
        connect_ms = watch.timing_ms()["total"]
        with gain_transfer.staged_kept(board), safety.left_safe(board):
            times = after_motion_ms(board, recording, network)
    times["start"], times["connect"] = start_ms, connect_ms
    times["total"] += start_ms + connect_ms
    print(json.dumps(times))


def _ended(reason: BaseException) -> dict[str, Any]:
    error = reason
    if not isinstance(error, EdgeIdentError):
        error = BoardError("the process that measures was interrupted", "start it again")
    notes = list(getattr(reason, "__notes__", ()))
    return {"cause": error.cause, "next_step": error.next_step, "notes": notes}


if __name__ == "__main__":
    end_as_by_ctrl_c()
    try:
        _measure(*sys.argv[1:])
    except (EdgeIdentError, KeyboardInterrupt) as reason:
        print(json.dumps(_ended(reason)))


# The work that follows a motion, up to gains committed and verified, by stage.

STAGES: Final = (
    "start",
    "connect",
    "page_tail",
    "signals",
    "adequacy",
    "align",
    "image",
    "network",
    "estimate",
    "gains",
    "stage",
    "commit",
    "verify",
    "total",
)
"""Stages in order; `start` (interpreter, imports, network) and `connect` are cold only."""


def after_motion_ms(board: Board, recording: Recording, network: Network) -> dict[str, float]:
    """Time of each stage, with the board's own gains in place of new ones, ms.

    The shadow bank is left with the gains in force.
    """
    active = board.active_gains()
    watch = Stopwatch()
    with watch.stage("page_tail"):
        board.read_last_page()
    found = identify(recording, network, diagnose=False, stopwatch=watch)
    with watch.stage("gains"):
        run.board_designs(board, found)
    with watch.stage("stage"):
        board.stage_gains(active)
    with watch.stage("commit"):
        board.commit()
    with watch.stage("verify"):
        gain_transfer.compare_gains(active, board.active_gains())
    times = watch.timing_ms()
    board.roll_back()
    return {stage: times[stage] for stage in STAGES if stage in times}

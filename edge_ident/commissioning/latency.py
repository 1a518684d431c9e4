"""How long it takes from the last captured sample to gains committed and verified.

One motion of the drive is captured; then the work that follows it is repeated: the last page is
read again (reads change nothing), the recording is identified, gains are designed, and the board's
own active gains are staged, read back, committed and read again, then rolled back, so that the
machine never runs other gains than before. What was staged before is staged again. Warm: in one
process. Cold: a new process each time, from its start on. The stop that follows the last sample
needs a motion: it is measured once. So does the whole way from there to gains, with that stop and
without: `ways`.
"""

import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, Literal

import numpy as np

from edge_ident.commissioning.capture import Observer, capture_motion, check_drive, check_recordable
from edge_ident.commissioning.gain_transfer import compare_gains, staged_kept, write_gains
from edge_ident.commissioning.ports import noted
from edge_ident.commissioning.run import board_designs
from edge_ident.commissioning.safety import left_safe, ready_to_move
from edge_ident.drive.description import Drive
from edge_ident.errors import BoardError, EdgeIdentError
from edge_ident.estimation.manifest import VARIANTS, Graph, Variant, variant_named
from edge_ident.estimation.network import Network, load_network
from edge_ident.identification.identify import identify
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording, save_recording
from edge_ident.support.process import deaf_to_interrupts, end_as_by_ctrl_c, uncut
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board import Board
from firmware_interface.connection import DEFAULT_BAUD_RATE, open_link
from firmware_interface.motion import Trajectory

# What a latency profile says: percentiles of every stage, and whether the target is met.

TARGET_MS: Final = 1000.0
"""Target for the time from the last captured sample to gains committed and read back."""


@dataclass(frozen=True)
class Spread:
    """Percentiles of a stage's time, ms."""

    p50: float
    p95: float
    p99: float
    maximum: float


@dataclass(frozen=True)
class ProfileRun:
    """All repetitions of one start and precision: times by stage, ms.

    Attributes
    ----------
    graph : {"rank_one", "image"}
        That this machine runs faster.
    """

    start: Literal["warm", "cold"]
    precision: Variant
    graph: Graph
    stages_ms: Mapping[str, list[float]]


@dataclass(frozen=True)
class Profile:
    """All that was measured on one machine with one board.

    Attributes
    ----------
    tail_ms : float
        Board time from the last captured sample to the last page in hand.
    stop_ms : float
        From the last page in hand to the machine at rest, for which gains have to wait unless the
        board takes them while its control law acts.
    ways_ms : mapping of way to list of float
        From the last captured sample to gains read back, after motions of their own: committed
        `at_rest` and, where the board can, while it is `running`.
    """

    device: str
    machine: str
    repetitions: int
    tail_ms: float
    stop_ms: float
    runs: tuple[ProfileRun, ...]
    ways_ms: Mapping[str, list[float]] = field(default_factory=dict)

    @property
    def awaited_stop_ms(self) -> float:
        """The stop, where gains have to wait for it."""
        return 0.0 if "running" in self.ways_ms else self.stop_ms

    @property
    def ways(self) -> str:
        """One sentence about the ways."""
        if "running" not in self.ways_ms:
            return "this board takes gains at rest only"
        stop, running = (spread(self.ways_ms[way]).p50 for way in ("at_rest", "running"))
        return (
            f"last sample to gains read back: {stop:.0f} ms with the stop, {running:.0f} ms "
            f"without (p50 of {len(self.ways_ms['running'])}), {stop / running:.2f} times as fast"
        )

    @property
    def network_medians_ms(self) -> dict[Variant, float]:
        """Median time of the warm network, by precision; none where no network fits the drive."""
        warm = [run for run in self.runs if run.start == "warm" and "network" in run.stages_ms]
        return {run.precision: spread(run.stages_ms["network"]).p50 for run in warm}

    @property
    def faster_precision(self) -> Variant | None:
        """The network to prefer on this machine; None where none fits the drive."""
        medians = self.network_medians_ms
        return min(medians, key=lambda precision: medians[precision], default=None)

    def within_target(self, run: ProfileRun) -> bool:
        """Whether tail and awaited stop, then 99 of 100 repetitions, take less than the target."""
        return self.tail_ms + self.awaited_stop_ms + spread(run.stages_ms["total"]).p99 < TARGET_MS

    @property
    def verdict(self) -> str:
        """One sentence against the target."""
        warm = [run for run in self.runs if run.start == "warm"]
        worst = max(spread(run.stages_ms["total"]).p99 for run in warm)
        medians = self.network_medians_ms.values()
        met = all(self.within_target(run) for run in warm)
        networks = (
            f"{self.faster_precision} is the faster network here, "
            f"by {1.0 - min(medians) / max(medians):.0%}"
            if medians
            else "no network fits this drive"
        )
        return (
            f"sub-second target {'met' if met else 'missed'}: 99 % of warm repetitions take "
            f"at most {worst:.0f} ms, the tail of the capture before them {self.tail_ms:.0f} ms "
            f"and the stop that they wait for {self.awaited_stop_ms:.0f} ms; {networks}"
        )


def spread(times_ms: list[float]) -> Spread:
    """Percentiles of measured times; nothing is left out."""
    p50, p95, p99 = np.percentile(times_ms, [50, 95, 99])
    return Spread(float(p50), float(p95), float(p99), float(np.max(times_ms)))


MOST_MOTIONS: Final = 5
"""Most motions of each way from the last sample to gains: a motion takes seconds."""


def profile_device(
    device: str | None, baud_rate: int | None, drive: Drive, repetitions: int, observer: Observer
) -> Profile:
    """Profile a board, whose axes move, or a virtual one in a process of its own.

    Parameters
    ----------
    device : str or None
        None starts `edge-ident board --pty`.
    baud_rate : int or None
    drive : Drive
        Behind the board, with the motion.
    repetitions : int
        Of each of warm and cold, fp32 and int8; of each way from the last sample to gains, at most
        `MOST_MOTIONS`.
    observer : Observer

    Raises
    ------
    LinkError, BoardError
        A motion or a write did not get to its end.
    DataError
        Board and drive description differ, or the disk has no room for the recording.
    """
    with _board_process(device) as url, noted(url), TemporaryDirectory() as folder:
        file = Path(folder) / "capture.npz"
        with _connected(url, baud_rate) as board:
            tail_ms, stop_ms = _record(board, drive, file, observer)
            recording = load_recording(file)
            networks = [load_network(precision) for precision in VARIANTS]
            motions = min(repetitions, MOST_MOTIONS)
            if motions < repetitions:
                observer.say(
                    f"from the last sample to gains: {motions} repetitions of each way, not "
                    f"{repetitions}, because each needs a motion"
                )
            ways_ms = measured_ways(board, drive, recording, networks[0], motions, observer)
            runs = [_warm(board, recording, of, repetitions, observer) for of in networks]
        runs += [_cold(url, baud_rate, file, of, repetitions, observer) for of in networks]
    return Profile(
        device or "virtual board on a pseudo-terminal",
        _machine(),
        repetitions,
        tail_ms,
        stop_ms,
        tuple(runs),
        ways_ms,
    )


def _record(board: Board, drive: Drive, file: Path, observer: Observer) -> tuple[float, float]:
    """Capture the motion to work on; returns the times of tail and stop, ms."""
    check_drive(board, drive)
    trajectory = drive.trajectory()
    check_recordable(board, trajectory, file)
    with ready_to_move(board, observer.say):
        observer.stage("motion")
        # what a motion that fails leaves would go with the folder of this file
        capture = capture_motion(board, trajectory, observer.samples, say=observer.say)
        start_s = time.perf_counter()
        board.finish()
        stop_ms = 1e3 * (time.perf_counter() - start_s)
    save_recording(capture.recording, file)
    return 1e3 * capture.tail_s, stop_ms


def _warm(
    board: Board, recording: Recording, network: Network, repetitions: int, observer: Observer
) -> ProfileRun:
    observer.stage(f"warm, {network.variant}")
    with staged_kept(board), left_safe(board):
        times = _repeat(lambda: after_motion_ms(board, recording, network), repetitions, observer)
    return ProfileRun("warm", network.variant, network.graph, times)


def _cold(
    url: str,
    baud_rate: int | None,
    file: Path,
    network: Network,
    repetitions: int,
    observer: Observer,
) -> ProfileRun:
    observer.stage(f"cold, {network.variant}")
    baud_rate = baud_rate or DEFAULT_BAUD_RATE
    times = _repeat(lambda: cold_ms(url, baud_rate, file, network.variant), repetitions, observer)
    return ProfileRun("cold", network.variant, network.graph, times)


def _repeat(
    repeat: Callable[[], dict[str, float]], repetitions: int, observer: Observer
) -> dict[str, list[float]]:
    times: dict[str, list[float]] = {}
    observer.samples(0, repetitions)
    for done in range(repetitions):
        for stage, spent_ms in repeat().items():
            times.setdefault(stage, []).append(spent_ms)
        observer.samples(done + 1, repetitions)
    return {stage: times[stage] for stage in STAGES if stage in times}


@contextmanager
def board_at(device: str | None, baud_rate: int | None) -> Iterator[Board]:
    """A board, or a virtual one in a process of its own, for as long as the body."""
    with _board_process(device) as url, noted(url), _connected(url, baud_rate) as board:
        yield board


@contextmanager
def _connected(url: str, baud_rate: int | None) -> Iterator[Board]:
    link = open_link(url, baud_rate=baud_rate or DEFAULT_BAUD_RATE)
    try:
        board = Board.connect(link)
        yield board
        board.release()
    finally:
        link.close()


@contextmanager
def _board_process(device: str | None) -> Iterator[str]:
    """URL of the given board, or of a virtual one that lives as long as the body."""
    if device not in (None, "virtual"):
        yield str(device)
        return
    process = subprocess.Popen(  # out of reach of Ctrl-C: it has to hear how the motion ends
        [sys.executable, "-m", "edge_ident", "board", "--pty"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    with process:
        try:
            assert process.stdout is not None
            url = process.stdout.readline().strip()
            if not url:
                raise BoardError("no virtual board started", "try edge-ident board --pty")
            yield url
        finally:
            process.terminate()
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()


def _machine() -> str:
    return f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"


# How long gains take from the last captured sample: with a stop before the commit, and without.

_MOTION_S: Final = 1.0  # the motion counts for its end alone


def measured_ways(
    board: Board,
    drive: Drive,
    recording: Recording,
    network: Network,
    repetitions: int,
    observer: Observer,
) -> dict[str, list[float]]:
    """Times from the last sample to gains read back, ms: `at_rest` and, where it can, `running`.

    Each is the end of a short motion, the identification of a recording, the design of gains, and
    the write of those in force, which are then taken back. What was staged before is staged again.
    The ways take turns, so that both have the same load beside them.

    Parameters
    ----------
    board : Board
    drive : Drive
        Behind the board, with the motion.
    recording : Recording
    network : Network
    repetitions : int
        Of each way.
    observer : Observer

    Raises
    ------
    LinkError, BoardError
        A motion or a write did not get to its end.
    DataError
        Board and drive description differ.
    """
    check_drive(board, drive)
    ways = ("at_rest", "running") if board.takes_gains_running() else ("at_rest",)
    found: dict[str, list[float]] = {way: [] for way in ways}
    motion = replace(drive.trajectory(), duration_s=_MOTION_S)
    turns = repetitions * ways
    observer.stage("from the last sample to gains")
    observer.samples(0, len(turns))
    with staged_kept(board), ready_to_move(board, observer.say):
        for done, way in enumerate(turns, 1):
            spent = _way_ms(board, motion, recording, network, observer, stop=way == "at_rest")
            found[way].append(spent)
            observer.samples(done, len(turns))
    return found


def _way_ms(
    board: Board,
    motion: Trajectory,
    recording: Recording,
    network: Network,
    observer: Observer,
    *,
    stop: bool,
) -> float:
    active = board.active_gains()
    capture = capture_motion(board, motion, lambda *_: None, say=observer.say)
    began_s = time.perf_counter()
    if stop:
        board.finish()
    else:
        board.leave_to_rest()
    board_designs(board, identify(recording, network, diagnose=False))
    write_gains(board, active, observer.say)
    spent_s = time.perf_counter() - began_s
    board.settle()
    board.roll_back()
    return 1e3 * (capture.tail_s + spent_s)


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
        board_designs(board, found)
    with watch.stage("stage"):
        board.stage_gains(active)
    with watch.stage("commit"):
        board.commit()
    with watch.stage("verify"):
        compare_gains(active, board.active_gains())
    times = watch.timing_ms()
    board.roll_back()
    return {stage: times[stage] for stage in STAGES if stage in times}


# The same from the start of a process on: each repetition in one of its own.

_MODULE: Final = "edge_ident.commissioning.latency"
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
        with staged_kept(board), left_safe(board):
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

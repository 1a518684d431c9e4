"""The machine is stopped although another command holds its serial port."""

import fcntl
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Thread
from typing import Final

import numpy as np
import pytest

from edge_ident import connect
from edge_ident.commissioning import ports, safety
from edge_ident.commissioning.ports import Holder, holders_of, noted
from edge_ident.commissioning.safety import stop_machine
from edge_ident.errors import BoardError, LinkError
from firmware_interface.board import Board
from firmware_interface.connection import open_link
from firmware_interface.errors import StoppedError
from firmware_interface.registers import State
from tests import processes
from tests.boards import served_board

ROOT = str(Path(__file__).parents[3])
COMMAND = [sys.executable, "-m", "edge_ident"]


@pytest.fixture(autouse=True)
def folder_of_notes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Notes of this test alone; processes that it starts inherit it."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "notes"))
    of_user = tmp_path / "notes" / f"edge-ident-{os.getuid()}"
    monkeypatch.setattr(ports, "_folders", lambda: [of_user])
    return tmp_path / "notes"


@contextmanager
def running(device: str, folder: Path, *command: str) -> Iterator[subprocess.Popen[str]]:
    """A command on a board, once the machine moves and samples are coming."""
    process = subprocess.Popen(
        [*COMMAND, *command, "--device", device, "--output", str(folder)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        log, deadline = folder / "log.txt", time.monotonic() + 60
        while not log.is_file() or "motion started" not in log.read_text():
            assert process.poll() is None, process.communicate()[1]
            assert time.monotonic() < deadline
            time.sleep(0.02)
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.mark.real_time
@pytest.mark.parametrize("command", ["run", "capture"])
def test_stop_reaches_the_command_that_holds_the_port(command: str, tmp_path: Path) -> None:
    with (
        served_board(speed=5.0) as device,
        running(device, tmp_path / "out", command) as process,
    ):
        stopped = subprocess.run(
            [*COMMAND, "stop", "--device", device, "--json"],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert stopped.returncode == 0, stopped.stderr
        assert json.loads(stopped.stdout)["state"] == "IDLE"
        assert f"process {process.pid} (edge-ident {command}) has" in stopped.stderr
        assert process.wait(timeout=20) == 130
        for path in (tmp_path / "out").glob("*.npz"):
            # stopped soon after its start it may be too short for `load_recording`
            assert len(np.load(path)["time_s"]) > 0
        assert not holders_of(device)


def test_stop_switches_off_the_effort_that_a_vanished_host_left_on() -> None:
    with served_board(speed=5.0) as device:
        link = open_link(device)
        board = Board.connect(link)
        board.enable()
        link.close()  # nobody lets go of the board: its lease runs out
        assert not stop_machine(device, 115200, lambda text: None).enabled


OLDER: Final = """
from firmware_interface.virtual.register_file import Session
Session.stopped_by = lambda self, key: None
"""
"""A firmware that leaves a host its hold where another one stops the machine."""


@contextmanager
def living_host(device: str, *, enabled: bool) -> Iterator[None]:
    """A host in another thread that goes on with its heartbeats."""
    board, ended = Board.connect(open_link(device)), Event()
    if enabled:
        board.enable()
    else:
        board.claim()

    def beat() -> None:
        while not ended.wait(0.2):
            with suppress(StoppedError):
                board.heartbeat()

    thread = Thread(target=beat)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        board.close()


@pytest.mark.parametrize("enabled", [True, False])
def test_a_living_host_loses_the_board(enabled: bool) -> None:
    with served_board("tcp_port=0") as device, living_host(device, enabled=enabled):
        status = stop_machine(device, 115200, lambda text: None)
        assert (status.state, status.enabled) == (State.IDLE, False)
        assert status.session_remaining_s == 0.0


@pytest.mark.parametrize(
    ("enabled", "said"), [(True, "the effort stays on: another"), (False, "another host keeps")]
)
def test_a_living_host_that_keeps_an_older_board_is_an_error(
    enabled: bool, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(safety, "_OTHER_HOST_S", 0.3)
    with (
        served_board("tcp_port=0", before=OLDER) as device,
        living_host(device, enabled=enabled),
        pytest.raises(BoardError, match=said) as caught,
    ):
        stop_machine(device, 115200, lambda text: None)
    assert "edge-ident stop" in caught.value.next_step


def test_a_host_of_an_older_board_that_says_nothing_more_loses_it() -> None:
    with served_board("tcp_port=0", speed=5.0, before=OLDER) as device:
        link = open_link(device)
        Board.connect(link).claim()
        assert stop_machine(device, 115200, lambda text: None).session_remaining_s == 0.0
        link.close()


HOLDING: Final = """
import signal, sys, time
import edge_ident
from edge_ident.support.process import end_as_by_ctrl_c
end_as_by_ctrl_c()
if sys.argv[2] == "does not end":
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
try:
    with edge_ident.connect(sys.argv[1]) as board:
        if sys.argv[2] == "enabled":
            board.enable()
        elif sys.argv[2] == "holds":
            board.claim()
        print("ready", flush=True)
        time.sleep(120.0)  # it computes, and asks the board for nothing
except KeyboardInterrupt:
    sys.exit(130)
"""


@contextmanager
def holding(device: str, how: str) -> Iterator[subprocess.Popen[str]]:
    """A host that has a board open and asks it for nothing."""
    with processes.running([sys.executable, "-c", HOLDING, device, how]) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield process


@pytest.mark.parametrize("how", ["holds", "has not begun"])
def test_stop_over_tcp_ends_the_process_that_is_about_to_move(how: str, tmp_path: Path) -> None:
    """From any folder, by any name of the address, and wherever it left its note."""
    with served_board("tcp_port=0") as device, holding(device, how) as process:
        stopped = subprocess.run(
            [*COMMAND, "stop", "--device", device.replace("127.0.0.1", "localhost")],
            env=os.environ | {"XDG_RUNTIME_DIR": str(tmp_path / "another"), "PYTHONPATH": ROOT},
            capture_output=True, text=True, timeout=60, check=False, cwd=tmp_path,
        )  # fmt: skip
        assert (stopped.returncode, stopped.stdout) == (0, "IDLE\n"), stopped.stderr
        assert f"process {process.pid} (-c) has {device} open" in stopped.stderr
        assert process.wait(timeout=20) == 130


def test_a_port_in_use_is_said_with_the_process_that_has_it() -> None:
    with served_board() as device, holding(device, "holds") as process:
        with pytest.raises(LinkError) as caught, connect(device):
            pass
        assert f"process {process.pid} (-c) has it open" in caught.value.next_step
        assert "edge-ident stop" in caught.value.next_step


def test_a_holder_that_does_not_end_is_said_with_the_wired_stop_as_next_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(safety, "_END_S", 0.3)
    with served_board() as device, holding(device, "does not end") as process:
        with pytest.raises(LinkError, match=f"process {process.pid}, .* does not end") as caught:
            stop_machine(device, 115200, lambda message: None)
        assert "wired emergency stop" in caught.value.next_step
        assert f"kill -9 {process.pid}; then switch the effort off: edge-ident stop again" in (
            caught.value.next_step
        )
        process.kill()


@pytest.mark.parametrize("where", ["pty=True", "tcp_port=0"])
def test_stop_ends_a_command_that_is_suspended(where: str) -> None:
    """As by Ctrl-Z while it computes: no watchdog runs then, and the effort is on."""
    with served_board(where) as device, holding(device, "enabled") as process:
        process.send_signal(signal.SIGSTOP)
        assert not stop_machine(device, 115200, lambda message: None).enabled
        assert process.wait(timeout=20) == 130


@contextmanager
def stop_that_waits(device: str, holder: subprocess.Popen[str]) -> Iterator[subprocess.Popen[str]]:
    """`edge-ident stop` while the process that has the board is frozen."""
    holder.send_signal(signal.SIGSTOP)
    with processes.running([*COMMAND, "stop", "--device", device]) as stopping:
        assert stopping.stderr is not None
        assert "asking it to stop the machine" in stopping.stderr.readline()
        yield stopping


@pytest.mark.real_time
def test_stop_that_is_interrupted_says_that_the_machine_may_be_moving(tmp_path: Path) -> None:
    with (
        served_board(speed=5.0) as device,
        running(device, tmp_path / "out", "capture") as process,
        stop_that_waits(device, process) as stop,
    ):
        stop.send_signal(signal.SIGTERM)
        _, errors = stop.communicate(timeout=20)
        assert stop.returncode == 130
        assert "the machine may still be moving" in errors
        assert "run edge-ident stop again" in errors


@pytest.mark.real_time
def test_stop_goes_on_where_its_terminal_is_closed(tmp_path: Path) -> None:
    with (
        served_board(speed=5.0) as device,
        running(device, tmp_path / "out", "capture") as process,
        stop_that_waits(device, process) as stop,
    ):
        stop.send_signal(signal.SIGHUP)
        process.send_signal(signal.SIGCONT)
        _, errors = stop.communicate(timeout=60)
        assert stop.returncode == 0, errors


def test_a_port_that_something_else_holds_is_said_so() -> None:
    with served_board() as device:
        line = os.open(device, os.O_RDWR | os.O_NOCTTY)
        fcntl.flock(line, fcntl.LOCK_EX)
        with pytest.raises(LinkError, match="cannot be opened") as caught:
            stop_machine(device, 115200, lambda message: None)
        os.close(line)
        assert "wired emergency stop" in caught.value.next_step
        assert stop_machine(device, 115200, lambda message: None).state is State.IDLE


def test_after_a_stop_the_next_host_need_not_wait() -> None:
    with served_board() as device:
        board = Board.connect(open_link(device))
        board.enable()
        board.close()
        stop_machine(device, 115200, lambda message: None)
        board = Board.connect(open_link(device))
        assert board.status().session_remaining_s == 0.0
        board.close()


def test_a_note_is_there_as_long_as_the_device_is_held_by_whatever_name(
    tmp_path: Path,
) -> None:
    device, link = tmp_path / "ttyX", tmp_path / "by-id"
    device.touch()
    link.symlink_to(device)
    assert not holders_of(str(device))
    with noted(str(link)):
        (holder,) = holders_of(str(device))
        assert (holder.pid, holder.device) == (os.getpid(), str(link))
    assert not holders_of(str(device))


def test_a_device_that_gets_another_number_is_found_by_its_link_and_by_that_number(
    tmp_path: Path,
) -> None:
    """As an adapter that is plugged in again while its command goes on."""
    link, other = tmp_path / "by-id", str(tmp_path / "ttyX1")
    link.symlink_to(tmp_path / "ttyX0")
    with noted(str(link)):
        link.unlink()
        link.symlink_to(other)
        for name in (str(link), other, str(tmp_path / "ttyX0")):
            assert [holder.pid for holder in holders_of(name)] == [os.getpid()]
        assert not holders_of(str(tmp_path / "ttyX2"))


def test_a_process_that_has_the_number_of_a_dead_one_is_left_alone(
    folder_of_notes: Path, tmp_path: Path
) -> None:
    with noted(str(tmp_path / "ttyX")):
        (note,) = folder_of_notes.glob("*/*.json")
        values = json.loads(note.read_text())
        assert Holder(**values).alive
        note.write_text(json.dumps(values | {"started": "1"}))
        assert not holders_of(str(tmp_path / "ttyX"))


@pytest.mark.parametrize("text", ["", "{", "[]", '{"pid": "x", "started": 1, "device": 2}'])
def test_a_damaged_note_is_none(folder_of_notes: Path, tmp_path: Path, text: str) -> None:
    with noted(str(tmp_path / "ttyX")):
        (note,) = folder_of_notes.glob("*/*.json")
        note.write_text(text)
        assert not holders_of(str(tmp_path / "ttyX"))

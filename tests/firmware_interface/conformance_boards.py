"""Boards of all kinds, each in a process of its own on a pseudo-terminal, and raw frames to them.

The Python virtual board and the C reference firmware were written apart from each other; what
the register map and its words mean is what both of them do. The firmware runs on a plant, and on
a simulated FPGA with a plant behind it.
"""

import itertools
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import pytest

from firmware_interface import registers
from firmware_interface.board import Board, BoardStatus
from firmware_interface.codec import encode
from firmware_interface.connection import open_link
from firmware_interface.errors import BoardError
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import REGISTERS, Fault, Result, State

SPEED = 20.0
FPGA_SPEED = 5.0
"""A simulated FPGA takes a core for itself where it is 20 times as fast as time, also at rest."""
SOURCE = Path(registers.__file__).with_name("reference_firmware")
FPGA_SOURCE = SOURCE.with_name("hdl")
_SERVE = """
from firmware_interface.virtual.server import serve
from firmware_interface.virtual.settings import BoardSettings
settings = BoardSettings({settings})
serve(pty=True, speed={speed}, settings=settings, on_ready=lambda url: print(url, flush=True))
"""
_WAIT_S = 60.0
"""For what comes sooner or later: no test fails because the computer is busy."""
_REPLY_S = 2.0
_ORDERLY_END_S = 20.0


def build_firmware(folder: Path, *targets: str) -> None:
    """Build targets of the reference firmware's Makefile, or skip the test."""
    _make(SOURCE, folder, targets, ("gcc", "make"))


def build_fpga(folder: Path, *targets: str) -> None:
    """Build targets of the simulated FPGA's Makefile, or skip the test."""
    _make(FPGA_SOURCE, folder, targets, ("verilator", "g++", "gcc", "make"))


def _make(source: Path, folder: Path, targets: tuple[str, ...], tools: tuple[str, ...]) -> None:
    for tool in tools:
        if shutil.which(tool) is None:
            pytest.skip(f"what is built from {source.name} needs {tool}")
    with suppress(OSError):
        folder.rmdir()  # an empty one: as in a clean clone, make has to make it
    command = ["make", "-j2", "-C", str(source), f"BUILD={folder}", *targets]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr


class BoardCommand(Protocol):
    """Gives the command line of a board."""

    def __call__(
        self, window_s: float = 120.0, speed: float = SPEED, switches_rad: float = 0.0
    ) -> list[str]:
        """With a confirm window of so many seconds, so many times faster than time.

        Limit switches, if any, so far from zero.
        """


def python_command(
    window_s: float = 120.0, speed: float = SPEED, switches_rad: float = 0.0
) -> list[str]:
    """Command line of a Python virtual board."""
    settings = f"confirm_window_s={window_s}"
    settings += f", switches_rad={switches_rad}" if switches_rad else ""
    return [sys.executable, "-c", _SERVE.format(settings=settings, speed=speed)]


def c_command(
    programs: Path,
    *options: str,
    window_s: float = 120.0,
    speed: float = SPEED,
    switches_rad: float = 0.0,
) -> list[str]:
    """Command line of a C board."""
    common = ["--confirm-window", str(window_s), "--speed", str(speed)]
    switches = ["--switches", str(switches_rad)] if switches_rad else []
    return [str(programs / "firmware"), *common, *switches, *options]


@dataclass(frozen=True)
class Served:
    """A running board."""

    url: str
    process: subprocess.Popen[str]

    @contextmanager
    def connected(self) -> Iterator[Board]:
        """The host's verbs for it."""
        link = open_link(self.url, timeout_s=_REPLY_S)
        try:
            yield Board.connect(link)
        finally:
            link.close()

    def press_stop(self, pressed: bool) -> None:
        """The wired emergency stop."""
        self.process.send_signal(signal.SIGUSR1 if pressed else signal.SIGUSR2)


@contextmanager
def serving(command: list[str]) -> Iterator[Served]:
    """Run a board; it must end in order: a sanitizer's complaint is an exit code.

    It ends by SIGTERM, for whatever is started in the background may have to ignore SIGINT; and
    none outlives its test.
    """
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield Served(process.stdout.readline().strip(), process)
    finally:
        process.terminate()
        try:
            _, complaints = process.communicate(timeout=_ORDERLY_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            _, complaints = process.communicate()
    assert process.returncode == 0, complaints


def clean_up(board: Board, first_gains: Mapping[str, AxisGains]) -> None:
    """Bring a board back to where it was at power-up: IDLE, without effort, held by nobody."""
    board.quick_stop()
    until(board, lambda status: status.state in (State.IDLE, State.FAULT))
    board.release()  # a host that was stopped goes on as a new one
    if board.status().state is State.FAULT:
        board.clear_fault()
    if board.status().unconfirmed:
        board.roll_back()
    if board.active_gains() != first_gains:
        put_gains(board, first_gains)
    board.disable()
    watchdog = encode("watchdog.timeout", 1.0) + encode("watchdog.action", 1)
    board._link.write(REGISTERS["watchdog.timeout"].address, watchdog)
    board.release()


def put_gains(board: Board, gains: Mapping[str, AxisGains]) -> None:
    """Stage, commit and confirm."""
    board.stage_gains(gains)
    board.commit()
    board.confirm()


def until(board: Board, condition: Callable[[BoardStatus], bool]) -> BoardStatus:
    """Poll the status, by a host that is alive, until the condition holds."""
    return _poll(board, condition, lambda status: board._session.keep())


def until_abandoned(board: Board, condition: Callable[[BoardStatus], bool]) -> BoardStatus:
    """Poll the status, by a host that gives no sign of life, until the condition holds."""
    return _poll(board, condition, lambda status: None)


def _poll(
    board: Board, condition: Callable[[BoardStatus], bool], keep: Callable[[BoardStatus], None]
) -> BoardStatus:
    deadline = time.monotonic() + _WAIT_S
    while not condition(status := board.status()):
        assert time.monotonic() < deadline, status
        keep(status)
        time.sleep(0.002)
    return status


def until_fault(board: Board) -> Fault:
    """Poll until the board is in FAULT; gives which."""
    return until(board, lambda status: status.state is State.FAULT).fault


def start(board: Board, motion: Trajectory) -> None:
    """Switch the effort on and start a motion."""
    board.enable()
    board.write_trajectory(motion)
    board.arm()
    board.start()


def sines(*components: tuple[float, float, float]) -> Multisine:
    """Of amplitude, angular frequency and phase."""
    return Multisine(tuple(SineComponent(*component) for component in components))


def key_of(board: Board) -> int:
    """The session key of a host."""
    return board._session._key


def command(
    board: Board, opcode: int, token: int, argument: int = 0, key: int | None = None
) -> Result:
    """Write a command as it is, once, by this host or another; gives what is said of the last."""
    if key is None:
        board.claim()
        key = key_of(board)
    send(board, opcode, token, argument, key)
    return until_abandoned(
        board, lambda status: status.last_result is not Result.PENDING
    ).last_result


def send(board: Board, opcode: int, token: int, argument: int, key: int) -> None:
    """Write a command as it is, once; the host of the test takes it for one of its own."""
    board._session._own_tokens.add(token)
    words = encode("command.opcode", opcode) + encode("command.token", token)
    words += encode("command.argument", argument) + encode("command.key", key)
    board._link.write(REGISTERS["command.opcode"].address, words)


_TOKENS = itertools.count(2**15)


def fresh_token(board: Board) -> int:
    """One that the board has not seen, far from those of its host."""
    return (board._session._token + next(_TOKENS)) % 2**16


def ask(board: Board, opcode: int, argument: int = 0, key: int | None = None) -> Result:
    """The same with a token that the board has not seen."""
    return command(board, opcode, fresh_token(board), argument, key)


def refused(board: Board, address: int, words: list[int]) -> int:
    """Number of the Modbus exception with which a write is refused; 0 if it is not."""
    try:
        board._link.write(address, words)
    except BoardError as error:
        return int(error.cause.partition("exception ")[2].partition(")")[0])
    return 0


def refused_value(board: Board, name: str, *values: float) -> int:
    """The same for the values of a register."""
    return refused(board, REGISTERS[name].address, encode(name, *values))

"""Boards of both kinds, each in a process of its own on a pseudo-terminal, and raw frames to them.

The Python virtual board and the C reference firmware were written apart from each other; what
the register map and its words mean is what both of them do.
"""

import os
import select
import shutil
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
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
from firmware_interface.registers import REGISTERS, Fault, Result, State

SPEED = 20.0
SOURCE = Path(registers.__file__).with_name("reference_firmware")
_SERVE = """
from firmware_interface.virtual import gain_banks
from firmware_interface.virtual.server import serve
gain_banks.CONFIRM_WINDOW_S = {window_s}
serve(pty=True, speed={speed}, on_ready=lambda device: print(device, flush=True))
"""


def build_firmware(folder: Path, target: str) -> None:
    """Build a target of the reference firmware's Makefile, or skip the test."""
    for tool in ("gcc", "make"):
        if shutil.which(tool) is None:
            pytest.skip(f"the reference firmware needs {tool}")
    command = ["make", "-j2", "-C", str(SOURCE), f"BUILD={folder}", target]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr


class BoardCommand(Protocol):
    """Gives the command line of a board."""

    def __call__(self, window_s: float = 120.0, speed: float = SPEED) -> list[str]:
        """With a confirm window of so many seconds, so many times faster than time."""


def python_command(window_s: float = 120.0, speed: float = SPEED) -> list[str]:
    """Command line of a Python virtual board."""
    return [sys.executable, "-c", _SERVE.format(window_s=window_s, speed=speed)]


def c_command(
    programs: Path, *options: str, window_s: float = 120.0, speed: float = SPEED
) -> list[str]:
    """Command line of a C board."""
    common = ["--confirm-window", str(window_s), "--speed", str(speed)]
    return [str(programs / "firmware"), *common, *options]


@dataclass(frozen=True)
class Served:
    """A running board."""

    url: str
    process: subprocess.Popen[str]

    @contextmanager
    def connected(self) -> Iterator[Board]:
        """The host's verbs for it."""
        link = open_link(self.url)
        try:
            yield Board.connect(link)
        finally:
            link.close()

    def press_stop(self, pressed: bool) -> None:
        """The wired emergency stop of the C board."""
        self.process.send_signal(signal.SIGUSR1 if pressed else signal.SIGUSR2)


@contextmanager
def serving(command: list[str]) -> Iterator[Served]:
    """Run a board; it must end in order: a sanitizer's complaint is an exit code."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    url = process.stdout.readline().strip()
    try:
        yield Served(url, process)
    finally:
        process.send_signal(signal.SIGINT)
        _, complaints = process.communicate(timeout=10)
        assert process.returncode == 0, complaints


def clean_up(board: Board, first_gains: Mapping[str, AxisGains]) -> None:
    """Bring a board back to IDLE with the gains that it had at power-up."""
    board.quick_stop()
    until(board, lambda status: status.state in (State.IDLE, State.FAULT))
    if board.status().state is State.FAULT:
        board.clear_fault()
    if board.status().unconfirmed:
        board.roll_back()
    if board.active_gains() != first_gains:
        put_gains(board, first_gains)


def put_gains(board: Board, gains: Mapping[str, AxisGains]) -> None:
    """Stage, commit and confirm."""
    board.stage_gains(gains)
    board.commit()
    board.confirm()


def until(board: Board, condition: Callable[[BoardStatus], bool], timeout_s: float = 5.0) -> None:
    """Poll the status until the condition holds."""
    deadline = time.monotonic() + timeout_s
    while not condition(board.status()):
        assert time.monotonic() < deadline, board.status()
        time.sleep(0.002)


def until_fault(board: Board) -> Fault:
    """Poll until the board is in FAULT; gives which."""
    until(board, lambda status: status.state is State.FAULT)
    return board.status().fault


def command(board: Board, opcode: int, token: int, argument: int = 0) -> Result:
    """Write a command as it is, once; gives what is said of the last one."""
    words = encode("command.opcode", opcode) + encode("command.token", token)
    words += encode("command.argument", argument)
    board._link.write(REGISTERS["command.opcode"].address, words)
    return board.status().last_result


def refused(board: Board, address: int, words: list[int]) -> int:
    """Number of the Modbus exception with which a write is refused; 0 if it is not."""
    try:
        board._link.write(address, words)
    except BoardError as error:
        return int(error.cause.rpartition("exception ")[2].rstrip(")"))
    return 0


# ---- raw frames


def crc16(data: bytes) -> bytes:
    """CRC-16 of Modbus, as it follows the frame."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return struct.pack("<H", crc)


def framed(body: str) -> bytes:
    """A frame out of hexadecimal digits, with its CRC."""
    data = bytes.fromhex(body)
    return data + crc16(data)


class Line:
    """The host's end of a serial line, byte by byte."""

    def __init__(self, url: str) -> None:
        self._file = os.open(url, os.O_RDWR | os.O_NOCTTY)

    def __enter__(self) -> "Line":
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._file)

    def send(self, data: bytes) -> None:
        """Put bytes on the line."""
        os.write(self._file, data)

    def replies(self, count: int = 8, wait_s: float = 0.2) -> bytes:
        """What comes back: so many bytes, or what came in time."""
        found = b""
        while len(found) < count and select.select([self._file], [], [], wait_s)[0]:
            found += os.read(self._file, 512)
        return found

    def ask(self, body: str, count: int = 5) -> str:
        """Send a whole request; gives the reply in hexadecimal digits, without its CRC."""
        self.send(framed(body))
        reply = self.replies(count)
        assert crc16(reply[:-2]) == reply[-2:]
        return reply[:-2].hex()

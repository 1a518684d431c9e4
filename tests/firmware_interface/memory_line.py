"""A faulty line in memory: the host's own Modbus client at one end, the virtual board's server at
the other, and a clock that goes on only when somebody waits."""

import errno
import random
import secrets
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from types import SimpleNamespace
from typing import Final
from unittest import mock

from fault_line import FaultyLine, Sender
from witness import SETTINGS, Witness

from firmware_interface import board_checks, board_session, capture_pages, modbus, modbus_server
from firmware_interface.board import Board
from firmware_interface.errors import LinkError
from firmware_interface.modbus import ModbusLink, SerialClient
from firmware_interface.modbus_server import RtuSession
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.machine import Machine

TIMEOUT_S: Final = 0.06
_REQUEST_S: Final = 0.0004
"""What a request costs host and board apart from the line."""


class VirtualTime:
    """A clock that stands still until somebody waits; also the clock of a virtual board.

    Watchdog and confirm window go by it, and one control sample passes every 2.5 ms of it.
    """

    def __init__(self) -> None:
        self._now_s = 0.0
        self._samples = 0

    def now_s(self) -> float:
        """Seconds since the beginning."""
        return self._now_s

    def pass_to(self, when_s: float) -> None:
        """Let time pass."""
        self._now_s = max(self._now_s, when_s)

    def advance(self, machine: Machine, status_read: bool) -> None:
        """Run the samples that are due."""
        while self._samples * SAMPLE_PERIOD_S < self._now_s:
            self._samples += 1
            machine.sample()

    def idle(self, machine: Machine) -> None:
        """The same."""
        self.advance(machine, False)


class MemoryLine:
    """A virtual board behind a faulty line in memory.

    Parameters
    ----------
    line : FaultyLine

    Attributes
    ----------
    witness : Witness
        Of the board.
    """

    watchdog_s = 0.25

    def __init__(self, line: FaultyLine) -> None:
        self.line = line
        self.time = VirtualTime()
        self._virtual = VirtualBoard(SETTINGS, self.time)
        self.witness = Witness(self._virtual)
        self._session = RtuSession(self._virtual, self._reply)
        self.in_hand = b""
        self.plugged_in = True

    def connect(self) -> Board:
        """A new host on the line."""
        self.in_hand = b""
        client = _MemoryClient(self)
        if not client.connect():
            raise LinkError("the line is not there", "plug it in")
        return Board.connect(ModbusLink(client, "memory", TIMEOUT_S))

    def hang_up(self) -> None:
        """The host's end of the line goes away."""
        self.plugged_in = False
        self.in_hand = b""
        self.line.forget()

    def come_back(self) -> None:
        """And is there again."""
        self.plugged_in = True

    def wait(self, seconds: float) -> None:
        """Nobody asks the board anything for so long."""
        self.wait_until(self.time.now_s() + seconds)

    def wait_until(self, when_s: float, for_bytes: bool = False) -> None:
        """Let time pass and bytes arrive, for the host at most the first."""
        while (next_s := self.line.next_s) is not None and next_s <= when_s:
            if for_bytes and self.in_hand:
                return
            self.time.pass_to(next_s)
            self._arrive()
        if not (for_bytes and self.in_hand):
            self.time.pass_to(when_s)
            self._virtual.idle()
            self._session.idle()

    def send(self, data: bytes) -> None:
        """The host puts bytes on the line."""
        self.time.pass_to(self.time.now_s() + _REQUEST_S)
        self.line.accept(Sender.HOST, data, self.time.now_s())

    def _reply(self, data: bytes) -> None:
        self.line.accept(Sender.BOARD, data, self.time.now_s())

    def _arrive(self) -> None:
        for sender, data in self.line.due(self.time.now_s()):
            if sender is Sender.HOST:
                self._session.data_received(data)
            elif self.plugged_in:
                self.in_hand += data


@contextmanager
def virtual_time(line: MemoryLine) -> Iterator[None]:
    """Have the host's waiting go by the line's clock, and its tokens by the line's seed."""
    clock = SimpleNamespace(
        monotonic=line.time.now_s,
        sleep=lambda pause_s: line.wait_until(line.time.now_s() + pause_s),
    )
    with ExitStack() as patches:
        hosts = (modbus, board_session, board_checks, capture_pages)
        for module in (*hosts, modbus_server):
            patches.enter_context(mock.patch.object(module, "time", clock))
        draw = random.Random(line.line.seed)
        patches.enter_context(mock.patch.object(secrets, "randbelow", draw.randrange))
        patches.enter_context(mock.patch.object(secrets, "randbits", draw.getrandbits))
        yield


class _MemoryClient(SerialClient):
    """The host's own client, which opens a line in memory."""

    def __init__(self, line: MemoryLine) -> None:
        super().__init__("memory", timeout=TIMEOUT_S, retries=0)
        self._line = line

    def connect(self) -> bool:
        if self.socket is None and self._line.plugged_in:
            self.socket = _MemorySerial(self._line)
        return self.socket is not None


class _MemorySerial:
    """What the client takes for an open port."""

    def __init__(self, line: MemoryLine) -> None:
        self._line = line

    @property
    def in_waiting(self) -> int:
        self._check()
        return len(self._line.in_hand)

    def _check(self) -> None:
        if not self._line.plugged_in:
            raise OSError(errno.EIO, "the line is not there")

    def read(self, size: int) -> bytes:
        self._check()
        line = self._line
        if size and not line.in_hand:
            line.wait_until(line.time.now_s() + TIMEOUT_S, for_bytes=True)
        data, line.in_hand = line.in_hand[:size], line.in_hand[size:]
        return data

    def write(self, data: bytes) -> int:
        self._check()
        self._line.send(data)
        return len(data)

    def close(self) -> None:
        self._line.in_hand = b""

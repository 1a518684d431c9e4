"""The board behind real lines: Modbus RTU on a pseudo-terminal, Modbus TCP, with real clients."""

import os
import re
import socket
import time
from collections.abc import Callable
from contextlib import AbstractContextManager

import pytest
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ModbusIOException
from pymodbus.pdu import ExceptionResponse

from firmware_interface import modbus
from firmware_interface.board import Board
from firmware_interface.connection import open_link
from firmware_interface.errors import BoardError, LinkError, NoReplyError, RestartedError
from firmware_interface.modbus import ModbusLink
from firmware_interface.motion import Trajectory
from firmware_interface.registers import MAP_CRC, REGISTERS, Opcode, State
from firmware_interface.virtual.board import VirtualBoard, WallClock

Served = Callable[[VirtualBoard, str], AbstractContextManager[str]]
LINES = ["pty", "tcp"]
COMMAND = REGISTERS["command.opcode"].address


def capture(board: Board, motion: Trajectory) -> list[int]:
    """First samples of all pages of one motion."""
    board.enable()
    board.write_trajectory(motion)
    board.arm()
    board.start()
    first = [page.first_sample for page in board.capture_pages()]
    board.finish()
    return first


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("speed", [None, 8.0])
def test_capture_without_a_lost_or_repeated_sample(
    served: Served, short_motion: Trajectory, line: str, speed: float | None
) -> None:
    virtual = VirtualBoard(clock=WallClock(speed) if speed else None)
    with served(virtual, line) as url:
        board = Board.connect(open_link(url))
        assert capture(board, short_motion) == list(range(0, 421, 14))
        assert board.status().overflows == 0
        board.close()


@pytest.mark.parametrize("line", LINES)
def test_a_client_nobody_here_wrote_reads_the_identity(served: Served, line: str) -> None:
    with served(VirtualBoard(), line) as url:
        if line == "pty":
            client = ModbusSerialClient(url, baudrate=115200, timeout=1.0)
        else:
            client = ModbusTcpClient("127.0.0.1", port=int(url.rpartition(":")[2]))
        assert client.connect()
        reply = client.read_holding_registers(REGISTERS["identity.map_crc"].address, count=2)
        assert reply.registers == [MAP_CRC >> 16, MAP_CRC & 0xFFFF]
        refused = client.read_holding_registers(0x0F00, count=1)
        assert (refused.isError(), refused.exception_code) == (True, 2)
        unknown = client.read_coils(0, count=1)
        assert (unknown.isError(), unknown.exception_code) == (True, 1)
        client.close()


@pytest.mark.parametrize("line", LINES)
def test_a_second_client_finds_the_board_after_the_first_left(served: Served, line: str) -> None:
    with served(VirtualBoard(), line) as url:
        for _ in range(2):
            board = Board.connect(open_link(url))
            assert board.status().state is State.IDLE
            board.close()


@pytest.mark.parametrize(
    ("code", "cause", "step"),
    [
        (2, "exception 2", "same release"),
        (5, "exception 5.: acknowledged, still busy", "gateway"),
        (8, "exception 8.: it failed", "gateway"),
    ],
)
def test_a_refusal_says_what_to_look_at(served: Served, code: int, cause: str, step: str) -> None:
    with served(VirtualBoard(), "tcp") as url:
        link = open_link(url)
        assert isinstance(link, ModbusLink)
        error = link._refused(code)
        assert re.search(cause, error.cause)
        assert step in error.next_step
        link.close()


def test_a_baud_rate_that_no_port_has_is_refused() -> None:
    port, other = os.openpty()
    try:
        with pytest.raises(LinkError, match="cannot be opened"):
            open_link(os.ttyname(other), baud_rate=4_000_000_000)
    finally:
        os.close(port)
        os.close(other)


def test_a_refusal_of_an_address_is_a_board_error(served: Served) -> None:
    with served(VirtualBoard(), "tcp") as url:
        link = open_link(url)
        with pytest.raises(BoardError, match="exception 2"):
            link.read(0x0F00, 1)
        assert link.read(REGISTERS["identity.map_crc"].address, 2)
        link.close()


@pytest.mark.parametrize("code", [4, 6, 10, 11])
def test_a_refusal_by_something_in_between_is_asked_about_again(
    served: Served, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    """A gateway says that it is busy, or that the board does not answer."""
    with served(VirtualBoard(), "tcp") as url:
        link = open_link(url)
        asked, answers = link._client.read_holding_registers, [ExceptionResponse(3, code)]
        monkeypatch.setattr(
            link._client,
            "read_holding_registers",
            lambda *at, **how: answers.pop() if answers else asked(*at, **how),
        )
        crc = link.read(REGISTERS["identity.map_crc"].address, 2)
        assert crc == [MAP_CRC >> 16, MAP_CRC & 0xFFFF]
        link.close()


class Lossy:
    """A trace_packet hook: loses commands or the replies to them, or brings Ctrl-C in between."""

    def __init__(self) -> None:
        self.lose = ""
        self.commands = 0
        self.pending = False

    def __call__(self, sending: bool, data: bytes) -> bytes:
        if sending:
            head = bytes([0x10, COMMAND >> 8, COMMAND & 0xFF])  # write registers, at the command
            self.pending = head in data[:10]
            self.commands += self.pending
            return b"" if self.pending and self.lose == "request" else data
        if self.pending and self.lose == "interrupt":
            raise KeyboardInterrupt
        return b"" if self.pending and self.lose == "reply" else data


def lossy_link(url: str, line: str) -> tuple[ModbusLink, Lossy]:
    hook = Lossy()
    client: ModbusSerialClient | ModbusTcpClient
    if line == "pty":
        client = ModbusSerialClient(url, baudrate=115200, timeout=0.2, retries=0, trace_packet=hook)
    else:
        port = int(url.rpartition(":")[2])
        client = ModbusTcpClient("127.0.0.1", port=port, timeout=0.2, retries=0, trace_packet=hook)
    assert client.connect()
    return ModbusLink(client, url, 0.2), hook


@pytest.mark.parametrize("line", LINES)
def test_a_lost_reply_to_start_moves_the_machine_once(
    served: Served, short_motion: Trajectory, line: str
) -> None:
    with served(VirtualBoard(), line) as url:
        link, hook = lossy_link(url, line)
        board = Board.connect(link)
        board.enable()
        board.write_trajectory(short_motion)
        board.arm()
        hook.commands, hook.lose = 0, "reply"
        board.start()
        hook.lose = ""
        assert hook.commands == 1
        assert [page.first_sample for page in board.capture_pages()] == list(range(0, 421, 14))
        board.close()


@pytest.mark.parametrize("line", LINES)
def test_a_lost_start_is_reported_and_not_repeated(
    served: Served, short_motion: Trajectory, line: str
) -> None:
    with served(VirtualBoard(), line) as url:
        link, hook = lossy_link(url, line)
        board = Board.connect(link)
        board.enable()
        board.write_trajectory(short_motion)
        board.arm()
        hook.commands, hook.lose = 0, "request"
        with pytest.raises(LinkError, match="nothing was carried out"):
            board.start()
        hook.lose = ""
        assert hook.commands == 1
        assert board.status().state is State.ARMED
        board.close()


class SlowBoard(VirtualBoard):
    """Answers one request later than it may."""

    delay_s = 0.0

    def read(self, address: int, count: int) -> list[int]:
        delay_s, self.delay_s = self.delay_s, 0.0
        time.sleep(delay_s)
        return super().read(address, count)


def test_a_late_reply_does_not_pass_for_the_next_one(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On RTU the late serial number would be taken for the map CRC: both are two words."""
    monkeypatch.setattr(modbus, "_TRIES", 1)
    virtual = SlowBoard()
    with served(virtual, "pty") as url:
        link = open_link(url, timeout_s=0.2)
        virtual.delay_s = 0.3
        with pytest.raises(NoReplyError):
            link.read(REGISTERS["identity.serial_number"].address, 2)
        crc = link.read(REGISTERS["identity.map_crc"].address, 2)
        assert crc == [MAP_CRC >> 16, MAP_CRC & 0xFFFF]
        link.close()


def test_reads_are_repeated_after_a_silence(served: Served) -> None:
    virtual = SlowBoard()
    with served(virtual, "pty") as url:
        link = open_link(url, timeout_s=0.2)
        virtual.delay_s = 0.3
        assert link.read(REGISTERS["identity.serial_number"].address, 2) == [0, 1]
        link.close()


@pytest.mark.parametrize("line", LINES)
def test_a_sign_of_life_goes_out_first_once_the_line_works_again(served: Served, line: str) -> None:
    """What is asked again takes time that the board's watchdog may not have."""
    virtual, serial_number = SlowBoard(), REGISTERS["identity.serial_number"]
    with served(virtual, line) as url:
        link = open_link(url, timeout_s=1.0)
        held: list[bool] = []

        def read(address: int, count: int) -> list[int]:
            if address == serial_number.address:
                held.append(virtual.machine.session.key == 7)
            return SlowBoard.read(virtual, address, count)

        virtual.read = read  # type: ignore[method-assign]
        link.once_clean = lambda: link.write(REGISTERS["session.key"].address, [0, 7])
        virtual.delay_s = 1.2
        assert link.read(serial_number.address, 2) == [0, 1]
        assert (held[0], held[-1]) == (False, True)
        link.close()


@pytest.mark.parametrize("line", LINES)
def test_ctrl_c_in_the_middle_of_a_request_leaves_the_link_usable(
    served: Served, short_motion: Trajectory, line: str
) -> None:
    with served(VirtualBoard(), line) as url:
        link, hook = lossy_link(url, line)
        board = Board.connect(link)
        board.enable()
        board.write_trajectory(short_motion)
        board.arm()
        hook.lose = "interrupt"
        with pytest.raises(KeyboardInterrupt):
            board.start()
        hook.lose = ""
        board.quick_stop()
        assert board.status().state is State.IDLE
        board.close()


@pytest.mark.parametrize("line", LINES)
def test_a_restarted_board_is_noticed_after_a_timeout(served: Served, line: str) -> None:
    virtual = SlowBoard()
    with served(virtual, line) as url:
        link = open_link(url, timeout_s=0.1)
        virtual._registers.put("identity.nonce", 12345)
        virtual.delay_s = 0.15
        with pytest.raises(RestartedError):
            link.read(REGISTERS["identity.serial_number"].address, 2)
        assert link.read(REGISTERS["identity.serial_number"].address, 2) == [0, 1]  # said once
        link.close()


def test_noise_on_the_line_does_not_deafen_the_board(served: Served) -> None:
    with served(VirtualBoard(), "pty") as url:
        line = os.open(url, os.O_RDWR | os.O_NOCTTY)
        os.write(line, bytes(range(1, 40)))
        time.sleep(0.1)
        os.close(line)
        board = Board.connect(open_link(url))
        assert board.status().state is State.IDLE
        board.close()


def test_requests_to_another_device_on_the_line_are_left_alone(served: Served) -> None:
    with served(VirtualBoard(), "pty") as url:
        client = ModbusSerialClient(url, baudrate=115200, timeout=0.1, retries=0)
        assert client.connect()
        with pytest.raises(ModbusIOException):
            client.read_holding_registers(0, count=2, device_id=2)
        assert client.read_holding_registers(0, count=2, device_id=1).registers
        client.close()


def test_a_command_reaches_the_board_only_whole(served: Served) -> None:
    with served(VirtualBoard(), "tcp") as url:
        link = open_link(url)
        with pytest.raises(BoardError):
            link.write(COMMAND, [Opcode.ARM])
        link.close()


def test_a_cut_connection_is_noticed_and_the_next_read_connects_again(served: Served) -> None:
    with served(VirtualBoard(), "tcp") as url:
        link = open_link(url)
        assert isinstance(link, ModbusLink)
        socket_in_use = link._client.socket
        assert isinstance(socket_in_use, socket.socket)
        socket_in_use.shutdown(socket.SHUT_RDWR)
        assert link.read(REGISTERS["identity.serial_number"].address, 2) == [0, 1]
        link.close()

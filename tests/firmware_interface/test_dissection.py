"""What host and boards put on the line, read by tshark's Modbus dissectors: no frame is malformed.

The traffic is recorded where pymodbus hands it over and written as a TCP conversation with port
502, the way in which tshark knows requests from replies; on RTU the conversation carries frames
with their CRC, which tshark checks.
"""

import shutil
import struct
import subprocess
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
from conformance_boards import Served, refused
from pymodbus.client import ModbusSerialClient, ModbusTcpClient

from firmware_interface.board import Board
from firmware_interface.modbus import ModbusLink
from firmware_interface.motion import Trajectory
from firmware_interface.registers import REGISTERS
from firmware_interface.virtual.board import VirtualBoard

pytestmark = pytest.mark.skipif(shutil.which("tshark") is None, reason="needs tshark")

_RAW_IP = 101
_MODBUS_PORT, _HOST_PORT = 502, 40000
_PUSH_ACK = 0x5018


class Recorder:
    """A trace_packet hook: keeps every packet with its direction."""

    def __init__(self) -> None:
        self.packets: list[tuple[bool, bytes]] = []

    def __call__(self, sending: bool, data: bytes) -> bytes:
        if not sending and not self.packets[-1][0]:
            self.packets.pop()  # pymodbus shows a reply anew as it grows
        self.packets.append((sending, data))
        return data

    def save(self, path: Path) -> None:
        """As a capture file of one TCP conversation."""
        rows = [struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, _RAW_IP)]
        sent = {True: 1, False: 1}
        for n, (sending, data) in enumerate(self.packets):
            ports = (_HOST_PORT, _MODBUS_PORT) if sending else (_MODBUS_PORT, _HOST_PORT)
            ends = bytes([127, 0, 0, 1 if sending else 2, 127, 0, 0, 2 if sending else 1])
            ip = struct.pack(">BBHHHBBH", 0x45, 0, 40 + len(data), n, 0, 64, 6, 0) + ends
            counters = (sent[sending], sent[not sending])
            tcp = struct.pack(">HHIIHHHH", *ports, *counters, _PUSH_ACK, 65535, 0, 0)
            sent[sending] += len(data)
            packet = ip + tcp + data
            rows.append(struct.pack("<IIII", n, 0, len(packet), len(packet)) + packet)
        path.write_bytes(b"".join(rows))


def dissect(path: Path, *options: str) -> list[list[str]]:
    """Protocols, function code, exception code and CRC status of every packet."""
    fields = ["frame.protocols", "modbus.func_code", "modbus.exception_code", "mbrtu.crc16.status"]
    wanted = [word for field in fields for word in ("-e", field)]
    command = ["tshark", "-r", str(path), "-T", "fields", *wanted, *options]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=30, check=True)
    return [line.split("\t") for line in ran.stdout.splitlines()]


def converse(board: Board, motion: Trajectory) -> None:
    """Identity, limits, a motion with its pages, gains and refusals."""
    board.limits()
    board.enable()
    board.write_trajectory(motion)
    board.arm()
    board.start()
    list(board.capture_pages())
    board.finish()
    board.stage_gains(board.active_gains())
    board.disable()
    assert refused(board, REGISTERS["identity.magic"].address, [0]) == 2
    assert refused(board, REGISTERS["watchdog.timeout"].address, [0]) == 3


def assert_well_formed(rows: list[list[str]], packets: int, protocol: str) -> None:
    assert len(rows) == packets > 80
    for protocols, function, _exception, _status in rows:
        assert protocol in protocols.split(":")
        assert "malformed" not in protocols
        assert function in ("3", "16")
    assert [row[2] for row in rows if row[2]] == ["2", "3"]


def test_the_tcp_traffic_is_well_formed(
    served: Callable[[VirtualBoard, str], AbstractContextManager[str]],
    short_motion: Trajectory,
    tmp_path: Path,
) -> None:
    recorder = Recorder()
    with served(VirtualBoard(), "tcp") as url:
        port = int(url.rpartition(":")[2])
        client = ModbusTcpClient("127.0.0.1", port=port, retries=0, trace_packet=recorder)
        assert client.connect()
        board = Board.connect(ModbusLink(client, url, 0.3))
        converse(board, short_motion)
        board.close()
    recorder.save(tmp_path / "tcp.pcap")
    assert_well_formed(dissect(tmp_path / "tcp.pcap"), len(recorder.packets), "mbtcp")


def test_the_rtu_traffic_is_well_formed(
    either_kind: Served, short_motion: Trajectory, tmp_path: Path
) -> None:
    recorder = Recorder()
    client = ModbusSerialClient(either_kind.url, baudrate=115200, retries=0, trace_packet=recorder)
    assert client.connect()
    board = Board.connect(ModbusLink(client, either_kind.url, 0.3))
    converse(board, short_motion)
    board.close()
    recorder.save(tmp_path / "rtu.pcap")
    options = ["-d", f"tcp.port=={_MODBUS_PORT},mbrtu", "-o", "mbrtu.crc_verification:TRUE"]
    rows = dissect(tmp_path / "rtu.pcap", *options)
    assert_well_formed(rows, len(recorder.packets), "mbrtu")
    assert {row[3] for row in rows} == {"1"}, "a CRC that tshark finds wrong"

"""A reply that comes later than a link waits for it, and would pass for another one."""

from typing import Any, cast

import pytest
from pymodbus.client import ModbusSerialClient
from pymodbus.exceptions import ModbusIOException
from pymodbus.pdu.register_message import ReadHoldingRegistersResponse

from firmware_interface import modbus
from firmware_interface.errors import NoReplyError
from firmware_interface.modbus import ModbusLink
from firmware_interface.registers import MAP_CRC, REGISTERS
from firmware_interface.virtual.board import VirtualBoard

SERIAL_NUMBER = REGISTERS["identity.serial_number"].address
CRC = REGISTERS["identity.map_crc"].address


class LateLine:
    """A client whose reply about the serial number comes as the answer about the map's CRC, after
    the link has made sure that the board is there."""

    socket = None

    def __init__(self) -> None:
        self._board = VirtualBoard()
        self._late: list[int] = []

    def read_holding_registers(self, address: int, *, count: int, **_: Any) -> Any:
        words = self._board.read(address, count)
        if address == SERIAL_NUMBER:
            self._late = words
            raise ModbusIOException("no reply")
        if address == CRC and self._late:
            words, self._late = self._late, []
        return ReadHoldingRegistersResponse(registers=words)

    def close(self) -> None:
        """Nothing is open."""


def test_words_count_when_more_replies_agree_than_could_be_late(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    link = ModbusLink(cast(ModbusSerialClient, LateLine()), "a line", silence_s=0.0)
    with pytest.raises(NoReplyError):
        link.read(SERIAL_NUMBER, 2)
    assert link.read(CRC, 2) == [MAP_CRC >> 16, MAP_CRC & 0xFFFF]
    monkeypatch.setattr(modbus, "_TRIES", 1)
    with pytest.raises(NoReplyError):
        link.read(SERIAL_NUMBER, 2)
    with pytest.raises(NoReplyError, match="contradictory"):
        link.read(CRC, 2)

"""What came over a line in the place of a reply is said."""

from collections.abc import Callable

import pytest
from test_serial_client import Port

from firmware_interface.errors import LinkError, NoReplyError, SilentError
from firmware_interface.modbus import DEVICE_ID, Heard, ModbusLink, SerialClient
from firmware_interface.registers import MAP_VERSION, REGISTERS


class Spoilt(Port):
    """A port whose bytes from the board are spoilt on their way."""

    def __init__(self) -> None:
        super().__init__(echo=False, piece=300)
        self.spoil: Callable[[bytes], bytes] = lambda data: data

    def _come(self, data: bytes) -> None:
        super()._come(self.spoil(data))


def link_through(port: Port) -> ModbusLink:
    heard = Heard(DEVICE_ID)
    client = SerialClient("port", timeout=0.01, retries=0, trace_packet=heard.note)
    client.connect = lambda: True  # type: ignore[method-assign]
    client.socket = port  # type: ignore[assignment]
    return ModbusLink(client, "port", 0.0, heard=heard)


SPOILT: dict[str, tuple[Callable[[bytes], bytes], str, str]] = {
    "noise": (
        lambda data: b"\xff\x00\xfe" + data[::-1],
        r"no reply within 0 s, but \d+ bytes that are no reply: ff 00 fe", "--baud-rate",
    ),
    "a flipped bit": (
        lambda data: data[:4] + bytes([data[4] ^ 1]) + data[5:],
        r"a damaged reply of \d+ bytes, whose checksum is wrong: 01 03", "check cable, shield",
    ),
    "text": (
        lambda data: b"boot: ready\r\n",
        r"13 bytes of text: 'boot: ready'", "a console prints text",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", SPOILT)
def test_what_came_instead_of_a_board_is_said(kind: str) -> None:
    spoil, said, advice = SPOILT[kind]
    port = Spoilt()
    port.spoil = spoil
    with pytest.raises(LinkError, match=said) as caught:
        link_through(port)
    assert advice in caught.value.next_step
    assert "check port and baud rate" not in caught.value.next_step


def test_damaged_replies_of_a_board_are_counted_and_asked_for_again() -> None:
    port = Spoilt()
    link = link_through(port)
    register = REGISTERS["identity.map_version"]
    port.spoil = SPOILT["a flipped bit"][0]
    with pytest.raises(NoReplyError, match="whose checksum is wrong"):
        link.read(register.address, register.words)
    assert link.damaged_replies > 0
    port.spoil = lambda data: data
    assert link.read(register.address, register.words) == [MAP_VERSION]


def test_bytes_before_a_whole_reply_are_told_apart() -> None:
    """A reply of 2 bytes with its checksum, from the Modbus specification's own algorithm."""
    heard = Heard(1)
    heard.note(False, b"\xfe\x55" + bytes.fromhex("01 03 02 12 34 b5 33"))
    missed = heard.missed()
    assert missed is not None
    assert missed[0].startswith("2 bytes before a whole reply: fe 55 01 03")


def test_a_silent_line_is_silent() -> None:
    heard = Heard(1)
    heard.note(False, b"\xfe")
    heard.note(True, b"\x01")
    assert heard.missed() is None
    assert heard.damaged == 0


def test_a_motion_that_damaged_replies_ended_blames_the_line() -> None:
    error = SilentError("the watchdog ended the motion", "")
    error.measured(0.4, 0.3, damaged=12)
    assert "12 replies came damaged" in error.cause
    assert "check cable" in error.next_step

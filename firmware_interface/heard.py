"""What came over a line in the place of a reply, in words."""

from typing import Final

from pymodbus.framer import FramerRTU

_MOST: Final = 1024
"""Bytes that are kept: four times the longest reply."""
_SHOWN: Final = 16
_TEXT: Final = 0.9
"""Share of letters, digits and blanks from which bytes are text."""
_SHORTEST: Final = 5
"""Bytes of a refusal; every other reply is longer."""
_FUNCTIONS: Final = (0x03, 0x04, 0x10, 0x83, 0x84, 0x90)
"""First bytes of a reply behind the device's number."""
CABLE: Final = (
    "check cable, shield, ground and termination of the line between board and host, and keep it "
    "away from motor cables"
)


class Heard:
    """Bytes that came since the last request.

    Parameters
    ----------
    device_id : int
        That replies begin with.

    Attributes
    ----------
    damaged : int
        Requests so far after which bytes came that were no reply.
    """

    def __init__(self, device_id: int) -> None:
        self._device_id = device_id
        self._bytes = b""
        self.damaged = 0

    def note(self, sending: bool, data: bytes) -> bytes:
        """Take note of bytes on their way, as pymodbus asks for it; they stay as they are."""
        if sending:
            self._bytes = b""
        elif data.startswith(self._bytes):  # what pymodbus could not use yet, and more
            self._bytes = data[:_MOST]
        else:
            self._bytes = (self._bytes + data)[:_MOST]
        return data

    def missed(self) -> tuple[str, str] | None:
        """What came in the place of a reply, and what to do; None where nothing came."""
        if not self._bytes:
            return None
        self.damaged += 1
        data = self._bytes
        what = f"{len(data)} bytes" if len(data) > 1 else "1 byte"
        shown = data[:_SHOWN].hex(" ") + (" …" if len(data) > _SHOWN else "")
        text = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in data)
        if (before := self._before_whole_reply()) is not None:
            return f"{before} bytes before a whole reply: {shown}", CABLE
        if self._begins_as_reply():
            return f"a damaged reply of {what}, whose checksum is wrong: {shown}", CABLE
        if text >= _TEXT * len(data):
            line = data.decode("ascii", "replace").strip().splitlines() or [""]
            return (
                f"{what} of text: {line[0][:40]!r}",
                "take the port on which the board answers Modbus; a console prints text",
            )
        return (
            f"{what} that are no reply: {shown}",
            "set the same baud rate, parity and stop bits on board and host (--baud-rate), and "
            + CABLE,
        )

    def _before_whole_reply(self) -> int | None:
        """How many bytes came before a reply whose checksum is right."""
        data, check = self._bytes, int.from_bytes(self._bytes[-2:], "big")
        for at in range(1, len(data) - _SHORTEST + 1):
            body = data[at:-2]
            begins = body[0] == self._device_id and body[1] in _FUNCTIONS
            if begins and FramerRTU.check_CRC(body, check):
                return at
        return None

    def _begins_as_reply(self) -> bool:
        data = self._bytes
        return len(data) > 1 and data[0] == self._device_id and data[1] in _FUNCTIONS

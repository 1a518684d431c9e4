"""Modbus RTU and TCP, the client's half; this file alone knows pymodbus."""

import errno
import logging
import os
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final

import serial
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.constants import ExcCodes
from pymodbus.exceptions import ConnectionException, ModbusException
from pymodbus.framer import FramerRTU
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersResponse,
    WriteMultipleRegistersResponse,
)

from firmware_interface import board_types, codec, errors, registers

# pymodbus's client of a serial line, made prompt, and deaf to the line's echo.


class SerialClient(ModbusSerialClient):
    """Waits for bytes in the kernel; pymodbus's own polling costs 2 ms a request.

    An RS-485 adapter may hear itself: what was sent then comes back before the reply. No reply
    begins with its whole request, so that is taken off. pymodbus does so on request, but takes the
    first byte of a reply, which comes alone, for the first of an echo.
    """

    _sent = b""

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Send, and keep in mind what; otherwise as pymodbus."""
        self._sent = request
        return super().send(request, addr)

    def recv(self, size: int | None) -> bytes:
        """What has come, once it is more than the beginning of an echo; nothing after a while."""
        if not self.socket:
            raise ConnectionException(str(self))
        try:
            heard = self._heard()
            while heard and self._sent.startswith(heard) and (more := self._heard()):
                heard += more
        except OSError as error:
            self.close()  # type: ignore[no-untyped-call]
            raise ConnectionException(str(self)) from error
        reply = heard.removeprefix(self._sent)
        if len(reply) < len(heard):
            self._sent = b""  # what follows is the reply's
        return reply

    def _heard(self) -> bytes:
        assert self.socket is not None
        return bytes(self.socket.read(1) + self.socket.read(self.socket.in_waiting))


# What came over a line in the place of a reply, in words.

_MOST: Final = 1024  # bytes that are kept: four times the longest reply
_SHOWN: Final = 16
_TEXT: Final = 0.9  # share of letters, digits and blanks from which bytes are text
_SHORTEST: Final = 5  # bytes of a refusal; every other reply is longer
# First bytes of a reply behind the device's number.
_FUNCTIONS: Final = (0x03, 0x04, 0x10, 0x83, 0x84, 0x90)
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


# Modbus RTU and TCP, the client's half; this file and `serial_client` alone know pymodbus.
#
# RTU replies carry no number, so after a timeout the late reply to one request can pass for the
# reply to the next. Hence a link is dirty from the moment a request leaves until its reply is in
# hand. The next request on a dirty link first drains the line, keeps silent for the board's worst
# reply time and reads the identity, which nothing else can pass for: it begins with the magic
# number. Its nonce, and only that, tells that the board has restarted. A second copy of a reply
# could pass for the next one, too: between two reads of one length from different places stands one
# of another length. And a reply may be later still: as long as one of the same length from another
# place could be on its way, words count when more replies than that say the same. Capture pages
# need none of this, for they say which they are. Reads are repeated, writes never: what became of a
# command is read back, also where a reply refuses it, which a gateway may have made.

DEVICE_ID: Final = 1
_NONCE: Final = registers.REGISTERS["identity.nonce"]
_IDENTITY: Final = (registers.REGISTERS["identity.magic"].address, board_types.NONCE_WORDS)
_TRIES: Final = 3
# Exceptions of a gateway that has no way to the board, or no answer of it.
_BY_GATEWAY: Final = (10, 11)
_LATEST_S: Final = 2.0  # time after which no adapter still holds a reply
_SERIAL_ADVICE: Final = (
    "check port and baud rate, that the board is on, and that nothing else talks to it "
    "(ModemManager probes new ttyACM ports: stop it or exempt the port)"
)
_TCP_ADVICE: Final = (
    "check address and port, and close other programs that talk to the board: it closes "
    "connections beyond its limit"
)

# what pymodbus would print says less than the errors raised here
logging.getLogger("pymodbus").addHandler(logging.NullHandler())


class _LateReplyError(errors.NoReplyError):
    """The reply to an earlier request came: the line is alive, and late."""


class ModbusLink:
    """A link through a pymodbus client.

    Parameters
    ----------
    client : ModbusSerialClient or ModbusTcpClient
        Open, with retries=0.
    name : str
        For messages.
    silence_s : float
        The board's worst reply time.
    advice : str
        What to look at where nothing answers like a board.
    heard : Heard, optional
        What the client tells of the bytes that come.

    Attributes
    ----------
    longest_reply_s : float
    once_clean : callable
        See `firmware_interface.link.Line`.

    Raises
    ------
    LinkError
        What is at the other end does not answer like the board.
    """

    def __init__(
        self,
        client: ModbusSerialClient | ModbusTcpClient,
        name: str,
        silence_s: float,
        advice: str = _SERIAL_ADVICE,
        heard: Heard | None = None,
    ) -> None:
        self._client = client
        self._heard = heard or Heard(DEVICE_ID)
        self._name = name
        self._silence_s = silence_s
        self._dirty = False
        self._last_read = (0, 0)
        self.longest_reply_s = 0.0
        self.once_clean: Callable[[], None] = _nothing
        self._unanswered: list[tuple[int, int, float]] = []
        """Address and count of reads whose reply may still come, and when they were given up."""
        try:
            self._identity = self._first_identity()
        except (errors.NoReplyError, errors.BoardError) as error:
            client.close()  # type: ignore[no-untyped-call]
            if self.damaged_replies:
                advice = error.next_step
            advice += f"; replies that take more than {silence_s:g} s need a faster gateway"
            why = error.cause.removeprefix(f"{name}: ")
            raise errors.LinkError(
                f"{name} is open, but no board answers: {why}", advice
            ) from error

    def read(self, address: int, count: int) -> list[int]:
        """Words of consecutive registers; repeated when no reply comes, or a refusal."""
        for _ in range(_TRIES - 1):
            try:
                return self._read_clean(address, count)
            except errors.RestartedError:
                raise
            except (errors.NoReplyError, errors.BoardError):
                continue
        return self._read_clean(address, count)

    def write(self, address: int, words: list[int]) -> None:
        """Write consecutive registers in one transfer, once."""
        self._clean()
        reply = self._transact(
            lambda: self._client.write_registers(address, words, device_id=DEVICE_ID)
        )
        if not isinstance(reply, WriteMultipleRegistersResponse) or (
            (reply.address, reply.count) != (address, len(words))
        ):
            raise self._late_reply()

    @property
    def damaged_replies(self) -> int:
        """Requests so far after which bytes came that were no reply."""
        return self._heard.damaged

    def close(self) -> None:
        """Let go of the port."""
        self._client.close()  # type: ignore[no-untyped-call]

    def _first_identity(self) -> list[int]:
        """Whatever it is: who has another magic number is told apart by what it is asked next."""
        for _ in range(_TRIES - 1):
            with suppress(errors.NoReplyError):
                words = self._read_once(*_IDENTITY)
                if _is_identity(words):
                    return words
            self._drain()
        return self._read_once(*_IDENTITY)

    def _read_clean(self, address: int, count: int) -> list[int]:
        self._clean()
        if address >= registers.PAGE_ADDRESS:
            return self._read_once(address, count)
        if self._last_read[0] != address:
            self._read_between(count)
        words = self._read_once(address, count)
        if address == _IDENTITY[0] and count >= board_types.NONCE_WORDS and _is_identity(words):
            self._identity = words[: board_types.NONCE_WORDS]  # whoever asks for it judges it
        for _ in range(self._perhaps_late(address, count)):
            self._read_between(count)
            if self._read_once(address, count) != words:
                raise self._no_reply("its replies are contradictory")
        return words

    def _read_between(self, count: int) -> None:
        """Where two reads of one length would follow each other, one of another length."""
        if count == self._last_read[1]:
            self._read_once(_NONCE.address, _NONCE.words if count != _NONCE.words else 2 * count)

    def _perhaps_late(self, address: int, count: int) -> int:
        """How many replies from other places could come instead of this one."""
        now_s = time.monotonic()
        self._unanswered = [late for late in self._unanswered if now_s - late[2] < _LATEST_S]
        return sum(there != address and size == count for there, size, _ in self._unanswered)

    def _read_once(self, address: int, count: int) -> list[int]:
        try:
            reply = self._transact(
                lambda: self._client.read_holding_registers(
                    address, count=count, device_id=DEVICE_ID
                )
            )
            # input registers' reply is a subclass
            if type(reply) is not ReadHoldingRegistersResponse or len(reply.registers) != count:
                raise self._late_reply()
        except errors.NoReplyError:
            self._unanswered.append((address, count, time.monotonic()))
            raise
        self._last_read = (address, count)
        return list(reply.registers)

    def _transact(self, request: Callable[[], ModbusPDU]) -> ModbusPDU:
        self._dirty = True
        try:
            reply = request()
        except ConnectionException as error:
            raise self._no_reply("the connection is lost") from error
        except (ModbusException, OSError) as error:
            cause = f"no reply within {self._silence_s:g} s"
            if (missed := self._heard.missed()) is not None:
                what, advice = missed
                raise errors.NoReplyError(f"{self._name}: {cause}, but {what}", advice) from error
            raise self._no_reply(cause) from error
        self._dirty = False
        if isinstance(reply, ExceptionResponse):
            raise self._refused(reply.exception_code)
        return reply

    def _refused(self, code: int) -> errors.BoardError | errors.NoReplyError:
        if code in _BY_GATEWAY:
            self._dirty = True  # the board's own reply may still come
            return self._no_reply(f"a gateway has no answer of the board (Modbus exception {code})")
        cause = f"{self._name} refuses the request (Modbus exception {code})"
        if code == ExcCodes.DEVICE_BUSY:
            return errors.BusyError(
                f"{cause}: another host controls the board, or it has no time",
                "wait until it is free and at rest, or stop it with edge-ident stop",
            )
        if code > ExcCodes.ILLEGAL_VALUE:
            cause += ": acknowledged, still busy" if code == ExcCodes.ACKNOWLEDGE else ": it failed"
            return errors.BoardError(cause, "look at board and gateway, then try again")
        kind = errors.ValueRefusedError if code == ExcCodes.ILLEGAL_VALUE else errors.BoardError
        return kind(cause, "install the same release on board and host")

    def _clean(self) -> None:
        """Make sure that no late reply can pass for the next one."""
        if not self._dirty:
            return
        others, until_s = 0, time.monotonic() + _LATEST_S
        while others < _TRIES:
            self._drain()
            try:
                words = self._read_once(*_IDENTITY)
            except _LateReplyError:
                if time.monotonic() > until_s:
                    raise
                continue
            if words == self._identity:
                self.once_clean()
                if self._lost_again():
                    raise self._no_reply("no reply again")
                return
            if _is_identity(words):
                self._identity = words
                raise errors.RestartedError(codec.decode_integer(_NONCE.name, words, _IDENTITY[0]))
            others += 1
        self._dirty = True
        raise errors.LinkError(
            f"{self._name} is no longer the same board",
            "make sure that no other host or device is connected, then connect again",
        )

    def _lost_again(self) -> bool:
        return self._dirty

    def _drain(self) -> None:
        """Be rid of replies that are on their way."""
        if isinstance(self._client, ModbusTcpClient):
            self._client.close()  # type: ignore[no-untyped-call] # a new connection knows nothing of old replies
            return
        time.sleep(self._silence_s)
        if self._client.socket:
            with suppress(OSError):  # hung up: the next request opens the port anew
                self._client.socket.read(self._client.socket.in_waiting)

    def _late_reply(self) -> errors.NoReplyError:
        self._dirty = True
        cause = f"{self._name}: the reply belongs to another request"
        return _LateReplyError(cause, "check the cable and what loads this computer")

    def _no_reply(self, cause: str) -> errors.NoReplyError:
        return errors.NoReplyError(f"{self._name}: {cause}", "check cable and power of the board")


def _nothing() -> None:
    """What is to be done once the line is clean, where nobody wants anything."""


def _is_identity(words: list[int]) -> bool:
    return codec.decode_integer("identity.magic", words) == registers.MAGIC


def open_serial(url: str, baud_rate: int, timeout_s: float) -> ModbusLink:
    """Open a serial device or pySerial URL; see `firmware_interface.connection.open_link`."""
    heard = Heard(DEVICE_ID)
    client = SerialClient(
        url, baudrate=baud_rate, timeout=timeout_s, retries=0, trace_packet=heard.note
    )
    try:
        client.socket = serial.serial_for_url(
            url, baudrate=baud_rate, timeout=timeout_s, write_timeout=timeout_s, exclusive=True
        )
    except (OSError, ValueError, OverflowError) as error:  # the last: no such baud rate
        code = getattr(error, "errno", None)
        why = os.strerror(code) if code else error  # pySerial's text repeats number and name
        raise errors.LinkError(f"{url} cannot be opened: {why}", _serial_advice(code)) from error
    return ModbusLink(client, url, timeout_s, heard=heard)


def _serial_advice(code: int | None) -> str:
    if code == errno.ENOENT:
        return (
            "connect the board and find its port with `edge-ident ports`; or try --device virtual"
        )
    if code == errno.EACCES:
        return "add your user to the group that owns the port (often dialout), then log in again"
    if code in (errno.EBUSY, errno.EAGAIN):
        return "close the program that has the port open; ModemManager opens new ttyACM ports"
    return "give a serial device, a pySerial URL, tcp://HOST:PORT or virtual"


def open_tcp(host: str, port: int, timeout_s: float) -> ModbusLink:
    """Connect to a Modbus TCP server; see `firmware_interface.connection.open_link`."""
    name = f"tcp://{host}:{port}"
    heard = Heard(DEVICE_ID)
    client = ModbusTcpClient(host, port=port, timeout=timeout_s, retries=0, trace_packet=heard.note)
    try:
        connected = client.connect()  # type: ignore[no-untyped-call]
    except UnicodeError as error:
        raise errors.LinkError(
            f"{host!r} is no name of a host", "write it as tcp://HOST:PORT"
        ) from error
    if not connected:
        raise errors.LinkError(
            f"{name} refuses the connection or cannot be reached",
            "check address and port, and that the board (or `edge-ident board`) is running",
        )
    return ModbusLink(client, name, timeout_s, _TCP_ADVICE, heard)

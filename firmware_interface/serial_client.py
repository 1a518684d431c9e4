"""pymodbus's client of a serial line, made prompt, and deaf to the line's echo."""

from pymodbus.client import ModbusSerialClient
from pymodbus.exceptions import ConnectionException


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

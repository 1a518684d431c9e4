"""A plant in a process of its own, which a board moves sample by sample over a Unix socket.

Lines of decimal numbers, one answer to each line; docs/plant_socket.md is the protocol. The other
end in C is reference_firmware/linux/plant_socket.c.
"""

import logging
import math
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, Protocol

from firmware_interface.errors import LinkError

VERSION: Final = 1
_LOG: Final = logging.getLogger(__name__)


class SteppedPlant(Protocol):
    """What a board can move."""

    @property
    def shown_rad(self) -> Sequence[float]:
        """What the encoders show, by axis."""

    def advance(self, command: Sequence[float]) -> None:
        """Let one sample pass under new efforts, N·m."""


Build = Callable[[float, float], SteppedPlant]
"""Makes a plant at rest, from the sampling period in s and the share before an effort acts."""


class PlantSession:
    """The plant's half of one connection.

    Parameters
    ----------
    build : callable
        Called for the first line.
    """

    def __init__(self, build: Build) -> None:
        self._build = build
        self._plant: SteppedPlant | None = None

    def answer(self, line: str) -> str:
        """Answer a line.

        Raises
        ------
        ValueError
            It cannot be understood; the connection has to end.
        """
        if self._plant is None:
            self._plant = self._begun(line.split())
        else:
            efforts = [float(word) for word in line.split()]
            if len(efforts) != len(self._plant.shown_rad):
                raise ValueError(f"{len(self._plant.shown_rad)} efforts expected")
            if not all(map(math.isfinite, efforts)):
                raise ValueError("an effort is not finite")
            self._plant.advance(efforts)
        return " ".join(map(repr, self._plant.shown_rad))

    def _begun(self, words: Sequence[str]) -> SteppedPlant:
        """The plant for the first line: plant VERSION PERIOD_S DELAY_S AXES."""
        if len(words) != 5 or words[:2] != ["plant", str(VERSION)]:
            raise ValueError(f"expected: plant {VERSION} PERIOD_S DELAY_S AXES")
        period_s, delay_s = float(words[2]), float(words[3])
        if not (0.0 < period_s < 1.0 and 0.0 <= delay_s <= period_s):
            raise ValueError("no such period or delay")
        plant = self._build(period_s, delay_s / period_s)
        if words[4] != str(len(plant.shown_rad)):
            raise ValueError(f"the plant has {len(plant.shown_rad)} axes")
        return plant


def serve_plant(path: Path, build: Build, on_ready: Callable[[str], None]) -> None:
    """Serve plants at a Unix socket until Ctrl-C: one connection at a time, each with a new plant.

    Parameters
    ----------
    path : Path
        Of the socket, which is made and removed. One that nobody serves gives way.
    build : callable
    on_ready : callable
        Gets the path once a board can connect.

    Raises
    ------
    LinkError
        The path is in use, or a socket cannot be there.
    """
    with suppress(KeyboardInterrupt), _listening(path) as listener:
        on_ready(str(path))
        while True:
            connection, _ = listener.accept()
            with connection, suppress(ConnectionError):
                _serve(connection, PlantSession(build))


def _serve(connection: socket.socket, session: PlantSession) -> None:
    with connection.makefile("r", encoding="ascii", errors="replace", newline="\n") as lines:
        for line in lines:
            try:
                answer = session.answer(line)
            except ValueError as error:
                _LOG.warning("a board was refused: %s", error)
                connection.sendall(f"error {error}\n".encode())
                return
            connection.sendall(f"{answer}\n".encode())


@contextmanager
def _listening(path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
        if path.is_socket() and not _served(path):
            path.unlink()
        try:
            listener.bind(str(path))
        except OSError as error:
            raise LinkError(
                f"{path} cannot be a socket: {error.strerror or error}",
                "choose another path, or stop the program that uses it",
            ) from error
        try:
            listener.listen(1)
            yield listener
        finally:
            path.unlink(missing_ok=True)


def _served(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as trial:
        return trial.connect_ex(str(path)) == 0

"""A connected board for the length of a command, and the folder that the command fills."""

import logging
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any

import typer


class Session:
    """A connected board, its drive, and a folder with a log."""

    def __init__(self, board: Any, drive: Any, folder: Path) -> None:
        self.board, self.drive, self.folder = board, drive, folder


@contextmanager
def connected(
    device: str | None, baud_rate: int | None, drive: Path | None
) -> Iterator[tuple[Any, Any]]:
    """The board that the options name, and its drive's description."""
    from edge_ident.commissioning.port_notes import noted
    from firmware_interface.board import Board
    from firmware_interface.connection import open_link

    described, url, rate = located(device, baud_rate, drive)
    with ExitStack() as ending:
        link = open_link(url, baud_rate=rate)
        ending.callback(link.close)
        ending.enter_context(noted(url))
        board = Board.connect(link)
        ending.callback(_let_go, board)
        yield board, described


def located(device: str | None, baud_rate: int | None, drive: Path | None) -> tuple[Any, str, int]:
    """The drive's description, where the board is, and its baud rate, from options."""
    from edge_ident.drive.description import load_drive
    from firmware_interface.connection import DEFAULT_BAUD_RATE

    described = load_drive(drive)
    url = device or described.device
    if url is None:
        raise typer.BadParameter(
            "say where the board is: --device /dev/ttyACM0, tcp://HOST:PORT or virtual "
            "(edge-ident ports lists candidates)",
            param_hint="--device",
        )
    return described, url, baud_rate or described.baud_rate or DEFAULT_BAUD_RATE


def _let_go(board: Any) -> None:
    """So that the next command finds the board free; a hold that stays runs out by itself."""
    from edge_ident.errors import EdgeIdentError

    with suppress(EdgeIdentError):
        board.release()


@contextmanager
def session(
    device: str | None, baud_rate: int | None, drive: Path | None, output: Path | None
) -> Iterator[Session]:
    """A connected board with a folder for results and a log in it."""
    with connected(device, baud_rate, drive) as (board, described):
        folder = output or Path("edge-ident-runs") / datetime.now().strftime("%Y-%m-%dT%H-%M-%S")
        folder.mkdir(parents=True, exist_ok=True)
        with _log_file(folder / "log.txt"):
            yield Session(board, described, folder)


@contextmanager
def _log_file(path: Path) -> Iterator[None]:
    handler = _LogFile(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    loggers = [logging.getLogger(name) for name in ("edge_ident", "firmware_interface")]
    for logger in loggers:
        logger.setLevel(logging.INFO)
        logger.addHandler(handler)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeHandler(handler)
        with suppress(OSError):
            handler.close()


class _LogFile(logging.FileHandler):
    """A log whose disk may be full: a line that finds no room is lost, and that is all."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 (logging's own name)
        """Keep silent; what else is to be written there will say so."""

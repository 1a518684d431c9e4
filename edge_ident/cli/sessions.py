"""A connected board for the length of a command, and the folder that the command fills."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
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
    from edge_ident.drive.description import load_drive
    from firmware_interface.board import Board
    from firmware_interface.connection import DEFAULT_BAUD_RATE, open_link

    described = load_drive(drive)
    url = device or described.device
    if url is None:
        raise typer.BadParameter(
            "say where the board is: --device /dev/ttyACM0, tcp://HOST:PORT or virtual "
            "(edge-ident ports lists candidates)",
            param_hint="--device",
        )
    link = open_link(url, baud_rate=baud_rate or described.baud_rate or DEFAULT_BAUD_RATE)
    try:
        yield Board.connect(link), described
    finally:
        link.close()


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

"""A connected board for the length of a command, and the folder that the command fills."""

import logging
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import edge_ident
from edge_ident import commissioning
from edge_ident.cli.messages import logged
from edge_ident.cli.options import BoardOptions, check_folder
from edge_ident.cli.settings import board_setting

if TYPE_CHECKING:
    from edge_ident import Board, Drive
    from firmware_interface.plant.hiding import Hidden


@dataclass(frozen=True)
class Address:
    """Where a board is, and the drive that hangs on it."""

    device: str
    baud_rate: int
    drive: "Drive"


@dataclass(frozen=True)
class Session:
    """A connected board, its drive, and a folder with a log."""

    board: "Board"
    drive: "Drive"
    folder: Path
    device: str


def device_of(options: BoardOptions, drive: "Drive") -> str | None:
    """Where the board is: option or environment, drive description, settings; None: nowhere."""
    return options.device or drive.device or board_setting("device")


def baud_rate_of(options: BoardOptions, drive: "Drive") -> int:
    """Baud rate of a serial device, from the same places or the default."""
    given = options.baud_rate or drive.baud_rate or board_setting("baud_rate")
    return given or commissioning.connection.DEFAULT_BAUD_RATE


def drive_or_built_in(path: Path | str | None) -> "tuple[Drive, edge_ident.EdgeIdentError | None]":
    """A drive description, or the built-in one and why that one cannot be read."""
    try:
        return edge_ident.load_drive(path), None
    except edge_ident.EdgeIdentError as error:
        return edge_ident.load_drive(), error
    except OSError as error:
        told = edge_ident.DataError(str(error), "check the path of the drive description")
        return edge_ident.load_drive(), told


def located(options: BoardOptions) -> Address:
    """Find out where the board is, from options, drive description and settings."""
    drive = edge_ident.load_drive(options.drive)
    device = device_of(options, drive)
    if not device:
        raise typer.BadParameter(
            "no board is named: give --device /dev/ttyACM0, tcp://HOST:PORT or virtual "
            "(edge-ident ports lists the serial ports; edge-ident config set device keeps one)",
            param_hint="--device",
        )
    return Address(device, baud_rate_of(options, drive), drive)


@contextmanager
def connected(
    options: BoardOptions, hidden: "Hidden | None" = None
) -> Iterator[tuple["Board", "Drive"]]:
    """Connect to the board that the options name, and give its drive's description.

    Faults can be hidden in the drive behind a virtual board.
    """
    address = located(options)
    if hidden and address.device != "virtual":
        raise typer.BadParameter(
            "faults are hidden, and machines drawn, behind --device virtual or by edge-ident board",
            param_hint="--hide, --used",
        )
    plant = hidden.plant() if hidden else None
    with edge_ident.connect(address.device, baud_rate=address.baud_rate, plant=plant) as board:
        yield board, address.drive


@contextmanager
def session(
    context: typer.Context,
    options: BoardOptions,
    output: Path | None,
    writes: Iterable[str],
    hidden: "Hidden | None" = None,
) -> Iterator[Session]:
    """Connect to a board, with a folder for results that no other session has, and a log in it.

    The command line names this folder; the environment and the settings name one in which every
    session has a folder of its own. None of the files that the session `writes`, as patterns of
    their names, is there.
    """
    if output is not None:
        check_folder(output)
    source = context.get_parameter_source("output")
    by_name = source is not None and source.name == "COMMANDLINE"
    with connected(options, hidden) as (board, drive):
        folder = output if output and by_name else _new_folder(output or Path("edge-ident-runs"))
        folder.mkdir(parents=True, exist_ok=True)
        with _log_file(folder / "log.txt", writes):
            yield Session(board, drive, folder, located(options).device)


def _new_folder(above: Path) -> Path:
    """A folder by the time of day that no other session has."""
    begun = above / datetime.now().strftime("%Y-%m-%dT%H-%M-%S")
    folder, others = begun, count(2)
    while True:
        with suppress(FileExistsError):
            folder.mkdir(parents=True)
            return folder
        folder = begun.with_name(f"{begun.name}-{next(others)}")


@contextmanager
def _log_file(path: Path, writes: Iterable[str]) -> Iterator[None]:
    """A new log, which says to other sessions whose folder that is.

    A session in which nothing happened, for it was refused, leaves no log either.

    Raises
    ------
    DataError
        Another session, earlier or at this time, has the folder, or a file is there that this one
        writes.
    """
    before = set(path.parent.iterdir())
    try:
        handler = _LogFile(path, "x", encoding="utf-8")
    except FileExistsError as error:
        raise _taken(path.parent, "another run or capture, whose files") from error
    line = "%(asctime)s %(levelname)s %(name)s: %(message)s"
    try:
        there = sorted(file.name for pattern in writes for file in path.parent.glob(pattern))
        if there:
            raise _taken(path.parent, f"{', '.join(there)}, which")
        with logged(handler, line, ("edge_ident", "firmware_interface")):
            yield
    finally:
        with suppress(OSError):
            handler.close()
            alone = {*path.parent.iterdir()} - before == {path}
            if alone and not path.stat().st_size:
                path.unlink()


def _taken(folder: Path, what: str) -> edge_ident.DataError:
    return edge_ident.DataError(
        f"{folder} holds {what} would be lost",
        "choose another folder with --output; without it, each has a folder by date and time",
    )


class _LogFile(logging.FileHandler):
    """A log whose disk may be full: a line that finds no room is lost, and that is all."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 (logging's own name)
        """Keep silent; what else is to be written there will say so."""

"""The way to a board: the virtual one, the ports of this host, and who has a device open."""

import json
import os
import signal
import socket
import stat
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final
from urllib.parse import quote

from serial.tools import list_ports

from edge_ident.errors import BoardError, EdgeIdentError, LinkError
from edge_ident.estimation.manifest import BUILT_IN, Manifest, load_manifest
from firmware_interface.board import Board
from firmware_interface.board_identification import BoardAxis, CapturedCounts, network_code
from firmware_interface.board_types import BoardIdentity
from firmware_interface.connection import DEFAULT_BAUD_RATE, open_link

if TYPE_CHECKING:
    from edge_ident.estimation.network_estimate import BoardNetwork
    from firmware_interface.plant.plant import Plant


# Entry point of the link: from a device's name to a board.


@contextmanager
def connect(
    device: str, *, baud_rate: int = DEFAULT_BAUD_RATE, plant: "Plant | None" = None
) -> Iterator[Board]:
    """Connect to a board for the length of a with statement.

    Parameters
    ----------
    device : str
        `/dev/ttyACM0`, any pySerial URL, `tcp://HOST:PORT` (Modbus TCP), or `virtual`: a board
        in this process, with the built-in drive behind it.
    baud_rate : int
        Of a serial line.
    plant : firmware_interface.plant.Plant, optional
        The drive behind a board `virtual`; by default the built-in one, with nothing wrong.

    Yields
    ------
    Board
        Released and closed when the body ends, however it ends.

    Raises
    ------
    LinkError
        There is no such device, or nothing answers.
    BoardError
        What answers is not a board of this register map.

    Examples
    --------
    >>> import edge_ident
    >>> with edge_ident.connect("virtual") as board:
    ...     board.status().state.name
    'IDLE'
    """
    with ExitStack() as ending:
        try:
            link = open_link(device, baud_rate=baud_rate, plant=plant, identifier=VirtualNetwork())
        except LinkError as error:
            explain(error, device)
            raise
        ending.callback(link.close)
        ending.enter_context(noted(device))
        board = Board.connect(link)
        ending.callback(_release, board)
        yield board


def _release(board: Board) -> None:
    """Let the next host find the board free; a hold that stays runs out by itself."""
    with suppress(EdgeIdentError):
        board.release()


# The built-in network on a virtual board, as `edge-ident export --c` puts it on a real one.


class VirtualNetwork:
    """Loaded while a host asks the board what it identified, or for good.

    Parameters
    ----------
    stays : bool
        Load it now and keep it: then a host waits for the computation alone, some 30 ms.
    """

    def __init__(self, *, stays: bool = False) -> None:
        self._loaded = _on_board() if stays else None

    @property
    def network(self) -> int:
        """Its code."""
        return network_code(self._manifest.sha256["int8"])

    @property
    def longest_s(self) -> float:
        """One period of its motion."""
        return self._manifest.motion.period_s

    @cached_property
    def _manifest(self) -> Manifest:
        return load_manifest(BUILT_IN)

    def identify(self, captured: CapturedCounts, board: BoardIdentity) -> dict[str, BoardAxis]:
        """What the board says of each axis."""
        return (self._loaded or _on_board()).identify(captured, board)


def _on_board() -> "BoardNetwork":
    # onnxruntime, which only a board that identifies needs
    from edge_ident.estimation.network import load_network
    from edge_ident.estimation.network_estimate import BoardNetwork

    return BoardNetwork(load_network("int8"))


# Serial ports, and what answers at each.


@dataclass(frozen=True)
class Port:
    """A serial port.

    Attributes
    ----------
    device, description, hardware_id : str
        As the system has them.
    board : BoardIdentity or None
        The board that answered.
    answer : str
        What answered, in words.
    next_step : str
        Where no board did.
    """

    device: str
    description: str
    hardware_id: str
    board: BoardIdentity | None
    answer: str
    next_step: str = ""


def ask_ports(baud_rate: int, on_port: Callable[[int, int], None]) -> list[Port]:
    """Ask at every serial port for a board's identity.

    Parameters
    ----------
    baud_rate : int
    on_port : callable
        Called with ports asked and ports in all.
    """
    listed = sorted(list_ports.comports(), key=lambda port: str(port.device))
    found = []
    for n, port in enumerate(listed):
        on_port(n, len(listed))
        found.append(_ask(port.device, port.description, port.hwid, baud_rate))
    on_port(len(listed), len(listed))
    return found


def _ask(device: str, description: str, hardware_id: str, baud_rate: int) -> Port:
    try:
        link = open_link(device, baud_rate=baud_rate)
        try:
            board = Board.connect(link).identity
        finally:
            link.close()
    except (LinkError, BoardError) as error:
        return Port(device, description, hardware_id, None, error.cause, error.next_step)
    answer = f"board {board.serial_number}, firmware {board.firmware_version}"
    return Port(device, description, hardware_id, board, answer)


# Which processes have a device open, so that another one can ask them to stop the machine.
#
# A serial port has one holder, a board at a network several. Each command that opens a device
# leaves a note of itself in folders that only this user may enter: its process, when that began,
# and what the device is called, as it was given and really. Which folders there are depends on how
# a command was started (cron, su, a container), so the note stands in each that there is.

_POLL_S: Final = 0.05
_PRIVATE: Final = 0o700


@dataclass(frozen=True)
class Holder:
    """A process that has a device open.

    Attributes
    ----------
    pid : int
    started : str
        When it began, in the system's own words: another process of that number began later.
    device : str
        As it was given: its path from the root on, or an address.
    real_name : str
        What that stood for when it was opened: the path without links, the address as numbers.
    command : str
        What it is.
    """

    pid: int
    started: str
    device: str
    real_name: str
    command: str = ""

    def __str__(self) -> str:
        return f"process {self.pid}" + (f" ({self.command})" if self.command else "")

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return _started(self.pid) == self.started

    @property
    def names(self) -> set[str]:
        """What its device is called: as given, really at that time, and really now.

        An adapter that is plugged in again may get another number, to which a link then leads.
        """
        now = self.device if "://" in self.device else os.path.realpath(self.device)
        return {self.device, self.real_name, now}

    def end(self, timeout_s: float) -> bool:
        """Ask it to end, as Ctrl-C does; says whether it did in time."""
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGTERM)
            os.kill(self.pid, signal.SIGCONT)  # else a suspended process does not take it
        deadline = time.monotonic() + timeout_s
        while self.alive:
            if time.monotonic() > deadline:
                return False
            time.sleep(_POLL_S)
        return True


@contextmanager
def noted(device: str) -> Iterator[None]:
    """Leave a note that this process has the device open, for as long as the body runs."""
    pid = os.getpid()
    holder = Holder(pid, _started(pid) or "", _given(device), _real_name(device), _command())
    notes = []
    for folder in _folders() if device != "virtual" else ():  # that is a board of its own
        with suppress(OSError):  # without it, only `edge-ident stop` is poorer
            _make_private(folder)
            note = folder / f"{quote(holder.real_name, safe='')}.{pid}.json"
            note.write_text(json.dumps(asdict(holder)), "utf-8")
            notes.append(note)
    try:
        yield
    finally:
        for note in notes:
            with suppress(OSError):
                note.unlink(missing_ok=True)


def holders_of(device: str) -> list[Holder]:
    """The processes of this user that have a device open and left a note."""
    found, names = dict[int, Holder](), {_given(device), _real_name(device)}
    for folder in _folders():
        with suppress(OSError):
            if not _is_private(folder):
                continue
            for note in folder.glob("*.json"):
                holder = _read(note)
                if holder is None or not holder.alive:  # of one that was killed
                    note.unlink(missing_ok=True)
                elif names & holder.names:
                    found[holder.pid] = holder
    return list(found.values())


def explain(error: LinkError, device: str) -> None:
    """Give an error of opening a device the processes that have it open as the next step."""
    holders = holders_of(device)
    if holders:
        who = ", ".join(map(str, holders))
        error.next_step = f"{who} has it open: wait, or end that with edge-ident stop"


def _folders() -> list[Path]:
    """Wherever a command of this user may look, however it was started."""
    user = os.getuid()
    places = [os.environ.get("XDG_RUNTIME_DIR"), os.environ.get("TMPDIR"), "/tmp"]
    if os.path.isdir(f"/run/user/{user}"):
        places.append(f"/run/user/{user}")
    return list(dict.fromkeys(Path(place) / f"edge-ident-{user}" for place in places if place))


def _make_private(folder: Path) -> None:
    folder.mkdir(mode=_PRIVATE, parents=True, exist_ok=True)
    if not _is_private(folder):
        raise PermissionError(f"{folder} is not this user's alone")


def _is_private(folder: Path) -> bool:
    """A folder, no link, of this user, where nobody else may write."""
    found = folder.lstat()
    ours = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    return ours and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _given(device: str) -> str:
    """The name of a device as it was given, from whichever folder."""
    return device if "://" in device else os.path.abspath(device)


def _real_name(device: str) -> str:
    """One name for a device, whatever it is called and from whichever folder."""
    if "://" not in device:
        return os.path.realpath(device)
    host, _, port = device.removeprefix("tcp://").rpartition(":")
    if not device.startswith("tcp://") or not port.isdecimal():
        return device
    try:
        found = socket.getaddrinfo(host, int(port), type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return device
    return f"tcp://{min(str(address[0]) for *_, address in found)}:{int(port)}"


def _command() -> str:
    """What this process is, as a person knows it: `edge-ident run`."""
    program, *words = [*sys.argv, ""]
    name = "edge-ident" if program.endswith("__main__.py") else os.path.basename(program)
    if name != "edge-ident":
        return name
    return " ".join([name, *[word for word in words if word and not word.startswith("-")][:1]])


def _read(path: Path) -> Holder | None:
    """A note, if it is this user's own."""
    try:
        if path.stat().st_uid != os.getuid():
            return None
        values = json.loads(path.read_text("utf-8"))
        began, device = str(values["started"]), str(values["device"])
        real_name, command = str(values.get("real_name", device)), str(values.get("command", ""))
        return Holder(int(values["pid"]), began, device, real_name, command)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def is_running(pid: int) -> bool:
    """Whether a process runs; one that has ended and was not waited for does not."""
    return _started(pid) is not None


def _started(pid: int) -> str | None:
    """When a process began; None where it has ended. Empty where the system does not tell."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text("ascii", "replace").rpartition(")")[2].split()
    except OSError:
        if Path("/proc/self/stat").exists():
            return None
        try:
            os.kill(pid, 0)
        except OSError:
            return None
        return ""
    return None if fields[0] == "Z" else fields[19]

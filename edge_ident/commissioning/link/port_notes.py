"""Which processes have a device open, so that another one can ask them to stop the machine.

A serial port has one holder, a board at a network several. Each command that opens a device leaves
a note of itself in folders that only this user may enter: its process, when that began, and what
the device is called, as it was given and really. Which folders there are depends on how a command
was started (cron, su, a container), so the note stands in each that there is.
"""

import json
import os
import signal
import socket
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final
from urllib.parse import quote

from edge_ident.errors import LinkError

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

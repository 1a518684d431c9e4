"""Which process holds a device, so that another one can ask it to stop the machine.

A serial port has one holder. Each command that holds a device leaves a note of itself in a folder
that only this user may enter: its process, when that began, and the device's real path.
"""

import json
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final
from urllib.parse import quote

_POLL_S: Final = 0.05
_PRIVATE: Final = 0o700


@dataclass(frozen=True)
class Holder:
    """A process that holds a device.

    Attributes
    ----------
    pid : int
    started : str
        When it began, in the system's own words: another process of that number began later.
    device : str
        Real path.
    """

    pid: int
    started: str
    device: str

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return _started(self.pid) == self.started

    def end(self, timeout_s: float) -> bool:
        """Ask it to end, as Ctrl-C does; says whether it did in time."""
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGTERM)
        deadline = time.monotonic() + timeout_s
        while self.alive:
            if time.monotonic() > deadline:
                return False
            time.sleep(_POLL_S)
        return True


@contextmanager
def noted(device: str) -> Iterator[None]:
    """Leave a note that this process holds the device, for as long as the body runs."""
    path = _note(device)
    holder = Holder(os.getpid(), _started(os.getpid()) or "", os.path.realpath(device))
    with suppress(OSError):  # without it, only `edge-ident stop` is poorer
        path.parent.mkdir(mode=_PRIVATE, parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(holder)), "utf-8")
    try:
        yield
    finally:
        if _read(path) == holder:
            path.unlink(missing_ok=True)


def holder_of(device: str) -> Holder | None:
    """The process of this user that holds a device, where one does that left a note."""
    holder = _read(_note(device))
    return holder if holder is not None and holder.alive else None


def _note(device: str) -> Path:
    folder = os.environ.get("XDG_RUNTIME_DIR") or os.environ.get("TMPDIR") or "/tmp"
    base = Path(folder) / f"edge-ident-{os.getuid()}"
    return base / f"{quote(os.path.realpath(device), safe='')}.json"


def _read(path: Path) -> Holder | None:
    """A note, if it is this user's own."""
    try:
        if path.parent.stat().st_uid != os.getuid() or path.stat().st_uid != os.getuid():
            return None
        values = json.loads(path.read_text("utf-8"))
        return Holder(int(values["pid"]), str(values["started"]), str(values["device"]))
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

"""Is this machine fit for the job? Each check says what to do where it is not."""

import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path
from typing import Final

from serial.tools import list_ports

from edge_ident.commissioning.check import Check
from edge_ident.errors import EdgeIdentError
from edge_ident.estimation.manifest import VARIANTS, Variant
from edge_ident.estimation.network import load_network

_DISTRIBUTION: Final = "edge-ident"
_INSTALLED: Final = ("edge_ident", "firmware_interface")
_LATENCY_TIMER_MS: Final = 4
_PROCESSES: Final = Path("/proc")
_TIMERS: Final = Path("/sys/bus/usb-serial/devices")
_UDEV: Final = Path("/run/udev/data")


def check_host() -> list[Check]:
    """Look at packages, networks and serial ports; nothing is sent to a port."""
    ports = [port.device for port in list_ports.comports()]
    return [
        Check(
            "python", sys.version_info >= (3, 11), platform.python_version(), "use 3.11 or later"
        ),
        *(_package(name) for name in ("numpy", "onnxruntime", "pyserial", "pymodbus", "typer")),
        own_packages(),
        *(_network(variant) for variant in VARIANTS),
        modem_manager(ports),
        *(check for port in ports for check in (permission(port), *latency_timer(port))),
    ]


def _package(name: str) -> Check:
    try:
        return Check(name, True, version(name))
    except PackageNotFoundError:
        return Check(name, False, "not installed", "install edge-ident again")


def own_packages() -> Check:
    """Whether no other installed distribution has files under the names of our packages.

    pip overwrites files of the same name without a word.
    """
    owners = packages_distributions()
    others = {
        f"{name} (also of {owner})"
        for name in _INSTALLED
        for owner in owners.get(name, ())
        if owner != _DISTRIBUTION
    }
    return Check(
        "own packages",
        not others,
        ", ".join(sorted(others or _INSTALLED)),
        "install edge-ident alone in a virtual environment of its own",
    )


def _network(variant: Variant) -> Check:
    try:
        network = load_network(variant)
    except EdgeIdentError as error:
        return Check(f"network {variant}", False, error.cause, error.next_step)
    return Check(f"network {variant}", True, f"{network.manifest.normalization}, hash matches")


def permission(device: str) -> Check:
    """Whether this user may open a port."""
    allowed = os.access(device, os.R_OK | os.W_OK)
    return Check(
        device,
        allowed,
        "can be opened" if allowed else "no permission to open it",
        "add yourself to the group that owns it (often dialout) and log in again",
    )


def latency_timer(device: str) -> list[Check]:
    """How long a USB adapter waits before it hands bytes on; nothing where it has no timer."""
    timer = _TIMERS / Path(device).name / "latency_timer"
    try:
        milliseconds = int(timer.read_text())
    except (OSError, ValueError):
        return []
    return [
        Check(
            f"{device} latency timer",
            milliseconds <= _LATENCY_TIMER_MS,
            f"{milliseconds} ms",
            f"write 1 to {timer}: pages fall behind with the default of 16 ms",
        )
    ]


def modem_manager(ports: list[str]) -> Check:
    """Whether ModemManager runs and will probe a port as soon as it appears."""
    exposed = [port for port in ports if "ttyACM" in port and not _ignored(port)]
    running = any(_name_of(process) == "ModemManager" for process in _PROCESSES.glob("[0-9]*"))
    where = f", and probes {', '.join(exposed)}" if exposed else ""
    return Check(
        "ModemManager",
        not (running and exposed),
        f"runs{where}" if running else "does not run",
        'stop it, or exclude the board with the udev rule ENV{ID_MM_DEVICE_IGNORE}="1"',
    )


def _name_of(process: Path) -> str:
    try:
        return (process / "comm").read_text().strip()
    except OSError:  # it ended meanwhile, or is not ours to read
        return ""


def _ignored(device: str) -> bool:
    """Whether a udev rule keeps ModemManager off a port."""
    try:
        number = os.stat(device).st_rdev
        known = (_UDEV / f"c{os.major(number)}:{os.minor(number)}").read_text()
    except OSError:
        return False
    return "E:ID_MM_DEVICE_IGNORE=1" in known.split()

"""Is this machine fit for the job? Each check says what to do where it is not."""

import os
import platform
import signal
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path
from typing import Final

from serial.tools import list_ports

from edge_ident.commissioning.link.link_checks import Check
from edge_ident.errors import EdgeIdentError
from edge_ident.estimation.manifest import VARIANTS, Variant

_DISTRIBUTION: Final = "edge-ident"
_INSTALLED: Final = ("edge_ident", "firmware_interface")
_LATENCY_TIMER_MS: Final = 4
_PROCESSES: Final = Path("/proc")
_RUNTIME: Final = "onnxruntime"
_TRIAL: Final = f"""
import {_RUNTIME}
print("imported", flush=True)
from edge_ident.estimation.manifest import VARIANTS
from edge_ident.estimation.network import load_network
for variant in VARIANTS:
    load_network(variant)
"""
_TIMERS: Final = Path("/sys/bus/usb-serial/devices")
_UDEV: Final = Path("/run/udev/data")


def check_host() -> list[Check]:
    """Look at packages, networks and serial ports; nothing is sent to a port."""
    ports = [port.device for port in list_ports.comports()]
    return [
        Check(
            "python", sys.version_info >= (3, 11), platform.python_version(), "use 3.11 or later"
        ),
        *(_package(name) for name in ("numpy", "pyserial", "pymodbus", "typer")),
        own_packages(),
        *networks(),
        modem_manager(ports),
        *(check for port in ports for check in (permission(port), *latency_timer(port))),
    ]


def _package(name: str) -> Check:
    try:
        return Check(name, True, version(name))
    except PackageNotFoundError:
        return Check(name, False, "not installed", "install edge-ident again")


def networks() -> list[Check]:
    """Whether onnxruntime runs the networks; a process of its own tries first.

    A build with instructions that the processor lacks kills the process that imports it or runs a
    network, and with it whatever the doctor has to say.
    """
    found = _package(_RUNTIME)
    if not found.good:
        return [found]
    path = os.pathsep.join(filter(None, sys.path))
    tried = subprocess.run(
        [sys.executable, "-c", _TRIAL], env=os.environ | {"PYTHONPATH": path},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    imported = bool(tried.stdout)
    if tried.returncode < 0:
        return [_killed(found.detail, signal.Signals(-tried.returncode).name, imported)]
    if not imported:
        cause = (tried.stderr.splitlines() or ["cannot be imported"])[-1]
        return [Check(_RUNTIME, False, f"{found.detail}: {cause}", "install edge-ident again")]
    return [found, *(_network(variant) for variant in VARIANTS)]


def _killed(release: str, by: str, imported: bool) -> Check:
    when = "runs a network" if imported else "is imported"
    return Check(
        _RUNTIME,
        False,
        f"{release} ends its process with {by} when it {when}, so that identify and run end too",
        "this build does not suit this processor, or /proc/cpuinfo is hidden; install another "
        f"release: pip install '{_RUNTIME}!={release}'",
    )


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
    from edge_ident.estimation.network import load_network  # after the trial: it may kill

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

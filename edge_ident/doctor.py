"""Is this machine fit for the job? Each check says what to do where it is not."""

import os
import platform
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from serial.tools import list_ports

from edge_ident.errors import EdgeIdentError
from edge_ident.network import VARIANTS, Variant, load_network

_LATENCY_TIMER_MS = 4


@dataclass(frozen=True)
class Check:
    """One thing looked at."""

    what: str
    good: bool
    detail: str
    next_step: str = ""


def examine() -> list[Check]:
    """Run all checks; none moves or writes anything."""
    return [
        Check(
            "python", sys.version_info >= (3, 11), platform.python_version(), "use 3.11 or later"
        ),
        *(_package(name) for name in ("numpy", "onnxruntime", "pyserial", "pymodbus", "typer")),
        *(_network(variant) for variant in VARIANTS),
        *(check for port in list_ports.comports() for check in _port(port.device)),
    ]


def _package(name: str) -> Check:
    try:
        return Check(name, True, version(name))
    except PackageNotFoundError:
        return Check(name, False, "not installed", "install edge-ident again")


def _network(variant: Variant) -> Check:
    try:
        network = load_network(variant)
    except EdgeIdentError as error:
        return Check(f"network {variant}", False, error.cause, error.next_step)
    return Check(f"network {variant}", True, f"{network.manifest.normalization}, hash matches")


def _port(device: str) -> list[Check]:
    writable = os.access(device, os.R_OK | os.W_OK)
    found = [
        Check(
            device,
            writable,
            "may be opened" if writable else "no right to open it",
            "add yourself to the group that owns it (often dialout) and log in again",
        )
    ]
    timer = Path("/sys/bus/usb-serial/devices") / Path(device).name / "latency_timer"
    if timer.is_file():
        milliseconds = int(timer.read_text())
        found.append(
            Check(
                f"{device} latency timer",
                milliseconds <= _LATENCY_TIMER_MS,
                f"{milliseconds} ms",
                f"write 1 to {timer}: pages fall behind with the default of 16 ms",
            )
        )
    return found

"""Is this machine fit for the job? Each check says what to do where it is not."""

import os
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from serial.tools import list_ports

from edge_ident.commissioning.ports import explain
from edge_ident.errors import BoardError, EdgeIdentError, LinkError
from edge_ident.estimation.manifest import VARIANTS, Variant
from firmware_interface.board import Board
from firmware_interface.board_checks import CLOCK_RANGE, fault_error
from firmware_interface.capture_pages import CapturePace
from firmware_interface.connection import open_link
from firmware_interface.modbus import CABLE
from firmware_interface.registers import State

Array = NDArray[np.float64]


# Is the link to a board fit for the job? Nothing is moved or written.

_REQUESTS: Final = 200
_PAUSE_S: Final = 0.008
# Longest median: a page, which takes 35 ms to fill, is five times as long.
_ROUND_TRIP_S: Final = 0.010
# Largest difference between the clocks of board and host: what a second of the one is in the other
# goes straight into every speed and acceleration.
_CLOCK_ERROR: Final = 1e-3
_JITTER_S: Final = 0.05


# One thing that was looked at, and what to do where it is not well.


@dataclass(frozen=True)
class Check:
    """Outcome of one look."""

    what: str
    good: bool
    detail: str
    next_step: str = ""


def check_link(url: str, baud_rate: int, on_request: Callable[[int, int], None]) -> list[Check]:
    """Look at a board: map, state, round-trip time, capture pages, clock and jitter.

    Parameters
    ----------
    url, baud_rate
        See `firmware_interface.connection.open_link`.
    on_request : callable
        Called with requests done and requests in all.
    """
    try:
        link = open_link(url, baud_rate=baud_rate)
    except LinkError as error:
        explain(error, url)
        return [Check("link", False, error.cause, error.next_step)]
    found: list[Check] = []
    try:
        board = Board.connect(link)
        found += [_map(board), _state(board)]
        sent_s, returned_s, samples = _timed(board, on_request)
        found.append(round_trip_check(returned_s - sent_s))
        if url == "virtual":
            return [*found, Check("board clock", True, "in this process: passes with requests")]
        pace = board.capture_pace(0)
        found += [capture_check(pace)] if pace.fetched_s else []
        middle_s = 0.5 * (sent_s + returned_s)
        clocks = clock_checks(middle_s, samples, board.identity.sample_period_s)
        return [*found, *_with_damage(clocks, getattr(link, "damaged_replies", 0))]
    except (LinkError, BoardError) as error:
        failed = "link" if found else "register map"
        return [*found, Check(failed, False, error.cause, error.next_step)]
    finally:
        link.close()


def _with_damage(checks: list[Check], damaged: int) -> list[Check]:
    """Checks of a line on which replies came damaged: asked again, they come late."""
    if not damaged:
        return checks
    told = Check("replies", False, f"{damaged} came damaged, and were asked for again", CABLE)
    return [told, *(replace(c, next_step=CABLE) if c.what == "jitter" else c for c in checks)]


def _map(board: Board) -> Check:
    identity = board.identity
    return Check(
        "register map",
        True,
        f"version {identity.map_version}, CRC {identity.map_crc:#010x}; "
        f"board {identity.serial_number}, "
        f"firmware {identity.firmware_version}",
    )


def _state(board: Board) -> Check:
    status = board.status()
    if status.state is State.FAULT or status.emergency_stop:
        error = fault_error(status)
        return Check("state", False, error.cause, error.next_step)
    unhomed = [axis for axis in board.axes if axis not in status.homed]
    told = [status.state.name, f"effort {'on' if status.enabled else 'off'}"]
    told += [f"not homed: {', '.join(unhomed)}"] if unhomed else []
    told += [f"limit switches active: {', '.join(status.limit_switches)}"] * bool(
        status.limit_switches
    )
    told += ["controlled by another host"] if status.session_remaining_s else []
    return Check("state", True, "; ".join(told))


def _timed(board: Board, on_request: Callable[[int, int], None]) -> tuple[Array, Array, Array]:
    """When each request was sent and answered, and the board's clock in between."""
    rows = np.empty((_REQUESTS, 3))
    for n, row in enumerate(rows):
        sent_s = time.perf_counter()
        samples = board.status().clock_samples
        row[:] = sent_s, time.perf_counter(), samples
        time.sleep(_PAUSE_S)
        on_request(n + 1, _REQUESTS)
    return rows[:, 0], rows[:, 1], rows[:, 2]


def round_trip_check(durations_s: Array) -> Check:
    """Whether requests are answered promptly."""
    median, slow = np.quantile(durations_s, [0.5, 0.99])
    return Check(
        "round trip",
        bool(median <= _ROUND_TRIP_S),
        f"median {1e3 * median:.2f} ms, 99 of 100 within {1e3 * slow:.2f} ms",
        "raise the baud rate, write 1 to the adapter's latency timer, remove hubs and gateways",
    )


def capture_check(pace: CapturePace) -> Check:
    """Whether pages can be fetched as fast as they are filled."""
    fits = "of any length" if pace.keeps_up else f"of at most {pace.longest_s:.0f} s"
    return Check(
        "capture",
        pace.keeps_up,
        f"the line brings {1.0 / pace.fetched_s:.1f} pages a second, the board fills "
        f"{1.0 / pace.filled_s:.1f}: motions {fits} can be recorded",
        "make the line faster, as for the round trip",
    )


def clock_checks(times_s: Array, samples: Array, period_s: float) -> list[Check]:
    """Compare the board's clock with this host's.

    Parameters
    ----------
    times_s : (N,) array
        Of the host.
    samples : (N,) array
        The board's clock at those times; it may wrap around at 2**32.
    period_s : float
        Of one sample, as the board states it.
    """
    passed = period_s * np.cumsum(np.diff(samples, prepend=samples[0]) % CLOCK_RANGE)
    host = times_s - times_s[0]
    rate, start = np.polyfit(host, passed, 1)
    late_s = float(np.max(np.abs(passed - (start + rate * host))))
    return [
        Check(
            "board clock",
            bool(abs(rate - 1.0) <= _CLOCK_ERROR),
            f"{rate:.5f} s of board time pass in one second of this computer",
            "check the sample period that the firmware states and the board's oscillator; "
            "a virtual board keeps time with --speed 1",
        ),
        Check(
            "jitter",
            bool(late_s <= _JITTER_S),
            f"requests reach the board up to {1e3 * late_s:.1f} ms off their time",
            "close programs that load this computer or its USB",
        ),
    ]


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

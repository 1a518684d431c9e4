"""Is the link to a board fit for the job? Nothing is moved or written."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.commissioning.link.port_notes import explain
from edge_ident.errors import BoardError, LinkError
from firmware_interface.board import Board
from firmware_interface.board_checks import CLOCK_RANGE, fault_error
from firmware_interface.capture_pace import CapturePace
from firmware_interface.connection import open_link
from firmware_interface.heard import CABLE
from firmware_interface.registers import State

Array = NDArray[np.float64]

_REQUESTS: Final = 200
_PAUSE_S: Final = 0.008
_ROUND_TRIP_S: Final = 0.010
"""Longest median: a page, which takes 35 ms to fill, is five times as long."""
_CLOCK_ERROR: Final = 1e-3
"""Largest difference between the clocks of board and host: what a second of the one is in the
other goes straight into every speed and acceleration."""
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

"""How board time passes: with the wall clock, or as fast as requests come."""

import time
from typing import Final, Protocol

from firmware_interface.registers import State
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.machine import Machine

_STRETCH: Final = 112
_REQUEST_SHARE_S: Final = 0.001
"""Longest work before a request: less than a page's worth, so that a host that asks page by
page outruns a board that is behind."""
_IDLE_SHARE_S: Final = 0.004
_LARGEST_BACKLOG: Final = 100
_LONGEST_STEP_S: Final = 0.05
"""Longest time that passes on the board between two looks at the clock."""


class Clock(Protocol):
    """Lets board time pass before a request is served, and between requests."""

    def now_s(self) -> float:
        """Time of watchdog and confirm window."""

    def advance(self, machine: Machine, status_read: bool) -> None:
        """Bring the machine to the present; called before every request."""

    def idle(self, machine: Machine) -> None:
        """The same, called every few milliseconds when there is no request."""


class WallClock:
    """Board time is wall time times a factor; watchdog and confirm window keep wall time.

    Where the computer cannot keep up, board time falls behind instead of blocking requests. And
    while it does not let the board run at all, no time passes there, not even the watchdog's: a
    busy computer is no host that has fallen silent.

    Parameters
    ----------
    speed : float
        1 is real time.
    """

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._passed_s = 0.0
        self._seen_s = time.monotonic()
        self._due = 0.0

    def now_s(self) -> float:
        """Wall time, less that in which the board was held up."""
        return self._passed_s + min(time.monotonic() - self._seen_s, _LONGEST_STEP_S)

    def advance(self, machine: Machine, status_read: bool) -> None:
        """Catch up with the wall clock."""
        self._catch_up(machine, _REQUEST_SHARE_S)

    def idle(self, machine: Machine) -> None:
        """Catch up with the wall clock."""
        self._catch_up(machine, _IDLE_SHARE_S)

    def _catch_up(self, machine: Machine, share_s: float) -> None:
        passed_s, began_s = self.now_s(), time.monotonic()
        self._due += (passed_s - self._passed_s) * self._speed / SAMPLE_PERIOD_S
        self._passed_s, self._seen_s = passed_s, began_s
        while self._due >= 1.0 and time.monotonic() - began_s < share_s:
            self._due -= 1.0
            machine.sample()
        self._due = min(self._due, _LARGEST_BACKLOG)


class RequestClock:
    """Requests let board time pass, and nothing else does: deterministic, and fast.

    Every request lets one sample pass. Only a host that asks for the status during a motion, and
    so waits for its end, has 0.28 s pass: less than the watchdog's patience. Time stands still
    while the capture ring is full.
    """

    def __init__(self) -> None:
        self._samples = 0

    def now_s(self) -> float:
        """Board time."""
        return self._samples * SAMPLE_PERIOD_S

    def advance(self, machine: Machine, status_read: bool) -> None:
        """Let the stretch pass."""
        self.let_pass(machine, _STRETCH if status_read and machine.moving else 1)

    def let_pass(self, machine: Machine, samples: int) -> None:
        """Let so many samples pass without a request."""
        for _ in range(samples):
            if machine.state is State.MOVING and machine.capture.full:
                return
            self._samples += 1
            machine.sample()

    def idle(self, machine: Machine) -> None:
        """Nothing happens without a request."""

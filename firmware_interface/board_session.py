"""One host's dealings with a board: its key, its commands, and what it saw last.

A host holds the board with a key that it draws at connect. Commands carry the key; while nobody
holds the board, the first command takes it. The hold lasts a few seconds from each write of the
key, which is also all that feeds the board's watchdog. Reading needs no hold.

A command carries a fresh token and is written once. What became of it is read back by that
token, so that a lost reply neither repeats a motion nor hides a refusal. Only the key is written
again, which says no more the second time.
"""

import math
import secrets
import time
from collections.abc import Callable, Container
from contextlib import suppress
from typing import Final

from firmware_interface.board_checks import refusal
from firmware_interface.board_line import BoardLine
from firmware_interface.board_types import BoardStatus
from firmware_interface.codec import decode_integer, encode
from firmware_interface.errors import (
    BoardError,
    BusyError,
    EdgeIdentError,
    LinkError,
    NoReplyError,
    RestartedError,
)
from firmware_interface.link import Link
from firmware_interface.registers import REGISTERS, SESSION_LEASE_S, Opcode, Result, State

POLL_S: Final = 0.005
COMMAND_TIMEOUT_S: Final = 0.5
REST_TIMEOUT_S: Final = 10.0
_STALL_S: Final = 2.0
"""Longest time in which a check of a trajectory, or another host's lease, makes no progress."""
_TRIES: Final = 3
_NOBODY: Final = 0
"""Key of a board that nobody holds."""
_TOKEN_LEAP: Final = 128
_TOKEN_SPREAD: Final = 640
"""Sixty-four leaps, and so all that a board remembers, do not go once around all tokens."""
_CLOCK_RANGE: Final = 2**32
_BEATS_PER_TIMEOUT: Final = 4
_SHORTEST_TIMEOUT_S: Final = REGISTERS["watchdog.timeout"].minimum or 0.0
_NEEDS_NO_HOLD: Final = frozenset({Opcode.QUICK_STOP})
_ENDS_WHAT_BEGAN: Final = frozenset({Opcode.START, Opcode.CONFIRM})
"""Commands that a host which has lost its hold must not send: what it armed or committed may be
another host's by now."""


class Session(BoardLine):
    """One host's dealings with a board.

    Parameters
    ----------
    link : Link
    sample_period_s : float
        Of the board's clock.

    Attributes
    ----------
    pages_in_hand : int
        Capture pages that the board may overwrite; goes out with every heartbeat.
    """

    def __init__(self, link: Link, sample_period_s: float) -> None:
        self._held = False
        super().__init__(link)
        self._period_s = sample_period_s
        # beyond those of earlier hosts: the board ignores what it remembers, and last frames of a
        # host that is gone may still come
        self._token = self._first_status.last_token + _TOKEN_LEAP + secrets.randbelow(_TOKEN_SPREAD)
        self._key = secrets.randbelow(2**32 - 1) + 1
        self._held_at_s = -math.inf
        self._beat_every_s = _SHORTEST_TIMEOUT_S / _BEATS_PER_TIMEOUT
        self._beat_clock = self._clock
        self.pages_in_hand = 0

    # ---- status

    def wait_for(self, states: set[State], what: str) -> BoardStatus:
        """Poll until the board is in one of these states; keeps the hold meanwhile."""
        deadline = time.monotonic() + REST_TIMEOUT_S
        while (status := self.status()).state not in states:
            if time.monotonic() > deadline:
                raise BoardError(
                    f"the board is still {status.state.name} after {REST_TIMEOUT_S:g} s: "
                    f"it did not {what}",
                    "look at the machine; use the wired emergency stop if it moves",
                )
            self.keep(status)
            time.sleep(POLL_S)
        return status

    # ---- the hold

    def claim(self) -> None:
        """Hold the board; waits for the hold of a host that is gone to run out.

        Raises
        ------
        BusyError
            Another host holds the board and renews its hold, or moves the machine.
        """
        left_s, since_s = math.inf, time.monotonic()
        while not self._take():
            status = self.status()
            if status.session_remaining_s < left_s:
                since_s = time.monotonic()
            renewed = status.session_remaining_s > left_s
            if renewed or time.monotonic() - since_s > _STALL_S:
                raise BusyError(
                    f"another host controls the board (it is {status.state.name})",
                    "wait until that host is finished, or stop it with edge-ident stop",
                )
            left_s = status.session_remaining_s
            time.sleep(POLL_S)

    def hold(self) -> None:
        """Hold the board, where that may have run out."""
        if not self._held or time.monotonic() - self._held_at_s > SESSION_LEASE_S / 2.0:
            self.claim()

    def held_by_another(self) -> bool:
        """Whether the board knows another host's key now."""
        register = REGISTERS["session.key"]
        key = decode_integer(register.name, self.read(register.address, register.words))
        return key not in (_NOBODY, self._key)

    def release(self) -> None:
        """Let go of the board; while it moves, the hold runs out by itself afterwards."""
        if not self._held:
            return
        self._held = False
        with suppress(BusyError, NoReplyError):
            self.write(REGISTERS["session.release"].address, encode("session.release", self._key))

    def beat_every(self, watchdog_timeout_s: float) -> None:
        """Set the pace of heartbeats."""
        self._beat_every_s = watchdog_timeout_s / _BEATS_PER_TIMEOUT

    def beat(self) -> None:
        """Renew the hold, feed the watchdog and acknowledge the pages in hand, in one write.

        Where no reply comes it is said again at once: twice does no harm, silence ends a motion.
        """
        words = encode("session.key", self._key)
        words += encode("capture.pages_acknowledged", self.pages_in_hand)
        for _ in range(_TRIES):
            with suppress(NoReplyError):
                try:
                    self.write(REGISTERS["session.key"].address, words)
                except BusyError:
                    self._held = False
                    raise
                self._note_hold()
                return

    def keep(self, status: BoardStatus | None = None) -> None:
        """Beat if it is time, by this host's clock or the board's; nothing where it holds none."""
        if not self._held:
            return
        passed_s = time.monotonic() - self._held_at_s
        if status is not None:
            samples = (status.clock_samples - self._beat_clock) % _CLOCK_RANGE
            passed_s = max(passed_s, samples * self._period_s)
        if passed_s >= self._beat_every_s:
            self.beat()

    def _take(self) -> bool:
        """Write the key; says whether the board took it."""
        register = REGISTERS["session.key"]
        for _ in range(_TRIES):
            try:
                self.write(register.address, encode(register.name, self._key))
            except BusyError:
                self._held = False
                return False
            except NoReplyError:
                words = self.read(register.address, register.words)
                if decode_integer(register.name, words) != self._key:
                    continue
            self._note_hold()
            return True
        raise LinkError(
            "the board did not take this host's key: nothing was carried out",
            "check the cable, then try again",
        )

    def _note_hold(self) -> None:
        self._held, self._held_at_s, self._beat_clock = True, time.monotonic(), self._clock

    # ---- commands

    def command(
        self, opcode: Opcode, argument: int = 0, expected: Container[Result] = ()
    ) -> BoardStatus:
        """Have a command carried out; one refused because an axis still settles, once it stands.

        Parameters
        ----------
        opcode : Opcode
        argument : int
        expected : container of Result
            Refusals that the caller looks at itself.

        Raises
        ------
        BoardError
            The board refuses.
        LinkError
            It did not arrive.
        """
        if opcode not in _NEEDS_NO_HOLD | _ENDS_WHAT_BEGAN:
            self.hold()
        deadline = time.monotonic() + REST_TIMEOUT_S
        while True:
            status = self._settled(opcode, self._send(opcode, argument))
            if status.last_result is Result.DONE or status.last_result in expected:
                return status
            if status.last_result is Result.NOT_HELD and opcode not in _ENDS_WHAT_BEGAN:
                self.claim()
            elif status.last_result is not Result.NOT_AT_REST:
                raise refusal(opcode, status)
            if time.monotonic() > deadline:
                raise refusal(opcode, status)
            time.sleep(POLL_S)

    def _send(self, opcode: Opcode, argument: int) -> BoardStatus:
        """Write a command once and wait until the board has taken it.

        A reply that refuses it is not believed before the board was asked: what stands between
        host and board may have made it.
        """
        self._token = self._token % 0xFFFF + 1
        words = encode("command.opcode", opcode) + encode("command.token", self._token)
        words += encode("command.argument", argument) + encode("command.key", self._key)
        lost: EdgeIdentError = LinkError(
            f"{opcode.name} did not reach the board: nothing was carried out",
            "check the cable, then try again",
        )
        try:
            self.write(REGISTERS["command.opcode"].address, words)
        except NoReplyError:
            pass  # the token tells whether it arrived
        except RestartedError:
            raise
        except BoardError as refused:
            lost = refused
        status = self._poll(
            lambda status: status.last_token == self._token, COMMAND_TIMEOUT_S, lost
        )
        if status.last_result is not Result.NOT_HELD and self._held:
            self._note_hold()
        return status

    def _settled(self, opcode: Opcode, status: BoardStatus) -> BoardStatus:
        """Wait while a command is being carried out, as long as that makes progress."""
        stalled = BoardError(
            f"{opcode.name} does not finish: the board has stopped working on it",
            "switch the board off and on; if it comes back, have the board checked",
        )
        while status.last_result is Result.PENDING and status.last_token == self._token:
            left = status.samples_to_check
            status = self._poll(
                lambda status, left=left: (  # type: ignore[misc]
                    status.last_result is not Result.PENDING or status.samples_to_check != left
                ),
                _STALL_S,
                stalled,
            )
        if status.last_token != self._token:
            raise BoardError(
                f"{opcode.name} was interrupted by a command of another host",
                "make sure that no other host uses the board, then try again",
            )
        return status

    def _poll(
        self, condition: Callable[[BoardStatus], bool], timeout_s: float, late: Exception
    ) -> BoardStatus:
        """Poll the status until the condition holds, or raise."""
        deadline = time.monotonic() + timeout_s
        while not condition(status := self.status()):
            if time.monotonic() > deadline:
                raise late
            time.sleep(POLL_S)
        return status

    def _restarted(self, nonce: int) -> None:
        """Whoever holds the board now, it is not this host."""
        super()._restarted(nonce)
        self._held = False

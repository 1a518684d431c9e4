"""Which host commands a board: one at a time, by a key that it draws.

The hold lasts a few seconds from each write of the key, which is also all that feeds the board's
watchdog. Reading needs no hold. Another host that stops the machine ends it, and the board takes
that key no more: a host that was stopped goes on only after `release`, as a new one.

Signs of life may come from a thread of their own (`give_sign`). Whatever changes who holds the
board is done under the lock of the line, so that none goes out under a key that was let go.
"""

import math
import secrets
import time
from contextlib import suppress
from typing import Final

from firmware_interface.board_checks import CLOCK_RANGE, STOPPED
from firmware_interface.board_line import BoardLine
from firmware_interface.codec import decode_integer, encode
from firmware_interface.errors import (
    BusyError,
    EdgeIdentError,
    LinkError,
    NoReplyError,
    RestartedError,
    StoppedError,
    ValueRefusedError,
)
from firmware_interface.link import Link
from firmware_interface.registers import REGISTERS, SESSION_LEASE_S

POLL_S: Final = 0.005
STALL_S: Final = 2.0
"""Longest time in which a check of a trajectory, or another host's lease, makes no progress."""
_TRIES: Final = 3
_NOBODY: Final = 0
"""Key of a board that nobody holds."""
BEATS_PER_TIMEOUT: Final = 4
"""Signs of life in the watchdog's time."""
USED: Final = "another host has used the board while this one was silent"
_SHORTEST_TIMEOUT_S: Final = REGISTERS["watchdog.timeout"].minimum or 0.0


class Hold(BoardLine):
    """A host's hold of a board.

    Parameters
    ----------
    link : Link
    sample_period_s : float
        Of the board's clock.

    Attributes
    ----------
    pages_in_hand : int
        Capture pages that the board may overwrite; goes out with every heartbeat.
    beat_every_s : float
        Pace of heartbeats.
    """

    def __init__(self, link: Link, sample_period_s: float) -> None:
        self._held = False
        self._claimed = False  # and has not let go
        self._stopped = ""  # why this host must not go on
        self._told = False  # and whether that has been said
        super().__init__(link)
        self._period_s = sample_period_s
        self._key = _drawn_key()
        self._former_keys: set[int] = set()
        self._held_at_s = -math.inf
        self.beat_every_s = _SHORTEST_TIMEOUT_S / BEATS_PER_TIMEOUT
        self._beat_clock = self._clock
        self.pages_in_hand = 0

    def read(self, address: int, count: int) -> list[int]:
        """Words of consecutive registers.

        While this host may hold the board, a silent line is asked again: the board's watchdog
        decides about a motion, and says so once the line is back.
        """
        while True:
            try:
                return super().read(address, count)
            except NoReplyError:
                if self.line is None or not self.holds:
                    raise

    def claim(self) -> None:
        """Hold the board; waits for the hold of a host that is gone to run out.

        Its nonce tells whether it is still the board that this host knows: one whose clock is ahead
        looks the same otherwise.

        Raises
        ------
        RestartedError
            It has restarted since, or is another board.
        BusyError
            Another host holds the board and renews its hold, or moves the machine.
        StoppedError
            This host held the board, and another one stopped it, or holds it now.
        """
        if self._stopped:
            raise self._ended()
        left_s, since_s = math.inf, time.monotonic()
        while not self._take():
            holder = self._holder()
            if self._claimed and holder != self._key:
                self._held = False
                raise self._ended()
            if holder == _NOBODY:  # it was stopped before it let go, and has not learned of it
                self._change_key()
            status = self.status()
            if status.session_remaining_s < left_s:
                since_s = time.monotonic()
            renewed = status.session_remaining_s > left_s
            if renewed or time.monotonic() - since_s > STALL_S:
                raise BusyError(
                    f"another host controls the board (it is {status.state.name})",
                    "wait until that host is finished, or stop it with edge-ident stop",
                )
            left_s = status.session_remaining_s
            time.sleep(POLL_S)
        self._check_nonce()

    def hold(self) -> None:
        """Hold the board, where that may have run out."""
        if not self._held or self._silent_s() > SESSION_LEASE_S / 2.0:
            self.claim()

    def held_by_another(self) -> bool:
        """Whether the board knows another host's key now."""
        return self._holder() not in {_NOBODY, self._key} | self._former_keys

    @property
    def holds(self) -> bool:
        """Whether this host holds the board, as far as it knows without asking."""
        return self._held and not self._may_have_run_out

    @property
    def _may_have_run_out(self) -> bool:
        return self._silent_s() >= SESSION_LEASE_S

    def _silent_s(self) -> float:
        """Time since the key was written, by this host's clock or the board's."""
        samples = (self._clock - self._beat_clock) % CLOCK_RANGE
        return max(time.monotonic() - self._held_at_s, samples * self._period_s)

    def _holder(self) -> int:
        """The key that holds the board."""
        register = REGISTERS["session.key"]
        return decode_integer(register.name, self.read(register.address, register.words))

    def _ended(self) -> StoppedError:
        """Say that another host commanded the board, which is remembered."""
        self._stopped = self._stopped or (USED if self._may_have_run_out else STOPPED)
        self._told = True
        return StoppedError(self._stopped)

    def release(self) -> None:
        """Let go of the board; while it moves, the hold runs out by itself afterwards.

        A host that was stopped may hold it again from here on.
        """
        with self._lock:
            held, self._held, self._claimed = self._held, False, False
        key = self._key
        if self._stopped:
            self._change_key()
            self._stopped, self._told = "", False
        if held:
            with suppress(BusyError, NoReplyError):
                self.write(REGISTERS["session.release"].address, encode("session.release", key))

    def beat_every(self, watchdog_timeout_s: float) -> None:
        """Set the pace of heartbeats."""
        self.beat_every_s = watchdog_timeout_s / BEATS_PER_TIMEOUT

    def beat(self) -> None:
        """Renew the hold, feed the watchdog and acknowledge the pages in hand, in one write.

        Where no reply comes it is said again at once: twice does no harm, silence ends a motion.
        After the last time, what is asked next says that the line is dead.

        Raises
        ------
        StoppedError
            Another host has stopped this one, or used the board while it was silent.
        BusyError
            What stands between host and board refuses.
        """
        for _ in range(_TRIES):
            with suppress(NoReplyError):
                try:
                    self._say()
                except BusyError:
                    self._held = False
                    if self._claimed and self._holder() != self._key:
                        raise self._ended() from None
                    raise
                except ValueRefusedError:  # the board has fewer pages: of another motion?
                    self.status()
                    if self._stopped:
                        raise self._ended() from None
                    raise
                return

    def give_sign(self) -> None:
        """Beat once if it is time; for the heartbeat's thread.

        What is wrong, this host finds out by what it asks: none goes out where it holds no more.
        """
        with self._lock, suppress(EdgeIdentError):
            if not self.holds or self._silent_s() < self.beat_every_s:
                return
            try:
                self._say()
            except BusyError:
                self._held = False
            except RestartedError as error:
                self._unsaid = error

    def _say(self) -> None:
        """Write key and pages in hand, once."""
        with self._lock:
            words = encode("session.key", self._key)
            words += encode("capture.pages_acknowledged", self.pages_in_hand)
            self.write(REGISTERS["session.key"].address, words)
            self._note_hold()

    def keep(self) -> None:
        """Beat if it is time; nothing where this host holds none."""
        if self._held and self._silent_s() >= self.beat_every_s:
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
                    self._change_key()  # this one may still come
                    continue
            self._note_hold()
            return True
        raise LinkError(
            "the board did not take this host's key: nothing was carried out",
            "check the cable, then try again",
        )

    def _disown(self) -> bool:
        """Let go, and go on under another key: a command of the old one that is still on its way
        finds no holder. Says whether the board has let go."""
        old = self._key
        with self._lock:
            self._change_key()
            self._held = self._claimed = False
        release, holder = REGISTERS["session.release"], REGISTERS["session.key"]
        try:
            with suppress(BusyError, NoReplyError):
                self.write(release.address, encode(release.name, old))
            words = self.read(holder.address, holder.words)
        except LinkError:
            return False
        return decode_integer(holder.name, words) != old

    def _change_key(self) -> None:
        self._former_keys.add(self._key)
        self._key = _drawn_key()

    def _note_hold(self) -> None:
        self._claimed = True
        self._held, self._held_at_s, self._beat_clock = True, time.monotonic(), self._clock

    def _restarted(self, nonce: int) -> None:
        """Whoever holds the board now, it is not this host."""
        super()._restarted(nonce)
        self._held = self._claimed = False


def _drawn_key() -> int:
    """A key that no other host has."""
    return secrets.randbelow(2**32 - 1) + 1

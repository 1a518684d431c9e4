"""One host's commands to a board, and what becomes of them.

Commands carry the host's key; while nobody holds the board, the first command takes it.

A command carries a fresh token as well, and is written once. What became of it is read back by
that token, so that a lost reply neither repeats a motion nor hides a refusal. A host that gives a
command up goes on under another key: should the command come late, it finds no holder.

Whoever else commands the board in between, to stop it as a rule, ends what this host is about:
older boards leave it the hold, but the last token is none of its own then. It may still tidy up.
"""

import math
import secrets
import time
from collections.abc import Callable, Container
from contextlib import suppress
from typing import Final

from firmware_interface import board_checks, codec, errors
from firmware_interface.board_types import BoardStatus
from firmware_interface.link import Link
from firmware_interface.registers import REGISTERS, SESSION_LEASE_S, Opcode, Result, State

# Which host commands a board: one at a time, by a key that it draws.
#
# The hold lasts a few seconds from each write of the key, which is also all that feeds the board's
# watchdog. Reading needs no hold. Another host that stops the machine ends it, and the board takes
# that key no more: a host that was stopped goes on only after `release`, as a new one.
#
# Signs of life may come from a thread of their own (`give_sign`). Whatever changes who holds the
# board is done under the lock of the line, so that none goes out under a key that was let go.

POLL_S: Final = 0.005
STALL_S: Final = 2.0
"""Longest time in which a check of a trajectory, or another host's lease, makes no progress."""
_TRIES: Final = 3
_NOBODY: Final = 0  # key of a board that nobody holds
BEATS_PER_TIMEOUT: Final = 4
"""Signs of life in the watchdog's time."""
USED: Final = "another host has used the board while this one was silent"
_SHORTEST_TIMEOUT_S: Final = REGISTERS["watchdog.timeout"].minimum or 0.0


class Hold(board_checks.BoardLine):
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
            except errors.NoReplyError:
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
                raise errors.BusyError(
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
        samples = (self._clock - self._beat_clock) % board_checks.CLOCK_RANGE
        return max(time.monotonic() - self._held_at_s, samples * self._period_s)

    def _holder(self) -> int:
        """The key that holds the board."""
        register = REGISTERS["session.key"]
        return codec.decode_integer(register.name, self.read(register.address, register.words))

    def _ended(self) -> errors.StoppedError:
        """Say that another host commanded the board, which is remembered."""
        self._stopped = self._stopped or (USED if self._may_have_run_out else board_checks.STOPPED)
        self._told = True
        return errors.StoppedError(self._stopped)

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
            with suppress(errors.BusyError, errors.NoReplyError):
                self.write(
                    REGISTERS["session.release"].address, codec.encode("session.release", key)
                )

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
            with suppress(errors.NoReplyError):
                try:
                    self._say()
                except errors.BusyError:
                    self._held = False
                    if self._claimed and self._holder() != self._key:
                        raise self._ended() from None
                    raise
                except errors.ValueRefusedError:  # the board has fewer pages: of another motion?
                    self.status()
                    if self._stopped:
                        raise self._ended() from None
                    raise
                return

    def give_sign(self) -> None:
        """Beat once if it is time; for the heartbeat's thread.

        What is wrong, this host finds out by what it asks: none goes out where it holds no more.
        """
        with self._lock, suppress(errors.EdgeIdentError):
            if not self.holds or self._silent_s() < self.beat_every_s:
                return
            try:
                self._say()
            except errors.BusyError:
                self._held = False
            except errors.RestartedError as error:
                self._unsaid = error

    def _say(self) -> None:
        """Write key and pages in hand, once."""
        with self._lock:
            words = codec.encode("session.key", self._key)
            words += codec.encode("capture.pages_acknowledged", self.pages_in_hand)
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
                self.write(register.address, codec.encode(register.name, self._key))
            except errors.BusyError:
                self._held = False
                return False
            except errors.NoReplyError:
                words = self.read(register.address, register.words)
                if codec.decode_integer(register.name, words) != self._key:
                    self._change_key()  # this one may still come
                    continue
            self._note_hold()
            return True
        raise errors.LinkError(
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
            with suppress(errors.BusyError, errors.NoReplyError):
                self.write(release.address, codec.encode(release.name, old))
            words = self.read(holder.address, holder.words)
        except errors.LinkError:
            return False
        return codec.decode_integer(holder.name, words) != old

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


COMMAND_TIMEOUT_S: Final = 0.5
REST_TIMEOUT_S: Final = 10.0
_TOKEN_LEAP: Final = 128
# Sixty-four leaps, and so all that a board remembers, do not go once around all tokens.
_TOKEN_SPREAD: Final = 640
_NEEDS_NO_HOLD: Final = frozenset({Opcode.QUICK_STOP})
# Commands that a host which has lost its hold must not send: what it armed or committed may be
# another host's by now.
_ENDS_WHAT_BEGAN: Final = frozenset({Opcode.START, Opcode.CONFIRM})
# Commands by which a host that was stopped leaves the board as it found it, as a new host.
_TIDIES_UP: Final = frozenset({Opcode.DISABLE, Opcode.ROLL_BACK})
# Commands that find nothing to do after the stop that follows when they get lost; or gains that the
# board takes back by itself.
_LATE_DOES_NOTHING: Final = _NEEDS_NO_HOLD | _ENDS_WHAT_BEGAN | {Opcode.COMMIT_RUNNING}


class Session(Hold):
    """One host's dealings with a board; parameters are those of `Hold`."""

    def __init__(self, link: Link, sample_period_s: float) -> None:
        self._own_tokens: set[int] = set()
        """The board's last one is among them, unless another host commanded; none before a hold."""
        super().__init__(link, sample_period_s)
        # beyond those of earlier hosts: the board ignores what it remembers, and last frames of a
        # host that is gone may still come
        self._token_seen = self._first_status.last_token
        self._token = self._first_status.last_token + _TOKEN_LEAP + secrets.randbelow(_TOKEN_SPREAD)

    def claim(self) -> None:
        """See `Hold.claim`.

        Raises
        ------
        StoppedError
            Another host has commanded the board since this one has held it.
        """
        if self._own_tokens:
            self.status()
        super().claim()
        if not self._own_tokens:
            self._own_tokens = {self.status().last_token}

    def release(self) -> None:
        """See `Hold.release`."""
        super().release()
        self._own_tokens = set()

    # ---- status

    def status(self) -> BoardStatus:
        """See `BoardLine.status`; notes whether another host has commanded.

        That may be another board, whose tokens are others, too: the nonce tells. A command that
        the board refused because this host holds it, such as a late one of a host that has given
        up, changes nothing.
        """
        status = super().status()
        before, self._token_seen = self._token_seen, status.last_token
        if status.last_token in self._own_tokens:
            self._own_tokens -= {before} - {status.last_token}  # none is the last one twice
        elif self._own_tokens and not self._stopped:
            self._check_nonce()
            if status.last_result is Result.NOT_HELD and not self._may_have_run_out:
                self._own_tokens.add(status.last_token)
            else:
                self._stopped = USED if self._may_have_run_out else board_checks.STOPPED
        return status

    def wait_for(self, states: set[State], what: str) -> BoardStatus:
        """Poll until the board is in one of these states; keeps the hold meanwhile."""
        deadline = time.monotonic() + REST_TIMEOUT_S
        while (status := self.status()).state not in states:
            if time.monotonic() > deadline:
                raise errors.BoardError(
                    f"the board is still {status.state.name} after {REST_TIMEOUT_S:g} s: "
                    f"it did not {what}",
                    "look at the machine; use the wired emergency stop if it moves",
                )
            self.keep()
            time.sleep(POLL_S)
        return status

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
        StoppedError
            Another host has commanded the board meanwhile. DISABLE and ROLL_BACK are carried out
            all the same, and say so only where nothing else has.
        BoardError
            The board refuses, or has carried out another command.
        LinkError
            It did not arrive.
        """
        self._prepare(opcode)
        deadline = time.monotonic() + REST_TIMEOUT_S
        while True:
            status = self._settled(opcode, self._send(opcode, argument))
            if status.last_result is Result.DONE or status.last_result in expected:
                if self._stopped and not self._told and opcode not in _NEEDS_NO_HOLD:
                    raise self._ended()
                if status.last_result is Result.DONE:
                    board_checks.check_effect(opcode, status)
                return status
            if status.last_result is Result.NOT_HELD:
                self._hold_again(opcode, status)
            elif status.last_result is not Result.NOT_AT_REST:
                raise board_checks.refusal(opcode, status)
            if time.monotonic() > deadline:
                raise board_checks.refusal(opcode, status)
            time.sleep(POLL_S)

    def _prepare(self, opcode: Opcode) -> None:
        """Hold the board, and make sure that nobody else has commanded it."""
        if opcode in _NEEDS_NO_HOLD:
            return
        if opcode in _TIDIES_UP:
            told = self._told
            try:
                self.status()
                self.hold()
            except errors.StoppedError:
                self._told = told  # that is for the end
                self._begin_anew()
            return
        if opcode not in _ENDS_WHAT_BEGAN:
            self.hold()
        self.status()
        if self._stopped:
            raise self._ended()

    def _hold_again(self, opcode: Opcode, refused: BoardStatus) -> None:
        """After a refusal because the board did not know this host; raises unless it may go on.

        A board that this host holds all along got another key than was sent: that is said again.
        """
        if self.holds and self._holder() == self._key:
            return
        if self.holds:  # it cannot have run out
            self._held = False
            if opcode not in _TIDIES_UP:
                raise self._ended()
            self._begin_anew()
        elif opcode in _TIDIES_UP and self._stopped:
            self._begin_anew()
        elif opcode in _ENDS_WHAT_BEGAN:
            raise board_checks.refusal(opcode, refused)
        else:
            self.claim()

    def _begin_anew(self) -> None:
        """Hold the board as a new host, which was not stopped, to tidy up; no more than that."""
        stopped, self._stopped, self._claimed = self._stopped or board_checks.STOPPED, "", False
        if not self._held:
            self._change_key()
        try:
            super().claim()
        finally:
            self._stopped = stopped

    def _restarted(self, nonce: int) -> None:
        super()._restarted(nonce)
        self._own_tokens = set()

    def _send(self, opcode: Opcode, argument: int) -> BoardStatus:
        """Write a command once and wait until the board has taken it.

        A reply that refuses it is not believed before the board was asked: what stands between
        host and board may have made it.
        """
        before, self._token = self._token_seen, self._token % 0xFFFF + 1
        if self._own_tokens:
            self._own_tokens.add(self._token)
        words = codec.encode("command.opcode", opcode) + codec.encode("command.token", self._token)
        words += codec.encode("command.argument", argument) + codec.encode("command.key", self._key)
        lost: errors.EdgeIdentError = errors.LinkError(
            f"{opcode.name} did not reach the board: nothing was carried out",
            "check the cable, then try again",
        )
        try:
            self.write(REGISTERS["command.opcode"].address, words)
        except errors.NoReplyError:
            pass  # the token tells whether it arrived
        except errors.RestartedError:
            raise
        except errors.BoardError as refused:
            lost = refused
        try:
            status = self._poll(
                lambda status: status.last_token == self._token, COMMAND_TIMEOUT_S, lost
            )
        except errors.EdgeIdentError as error:
            let_go = opcode in _LATE_DOES_NOTHING or self._disown()
            if error is lost and self._token_seen != before:
                raise errors.OvertakenError(opcode.name) from error
            if error is not lost or let_go:
                raise
            raise errors.LinkError(
                f"{opcode.name} did not reach the board so far, and may still do so",
                f"wait {SESSION_LEASE_S:g} s, then see with edge-ident doctor whether the effort "
                "is on",
            ) from error
        return status

    def _settled(self, opcode: Opcode, status: BoardStatus) -> BoardStatus:
        """Wait while a command is being carried out, as long as that makes progress."""
        stalled = errors.BoardError(
            f"{opcode.name} does not finish: the board has stopped working on it",
            "switch the board off and on; if it comes back, have the board checked",
        )
        while status.last_result is Result.PENDING and status.last_token == self._token:
            left = status.samples_to_check
            status = self._poll(
                lambda status, left=left: (  # type: ignore[misc]
                    status.last_result is not Result.PENDING or status.samples_to_check != left
                ),
                STALL_S,
                stalled,
            )
        if status.last_token != self._token:
            raise errors.OvertakenError(opcode.name)
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

"""One host's commands to a board, and what becomes of them.

Commands carry the host's key; while nobody holds the board, the first command takes it.

A command carries a fresh token as well, and is written once. What became of it is read back by
that token, so that a lost reply neither repeats a motion nor hides a refusal. A host that gives a
command up goes on under another key: should the command come late, it finds no holder.

Whoever else commands the board in between, to stop it as a rule, ends what this host is about:
older boards leave it the hold, but the last token is none of its own then. It may still tidy up.
"""

import secrets
import time
from collections.abc import Callable, Container
from typing import Final

from firmware_interface.board_checks import STOPPED, check_effect, refusal
from firmware_interface.board_hold import POLL_S, STALL_S, USED, Hold
from firmware_interface.board_types import BoardStatus
from firmware_interface.codec import encode
from firmware_interface.errors import (
    BoardError,
    EdgeIdentError,
    LinkError,
    NoReplyError,
    OvertakenError,
    RestartedError,
    StoppedError,
)
from firmware_interface.link import Link
from firmware_interface.registers import REGISTERS, SESSION_LEASE_S, Opcode, Result, State

COMMAND_TIMEOUT_S: Final = 0.5
REST_TIMEOUT_S: Final = 10.0
_TOKEN_LEAP: Final = 128
_TOKEN_SPREAD: Final = 640
"""Sixty-four leaps, and so all that a board remembers, do not go once around all tokens."""
_NEEDS_NO_HOLD: Final = frozenset({Opcode.QUICK_STOP})
_ENDS_WHAT_BEGAN: Final = frozenset({Opcode.START, Opcode.CONFIRM})
"""Commands that a host which has lost its hold must not send: what it armed or committed may be
another host's by now."""
_TIDIES_UP: Final = frozenset({Opcode.DISABLE, Opcode.ROLL_BACK})
"""Commands by which a host that was stopped leaves the board as it found it, as a new host."""
_LATE_DOES_NOTHING: Final = _NEEDS_NO_HOLD | _ENDS_WHAT_BEGAN | {Opcode.COMMIT_RUNNING}
"""Commands that find nothing to do after the stop that follows when they get lost; or gains that
the board takes back by itself."""


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
                self._stopped = USED if self._may_have_run_out else STOPPED
        return status

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
                    check_effect(opcode, status)
                return status
            if status.last_result is Result.NOT_HELD:
                self._hold_again(opcode, status)
            elif status.last_result is not Result.NOT_AT_REST:
                raise refusal(opcode, status)
            if time.monotonic() > deadline:
                raise refusal(opcode, status)
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
            except StoppedError:
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
            raise refusal(opcode, refused)
        else:
            self.claim()

    def _begin_anew(self) -> None:
        """Hold the board as a new host, which was not stopped, to tidy up; no more than that."""
        stopped, self._stopped, self._claimed = self._stopped or STOPPED, "", False
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
        try:
            status = self._poll(
                lambda status: status.last_token == self._token, COMMAND_TIMEOUT_S, lost
            )
        except EdgeIdentError as error:
            let_go = opcode in _LATE_DOES_NOTHING or self._disown()
            if error is lost and self._token_seen != before:
                raise OvertakenError(opcode.name) from error
            if error is not lost or let_go:
                raise
            raise LinkError(
                f"{opcode.name} did not reach the board so far, and may still do so",
                f"wait {SESSION_LEASE_S:g} s, then see with edge-ident doctor whether the effort "
                "is on",
            ) from error
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
                STALL_S,
                stalled,
            )
        if status.last_token != self._token:
            raise OvertakenError(opcode.name)
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

"""The virtual board as a link: in-process, or behind a server."""

import time
from dataclasses import replace
from typing import Final, Protocol

from firmware_interface import codec, errors
from firmware_interface.plant.feed_drive import feed_drive
from firmware_interface.plant.plant import Plant
from firmware_interface.registers import REGISTERS, Fault, State
from firmware_interface.virtual import commands, drive, register_file
from firmware_interface.virtual.machine import Inputs, Machine
from firmware_interface.virtual.settings import BoardSettings

# How board time passes: with the wall clock, or as fast as requests come.

_STRETCH: Final = 112
# Longest work before a request: less than a page's worth, so that a host that asks page by page
# outruns a board that is behind.
_REQUEST_SHARE_S: Final = 0.001
_IDLE_SHARE_S: Final = 0.004
_LARGEST_BACKLOG: Final = 100
# Longest time that passes on the board between two looks at the clock.
_LONGEST_STEP_S: Final = 0.05


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
        self._due += (passed_s - self._passed_s) * self._speed / drive.SAMPLE_PERIOD_S
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
        return self._samples * drive.SAMPLE_PERIOD_S

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


_STATE: Final = REGISTERS["status.state"].address
_IDENTIFIED: Final = REGISTERS["identification.state"].address
_COMMAND: Final = REGISTERS["command.opcode"].address
_COMMAND_WORDS: Final = REGISTERS["command.key"].address + 2 - _COMMAND
_RELEASE, _KEY, _ACKNOWLEDGED = "session.release", "session.key", "capture.pages_acknowledged"
_WATCHDOG: Final = ("watchdog.timeout", "watchdog.action")


class VirtualBoard:
    """A board without hardware; satisfies the Link protocol.

    Parameters
    ----------
    settings : BoardSettings, optional
    clock : Clock, optional
        By default requests let board time pass.
    plant : Plant, optional
        The drive behind the board; by default a sound one.
    identifier : Identifier, optional
        The board's own network; by default it has none.

    Attributes
    ----------
    inputs : Inputs
        What is wired to the board: to press its emergency stop and its limit switches.
    machine : Machine
        For whoever wants to look inside.
    """

    def __init__(
        self,
        settings: BoardSettings | None = None,
        clock: Clock | None = None,
        plant: Plant | None = None,
        identifier: register_file.Identifier | None = None,
    ) -> None:
        self._clock = clock or RequestClock()
        self._identifier = identifier
        settings = settings or BoardSettings()
        self.inputs = Inputs(settings.homed, settings.switches_rad)
        self._power_up(settings, plant or Plant(feed_drive()))

    def read(self, address: int, count: int) -> list[int]:
        """Words of consecutive registers."""
        self._clock.advance(self.machine, address <= _STATE < address + count)
        commands.publish(self._registers, self.machine, self._commands)
        if address <= _IDENTIFIED < address + count:
            self.machine.identification.asked()
        return self._registers.host_read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        """Write consecutive registers: all of them take effect, or none."""
        self._clock.advance(self.machine, False)
        commands.publish(self._registers, self.machine, self._commands)
        command = address < _COMMAND + _COMMAND_WORDS and address + len(words) > _COMMAND
        if command and (address != _COMMAND or len(words) != _COMMAND_WORDS):
            raise errors.BoardError(
                "a command has no token, argument or key",
                "write opcode, token, argument and key in one write",
            )
        self._registers.check_write(address, words)
        written = {
            name: codec.decode_integer(name, words, address)
            for name in (_RELEASE, _KEY, _ACKNOWLEDGED, *_WATCHDOG)
            if address <= REGISTERS[name].address < address + len(words)
        }
        self._check_value(written)
        self._check_time(written)
        self._registers.put_words(address, words)
        self.machine.banks.check_staged()
        self._take(written)
        if command:
            self._commands.command(
                *(
                    codec.decode_integer(f"command.{name}", words, address)
                    for name in ("opcode", "token", "argument", "key")
                )
            )

    def close(self) -> None:
        """Nothing to let go of."""

    def power_cycle(self) -> None:
        """Cut the power and bring it back: stored gains stay, and the axes go on as they moved."""
        banks = self.machine.banks
        stored = replace(self._settings, gains=banks.stored, stores=banks.stores, fault=Fault.NONE)
        self.inputs.rearm_stop()
        self._power_up(stored, self.machine.drive.plant)

    def idle(self) -> None:
        """Let time pass while no request comes; for servers."""
        self._clock.idle(self.machine)

    def _power_up(self, settings: BoardSettings, plant: Plant) -> None:
        self._settings = settings
        self._registers = register_file.RegisterFile(settings.map_version)
        commands.fill(self._registers, settings)
        self.machine = Machine(
            self._registers, settings, self._clock.now_s, plant, self.inputs, self._identifier
        )
        self._commands = commands.Commands(self.machine, self._registers, settings)

    # ---- registers that do something

    def _check_value(self, written: dict[str, int]) -> None:
        """Make sure that the values make sense."""
        if written.get(_KEY) == register_file.FREE:
            raise errors.ValueRefusedError("the session key 0 is refused", "choose another number")
        pages = self.machine.capture.pages_written
        if written.get(_ACKNOWLEDGED, 0) > pages:
            raise errors.ValueRefusedError(
                f"{written[_ACKNOWLEDGED]} pages acknowledged of {pages} written",
                "install the same release on board and host",
            )

    def _check_time(self, written: dict[str, int]) -> None:
        """Make sure that now is the time for it."""
        session = self.machine.session
        heartbeat = _ACKNOWLEDGED in written
        if _KEY in written and not session.may_claim(written[_KEY], heartbeat=heartbeat):
            raise errors.BusyError(
                f"another host controls the board, for {session.remaining_s:.1f} s more, or has "
                "stopped this one",
                "wait until it is finished, or stop it with edge-ident stop",
            )
        leaves = written.get(_RELEASE, register_file.FREE) == session.key != register_file.FREE
        if leaves and self.machine.busy:
            raise errors.BusyError(
                "an axis moves: the controlling host cannot change", "stop the motion first"
            )
        # from ARM on: the host reads what it must keep up with before START
        guarded = self.machine.in_motion or self.machine.state in (State.CHECKING, State.ARMED)
        if guarded and any(name in written for name in _WATCHDOG):
            raise errors.BusyError(
                "the watchdog cannot be changed during a motion", "stop the motion first"
            )

    def _take(self, written: dict[str, int]) -> None:
        session = self.machine.session
        if written.get(_RELEASE, register_file.FREE) == session.key != register_file.FREE:
            session.release()
        if _KEY in written:
            if self.machine.state is State.ARMED and session.key != written[_KEY]:
                self.machine.state = State.IDLE  # what is armed is its host's
            session.heard(written[_KEY])
        if _ACKNOWLEDGED in written:
            self.machine.capture.acknowledge(written[_ACKNOWLEDGED])

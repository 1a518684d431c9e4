"""The virtual board as a link: in-process, or behind a server."""

import secrets
from dataclasses import replace

from firmware_interface.codec import decode_integer, encode, encode_axis_gains
from firmware_interface.errors import BoardError
from firmware_interface.registers import (
    AXES,
    FLOAT_TEST,
    MAGIC,
    MAP_VERSION,
    REGISTERS,
    Fault,
    WatchdogAction,
)
from firmware_interface.virtual.clock import Clock, RequestClock
from firmware_interface.virtual.drive import (
    CONTROL_DELAY_S,
    EFFORT_PER_COUNT_NM,
    SAMPLE_PERIOD_S,
    machine_at_rest,
)
from firmware_interface.virtual.feed_drive import COUNTS_PER_TURN
from firmware_interface.virtual.machine import Machine
from firmware_interface.virtual.plant import Plant
from firmware_interface.virtual.register_file import RegisterFile
from firmware_interface.virtual.settings import BoardSettings

_FIRMWARE_VERSION = 0x0100
_COMMAND_ADDRESS = REGISTERS["command.opcode"].address
_COMMAND_WORDS = 4
_CLOCK_RANGE = 2**32


class VirtualBoard:
    """A board without hardware; satisfies the Link protocol.

    Parameters
    ----------
    settings : BoardSettings, optional
    clock : Clock, optional
        By default every request lets a stretch of board time pass.

    Attributes
    ----------
    machine : Machine
        For whoever wants to look inside.
    """

    def __init__(self, settings: BoardSettings | None = None, clock: Clock | None = None) -> None:
        self._clock = clock or RequestClock()
        self._power_up(settings or BoardSettings(), machine_at_rest())

    def read(self, address: int, count: int) -> list[int]:
        """Words of consecutive registers."""
        self._pass_time()
        return self._registers.host_read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        """Write consecutive registers; a command is complete or refused."""
        self._pass_time()
        if address <= _COMMAND_ADDRESS + _COMMAND_WORDS - 1 and address + len(words) > (
            _COMMAND_ADDRESS
        ):
            if address != _COMMAND_ADDRESS or len(words) != _COMMAND_WORDS:
                raise BoardError(
                    "a command comes without token or argument",
                    "write opcode, token and argument in one write",
                )
            self._registers.host_write(address, words)
            self._command(words)
        else:
            self._registers.host_write(address, words)

    def close(self) -> None:
        """Nothing to let go of."""

    def power_cycle(self) -> None:
        """Cut the power and bring it back: stored gains stay, and the axes go on as they moved."""
        stored = replace(self._settings, gains=self.machine.banks.stored, fault=Fault.NONE)
        self._power_up(stored, self.machine.drive.plant)

    def idle(self) -> None:
        """Let time pass while no request comes; for servers."""
        self._clock.idle(self.machine)

    def _power_up(self, settings: BoardSettings, plant: Plant) -> None:
        self._settings = settings
        self._registers = RegisterFile()
        self._fill(settings)
        self.machine = Machine(self._registers, settings, self._clock.now_s, plant)

    def _pass_time(self) -> None:
        self._clock.advance(self.machine)
        self.machine.frame_seen()
        self._publish()

    def _command(self, words: list[int]) -> None:
        opcode, token, argument = (
            decode_integer(f"command.{name}", words, _COMMAND_ADDRESS)
            for name in ("opcode", "token", "argument")
        )
        self.machine.command(opcode, token, argument)

    def _publish(self) -> None:
        """Put the status where the host reads it."""
        machine, banks = self.machine, self.machine.banks
        values = {
            "state": machine.state,
            "fault_code": machine.fault,
            "fault_sample": machine.fault_sample % _CLOCK_RANGE,
            "sto_active": 0,
            "last_token": machine.last_token,
            "last_result": machine.last_result,
            "staged_crc_ok": banks.staged_crc_ok,
            "unconfirmed": banks.unconfirmed,
            "confirm_remaining": banks.remaining_s(self._clock.now_s()),
            "board_clock": machine.samples % _CLOCK_RANGE,
        }
        words = [word for name, value in values.items() for word in encode(f"status.{name}", value)]
        self._registers.put_words(REGISTERS["status.state"].address, words)
        machine.capture.publish()

    def _fill(self, settings: BoardSettings) -> None:
        """Registers that stay as they are, and defaults."""
        identity = {
            "magic": MAGIC,
            "map_version": MAP_VERSION,
            "firmware_version": _FIRMWARE_VERSION,
            "map_crc": settings.map_crc,
            "serial_number": settings.serial_number,
            "float_test": FLOAT_TEST,
            "nonce": secrets.randbits(32),
            "sample_period": SAMPLE_PERIOD_S,
            "control_delay": CONTROL_DELAY_S,
            "counts_per_turn": COUNTS_PER_TURN,
            "effort_per_count": EFFORT_PER_COUNT_NM,
        }
        for name, value in identity.items():
            self._registers.put(f"identity.{name}", value)
        self._registers.put("watchdog.timeout", 1.0)
        self._registers.put("watchdog.action", WatchdogAction.QUICK_STOP)
        for axis in AXES:
            self._fill_limits(axis, settings)

    def _fill_limits(self, axis: str, settings: BoardSettings) -> None:
        limits = settings.limits[axis]
        values = {
            "travel": limits.travel_rad,
            "speed": limits.speed_rad_s,
            "effort": limits.effort_nm,
            "following_error": limits.following_error_rad,
            "gain_step": limits.gain_step,
        }
        for name, value in values.items():
            self._registers.put(f"limits.{axis}.{name}", value)
        self._registers.put_words(
            REGISTERS[f"gain_maximum.{axis}.proportional"].address,
            encode_axis_gains(limits.gain_maximum),
        )

"""What the board tells of itself: identity and limits once, status before every request."""

import secrets

from firmware_interface.gain_words import bank_spans, encode_gains
from firmware_interface.plant.feed_drive import COUNTS_PER_TURN
from firmware_interface.registers import (
    AXES,
    FLOAT_TEST,
    MAGIC,
    State,
    WatchdogAction,
)
from firmware_interface.virtual.commands import Commands
from firmware_interface.virtual.drive import (
    CONTROL_DELAY_S,
    EFFORT_PER_COUNT_NM,
    SAMPLE_PERIOD_S,
)
from firmware_interface.virtual.machine import Machine
from firmware_interface.virtual.register_file import RegisterFile
from firmware_interface.virtual.settings import BoardSettings

_FIRMWARE_VERSION = 0x0200
_CLOCK_RANGE = 2**32


def fill(registers: RegisterFile, settings: BoardSettings) -> None:
    """Registers that stay as they are, and defaults."""
    values = {
        "identity.magic": MAGIC,
        "identity.map_version": settings.map_version,
        "identity.firmware_version": _FIRMWARE_VERSION,
        "identity.map_crc": settings.claimed_crc,
        "identity.serial_number": settings.serial_number,
        "identity.float_test": FLOAT_TEST,
        "identity.nonce": secrets.randbits(32),
        "identity.sample_period": SAMPLE_PERIOD_S,
        "identity.control_delay": CONTROL_DELAY_S,
        "identity.counts_per_turn": COUNTS_PER_TURN,
        "identity.effort_per_count": EFFORT_PER_COUNT_NM,
        "watchdog.timeout": 1.0,
        "watchdog.action": WatchdogAction.QUICK_STOP,
    }
    for name, value in values.items():
        registers.put(name, value)
    for axis in AXES:
        _fill_limits(registers, axis, settings)


def _fill_limits(registers: RegisterFile, axis: str, settings: BoardSettings) -> None:
    limits = settings.limits[axis]
    values = {
        "travel": limits.travel_rad,
        "speed": limits.speed_rad_s,
        "acceleration": limits.acceleration_rad_s2,
        "effort": limits.effort_nm,
        "following_error": limits.following_error_rad,
        "gain_step": limits.gain_step,
    }
    for name, value in values.items():
        registers.put(f"limits.{axis}.{name}", value)
    registers.put(f"bumpless.{axis}.jump_limit", limits.effort_jump_nm)
    registers.put(f"stated.{axis}.inertia", limits.inertia)
    registers.put(f"stated.{axis}.viscous_friction", limits.viscous_friction)
    version = settings.map_version
    registers.put_spans(
        bank_spans("gain_maximum", version, (axis,)),
        encode_gains({axis: limits.gain_maximum}, version),
    )


def publish(registers: RegisterFile, machine: Machine, commands: Commands) -> None:
    """Put the status where the host reads it."""
    banks, inputs, session = machine.banks, machine.inputs, machine.session
    checking = machine.check if machine.state is State.CHECKING else None
    values: dict[str, float] = {
        "status.state": machine.state,
        "status.fault_code": machine.fault,
        "status.fault_sample": machine.fault_sample % _CLOCK_RANGE,
        "status.sto_active": inputs.sto_active,
        "status.last_token": commands.last_token,
        "status.last_result": commands.last_result,
        "status.staged_crc_ok": banks.staged_crc_ok,
        "status.unconfirmed": banks.unconfirmed,
        "status.confirm_remaining": banks.remaining_s(machine.now_s()),
        "status.board_clock": machine.samples % _CLOCK_RANGE,
        "status.enabled": machine.enabled,
        "status.homed": inputs.homed,
        "status.limit_switches": inputs.limit_switches,
        "status.brake_released": machine.enabled,
        "status.sto_latched": inputs.sto_latched,
        "status.samples_to_check": checking.remaining if checking else 0,
        "status.stores": banks.stores,
        "session.remaining": session.remaining_s,
        "session.key": session.key,
    }
    drive = machine.drive
    for axis, position, speed in zip(AXES, drive.position_rad, drive.speed_rad_s, strict=True):
        values[f"measured.{axis}.position"] = position
        values[f"measured.{axis}.speed"] = speed
    values["bumpless.capable"] = machine.handover.capable
    for axis, jump in zip(AXES, machine.handover.jumps_nm, strict=True):
        values[f"bumpless.{axis}.jump"] = jump
    for name, value in values.items():
        registers.put(name, value)
    machine.capture.publish()

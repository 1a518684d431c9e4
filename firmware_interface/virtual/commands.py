"""What hosts ask of the board, and what becomes of it."""

import secrets
from collections import deque
from typing import Final

from firmware_interface import codec, control_law, gains
from firmware_interface.plant.feed_drive import COUNTS_PER_TURN
from firmware_interface.registers import (
    AXES,
    FLOAT_TEST,
    MAGIC,
    STORE_SIGNATURE,
    Fault,
    Opcode,
    Result,
    State,
    WatchdogAction,
)
from firmware_interface.virtual import setpoints
from firmware_interface.virtual.drive import CONTROL_DELAY_S, EFFORT_PER_COUNT_NM, SAMPLE_PERIOD_S
from firmware_interface.virtual.machine import Machine
from firmware_interface.virtual.register_file import FREE, RegisterFile
from firmware_interface.virtual.settings import BoardSettings

_TOKENS_REMEMBERED: Final = 64
_GAIN_COMMANDS: Final = frozenset({Opcode.COMMIT, Opcode.CONFIRM, Opcode.ROLL_BACK, Opcode.STORE})


class Commands:
    """Carries out or refuses commands, each token once.

    Parameters
    ----------
    machine : Machine
    registers : RegisterFile
    settings : BoardSettings

    Attributes
    ----------
    last_token : int
        Of the last command carried out or refused.
    """

    def __init__(self, machine: Machine, registers: RegisterFile, settings: BoardSettings) -> None:
        self._machine = machine
        self._registers = registers
        self._settings = settings
        self._tokens: deque[int] = deque(maxlen=_TOKENS_REMEMBERED)
        self._result = Result.NONE
        self._opcode = 0
        self.last_token = 0

    @property
    def last_result(self) -> Result:
        """What became of it: of ARM once the check, of COMMIT_RUNNING once a sample decided it."""
        check, state = self._machine.check, self._machine.state
        if self._result is not Result.PENDING:
            return self._result
        if self._opcode == Opcode.COMMIT_RUNNING:
            self._result = self._machine.handover.result
        elif check and state is not State.CHECKING:
            if state is State.ARMED:
                self._result = Result.DONE
            else:
                self._result = Result.WRONG_STATE if check.passed else Result.TRAJECTORY_LIMITS
        return self._result

    def command(self, opcode: int, token: int, argument: int, key: int) -> None:
        """Carry out or refuse a command; a token seen before is ignored."""
        # the host repeats a command whose reply it lost: done once is enough
        if token in self._tokens:
            return
        self._tokens.append(token)
        self.last_token = token
        held = key != FREE and key == self._machine.session.key
        if held:
            self._machine.session.heard(key)
        if opcode == Opcode.QUICK_STOP:
            self._machine.session.stopped_by(key)
        # anybody may stop the machine, whoever holds the board
        if held or opcode == Opcode.QUICK_STOP:
            if self._machine.handover.offered is not None:  # no sample has decided it: too late
                self._machine.handover.end(Result.WRONG_STATE)
            self._result, self._opcode = self._execute(opcode, argument), opcode
        else:
            self._result = Result.NOT_HELD

    def _execute(self, opcode: int, argument: int) -> Result:
        match opcode:
            case Opcode.QUICK_STOP:
                return self._quick_stop()
            case Opcode.ENABLE:
                return self._enable()
            case Opcode.DISABLE:
                return self._disable()
            case Opcode.ARM:
                return self._arm(argument)
            case Opcode.START:
                return self._start(argument)
            case Opcode.FINISH:
                return self._finish()
            case Opcode.CLEAR_FAULT:
                return self._clear_fault()
            case Opcode.COMMIT_RUNNING:
                return self._commit_running(argument)
        if opcode in _GAIN_COMMANDS:
            return self._gain_command(opcode, argument)
        return Result.UNKNOWN_COMMAND

    # ---- effort

    def _enable(self) -> Result:
        machine = self._machine
        if machine.state is not State.IDLE:
            return Result.WRONG_STATE
        if machine.enabled:
            return Result.DONE
        if machine.inputs.sto_latched:
            return Result.STO_ACTIVE
        if machine.moving:
            return Result.NOT_AT_REST
        machine.switch_on()
        return Result.DONE

    def _disable(self) -> Result:
        machine = self._machine
        if machine.state is State.FAULT:
            return Result.DONE
        if machine.state not in (State.IDLE, State.ARMED, State.DONE, State.STOPPING):
            return Result.WRONG_STATE
        # an axis without effort coasts: it is brought to rest first, and the host asks again
        if machine.moving:
            machine.bring_to_rest()
            return Result.NOT_AT_REST
        machine.switch_off()
        if machine.state is State.ARMED:
            machine.state = State.IDLE
        return Result.DONE

    # ---- motion

    def _arm(self, crc: int) -> Result:
        machine = self._machine
        if machine.state is not State.IDLE:
            return Result.WRONG_STATE
        if not machine.enabled:
            return Result.NOT_ENABLED
        if machine.moving:
            return Result.NOT_AT_REST
        words = self._registers.words(setpoints.TRAJECTORY_ADDRESS, setpoints.TRAJECTORY_WORDS)
        # the CRC is the host's word for what it wrote, in however many pieces
        trajectory = setpoints.read_trajectory(words) if codec.crc32(words) == crc else None
        if trajectory is None:
            return Result.BAD_TRAJECTORY
        machine.check = setpoints.TrajectoryCheck(
            trajectory,
            machine.rest_rad,
            self._settings.limits,
            machine.banks.active,
            machine.drive.memories,
        )
        machine.state = State.CHECKING
        return Result.PENDING

    def _start(self, argument: int) -> Result:
        machine = self._machine
        if machine.state is State.IDLE and not machine.enabled:
            return Result.NOT_ENABLED
        if machine.state is not State.ARMED or machine.check is None:
            return Result.WRONG_STATE
        if argument != self._settings.claimed_crc:
            return Result.WRONG_ARGUMENT
        machine.follow(machine.check.trajectory)
        machine.identification.begin(self.last_token)
        return Result.DONE

    def _quick_stop(self) -> Result:
        machine = self._machine
        machine.roll_back_due = machine.banks.unconfirmed
        if machine.roll_back_due and not machine.moving:
            machine.roll_back()
        if machine.state in (State.CHECKING, State.ARMED, State.DONE):
            machine.state = State.IDLE
        elif machine.state is State.DRAINING:
            machine.stop()
        machine.bring_to_rest()
        return Result.DONE

    def _finish(self) -> Result:
        if self._machine.state is not State.DONE:
            return Result.WRONG_STATE
        self._machine.state = State.IDLE
        return Result.DONE

    def _clear_fault(self) -> Result:
        machine = self._machine
        if machine.state is not State.FAULT or machine.fault is Fault.SELF_TEST:
            return Result.WRONG_STATE
        if machine.inputs.sto_active:
            return Result.STO_ACTIVE
        if machine.moving:
            return Result.NOT_AT_REST
        machine.clear_fault()
        return Result.DONE

    # ---- gains

    def _commit_running(self, crc: int) -> Result:
        machine = self._machine
        if not machine.handover.capable:
            return Result.UNKNOWN_COMMAND
        if machine.takes_gains is not Result.DONE:
            return machine.takes_gains
        staged = self._staged(crc)
        if isinstance(staged, Result):
            return staged
        machine.handover.offer(staged)
        return Result.PENDING

    def _staged(self, crc: int) -> gains.Bank | Result:
        """The bank that the host means, where its feedback is stable."""
        staged = self._machine.banks.staged(crc)
        if isinstance(staged, Result):
            return staged
        for axis, limits in self._settings.limits.items():
            if limits.inertia > 0.0 and not control_law.feedback_stable(
                staged[axis],
                limits.inertia,
                limits.viscous_friction,
                period_s=SAMPLE_PERIOD_S,
                control_delay_s=CONTROL_DELAY_S,
            ):
                return Result.UNSTABLE_FEEDBACK
        return staged

    def _gain_command(self, opcode: int, argument: int) -> Result:
        machine = self._machine
        if opcode == Opcode.ROLL_BACK and machine.state is State.STOPPING:
            return Result.NOT_AT_REST
        if machine.state is not State.IDLE:
            return Result.WRONG_STATE
        if machine.moving:
            if opcode == Opcode.ROLL_BACK:
                machine.bring_to_rest()
            return Result.NOT_AT_REST
        if opcode == Opcode.COMMIT:
            staged = self._staged(argument)
            return staged if isinstance(staged, Result) else machine.commit(staged)
        if opcode == Opcode.CONFIRM:
            return machine.banks.confirm()
        if opcode == Opcode.ROLL_BACK:
            return machine.roll_back()
        return machine.banks.store() if argument == STORE_SIGNATURE else Result.WRONG_ARGUMENT


# What the board tells of itself: identity and limits once, status before every request.

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
        gains.bank_spans("gain_maximum", version, (axis,)),
        gains.encode_gains({axis: limits.gain_maximum}, version),
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

"""What hosts ask of the board, and what becomes of it."""

from collections import deque
from typing import Final

from firmware_interface.codec import crc32
from firmware_interface.feedback import feedback_stable
from firmware_interface.gains import Bank
from firmware_interface.registers import (
    STORE_SIGNATURE,
    Fault,
    Opcode,
    Result,
    State,
)
from firmware_interface.virtual.drive import CONTROL_DELAY_S, SAMPLE_PERIOD_S
from firmware_interface.virtual.machine import Machine
from firmware_interface.virtual.register_file import RegisterFile
from firmware_interface.virtual.session import FREE
from firmware_interface.virtual.settings import BoardSettings
from firmware_interface.virtual.trajectory_check import (
    TRAJECTORY_ADDRESS,
    TRAJECTORY_WORDS,
    TrajectoryCheck,
    read_trajectory,
)

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
        if token in self._tokens:
            return
        self._tokens.append(token)
        self.last_token = token
        held = key != FREE and key == self._machine.session.key
        if held:
            self._machine.session.heard(key)
        if opcode == Opcode.QUICK_STOP:
            self._machine.session.stopped_by(key)
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
        words = self._registers.words(TRAJECTORY_ADDRESS, TRAJECTORY_WORDS)
        trajectory = read_trajectory(words) if crc32(words) == crc else None
        if trajectory is None:
            return Result.BAD_TRAJECTORY
        machine.check = TrajectoryCheck(
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

    def _staged(self, crc: int) -> Bank | Result:
        """The bank that the host means, where its feedback is stable."""
        staged = self._machine.banks.staged(crc)
        if isinstance(staged, Result):
            return staged
        for axis, limits in self._settings.limits.items():
            if limits.inertia > 0.0 and not feedback_stable(
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

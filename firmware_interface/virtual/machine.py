"""The board's state machine: control samples, commands, limits, watchdog.

Time comes from outside: `sample` lets one control period pass, and `now_s` is the clock of
watchdog and confirm window.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import astuple
from typing import Final

from firmware_interface.board_types import AxisLimits
from firmware_interface.codec import decode_trajectory
from firmware_interface.motion import Multisine, Trajectory
from firmware_interface.registers import (
    AXES,
    PAGE_ADDRESS,
    STORE_SIGNATURE,
    Fault,
    Opcode,
    Result,
    State,
    WatchdogAction,
)
from firmware_interface.virtual.capture_ring import CaptureRing
from firmware_interface.virtual.drive import RAD_PER_COUNT, SAMPLE_PERIOD_S, Drive, DriveSample
from firmware_interface.virtual.gain_banks import GainBanks
from firmware_interface.virtual.plant import Plant
from firmware_interface.virtual.register_file import RegisterFile
from firmware_interface.virtual.setpoints import SetpointGenerator, within_limits
from firmware_interface.virtual.settings import BoardSettings

_TOKENS_REMEMBERED: Final = 64
_MOTION: Final = frozenset({State.MOVING, State.DRAINING, State.STOPPING})


class Machine:
    """Everything of the board but its clock and its wire.

    Parameters
    ----------
    registers : RegisterFile
    settings : BoardSettings
    now_s : callable
    plant : Plant
    """

    def __init__(
        self,
        registers: RegisterFile,
        settings: BoardSettings,
        now_s: Callable[[], float],
        plant: Plant,
    ) -> None:
        self.state = State.INIT
        self.fault = settings.fault
        self.fault_sample = 0
        self.samples = 0
        self.last_token = 0
        self.last_result = Result.NONE
        self.banks = GainBanks(registers, settings.gains, settings.limits)
        self.capture = CaptureRing(registers)
        self.drive = Drive(self.banks.active, settings.limits, plant)
        self._registers = registers
        self._settings = settings
        self._limits: list[AxisLimits] = [settings.limits[axis] for axis in AXES]
        self._now_s = now_s
        self._last_frame_s = now_s()
        self._tokens: deque[int] = deque(maxlen=_TOKENS_REMEMBERED)
        self._setpoints = SetpointGenerator(self.drive.position_rad)
        self._trajectory: Trajectory | None = None
        self._until_capture = 0
        self._to_capture = 0
        self._roll_back_due = False

    @property
    def moving(self) -> bool:
        """An axis moves or is about to."""
        return self._setpoints.moving or not self.drive.at_rest

    # ---- time

    def sample(self) -> None:
        """Let one control period pass."""
        self.samples += 1
        self._check_watchdog()
        measured = self.drive.sample(self._setpoints.advance())
        if self.drive.powered:
            self._check_limits(measured)
        if self.state is State.MOVING:
            self._capture_sample(measured)
        self._follow_up()
        if self.banks.unconfirmed and self.banks.remaining_s(self._now_s()) == 0.0:
            self._roll_back_due = True
        if self._roll_back_due and not self.moving:
            self.roll_back()

    def frame_seen(self) -> None:
        """A valid frame arrived: the host is alive."""
        self._last_frame_s = self._now_s()

    def roll_back(self) -> Result:
        """Put the previous gains back."""
        self._roll_back_due = False
        result = self.banks.roll_back()
        self._exchange_gains()
        return result

    def _exchange_gains(self) -> None:
        """Put the active bank in force where the axes stand.

        Friction holds a resting axis off its setpoint; stiffer gains would pull it there at once.
        """
        self.drive.set_gains(self.banks.active)
        self._setpoints.hold(self.drive.position_rad)

    def _capture_sample(self, measured: DriveSample) -> None:
        if self._until_capture > 0:
            self._until_capture -= 1
            return
        self.capture.add(measured)
        if self.capture.samples == self._to_capture:
            self.capture.flush()
            self._setpoints.stop()
            self.state = State.DRAINING

    def _follow_up(self) -> None:
        """Leave states whose end has come."""
        if self.state is State.INIT:
            self.state = State.FAULT if self.fault else State.IDLE
            if not self.fault:
                self.drive.power_on()
        elif self.state is State.DRAINING and not self.moving and self.capture.drained:
            self.state = State.DONE
        elif self.state is State.STOPPING and not self.moving:
            self.state = State.FAULT if self.fault else State.IDLE
            if self.fault:
                self.drive.power_off()

    # ---- protection

    def _check_watchdog(self) -> None:
        if self.state not in _MOTION or self.fault or not self._setpoints.moving:
            return
        if self._now_s() - self._last_frame_s > self._registers.value("watchdog.timeout"):
            self._latch(Fault.WATCHDOG)
            if self._registers.integer("watchdog.action") == WatchdogAction.COAST:
                self._coast()
            else:
                self._stop()

    def _check_limits(self, measured: DriveSample) -> None:
        for limit, position, error, speed in zip(
            self._limits,
            measured.position,
            measured.following_error,
            self.drive.speed_rad_s,
            strict=True,
        ):
            fault = Fault.NONE
            if abs(position) * RAD_PER_COUNT > limit.travel_rad:
                fault = Fault.TRAVEL
            elif abs(error) * RAD_PER_COUNT > limit.following_error_rad:
                fault = Fault.FOLLOWING_ERROR
            elif abs(speed) > limit.speed_rad_s:
                fault = Fault.SPEED
            if fault:
                self._latch(fault)
                self._coast()
                return

    def _latch(self, fault: Fault) -> None:
        """The first fault stays until it is cleared."""
        self._roll_back_due = self.banks.unconfirmed
        if not self.fault:
            self.fault, self.fault_sample = fault, self.samples

    def _coast(self) -> None:
        self.drive.power_off()
        self._setpoints.hold(self.drive.position_rad)
        self.state = State.FAULT

    def _stop(self) -> None:
        self._setpoints.stop()
        self.state = State.STOPPING

    # ---- commands

    def command(self, opcode: int, token: int, argument: int) -> None:
        """Carry out or refuse a command; a token seen before is ignored."""
        if token in self._tokens:
            return
        self._tokens.append(token)
        self.last_token = token
        self.last_result = self._execute(opcode, argument)

    def _execute(self, opcode: int, argument: int) -> Result:
        match opcode:
            case Opcode.ARM:
                return self._arm()
            case Opcode.START:
                return self._start(argument)
            case Opcode.QUICK_STOP:
                return self._quick_stop()
            case Opcode.FINISH:
                return self._finish()
            case Opcode.CLEAR_FAULT:
                return self._clear_fault()
            case Opcode.COMMIT | Opcode.CONFIRM | Opcode.ROLL_BACK | Opcode.STORE:
                return self._gain_command(opcode, argument)
        return Result.UNKNOWN_COMMAND

    def _arm(self) -> Result:
        if self.state is not State.IDLE:
            return Result.WRONG_STATE
        if self.moving:
            return Result.NOT_AT_REST
        base = self._registers.address("trajectory.kind")
        words = self._registers.words(base, PAGE_ADDRESS - base)
        try:
            trajectory = decode_trajectory(words, base, SAMPLE_PERIOD_S)
        except ValueError:
            return Result.BAD_TRAJECTORY
        if not _complete(trajectory):
            return Result.BAD_TRAJECTORY
        rest = [setpoint.position_rad for setpoint in self._setpoints.current]
        if not within_limits(trajectory, rest, self._settings.limits):
            return Result.TRAJECTORY_LIMITS
        self._trajectory = trajectory
        self.state = State.ARMED
        return Result.DONE

    def _start(self, argument: int) -> Result:
        if self.state is not State.ARMED or self._trajectory is None:
            return Result.WRONG_STATE
        if argument != self._settings.map_crc:
            return Result.WRONG_ARGUMENT
        self.capture.clear()
        self._until_capture = round(self._trajectory.lead_in_s / SAMPLE_PERIOD_S)
        self._to_capture = round(self._trajectory.duration_s / SAMPLE_PERIOD_S)
        self._setpoints.follow(self._trajectory)
        self.state = State.MOVING
        return Result.DONE

    def _quick_stop(self) -> Result:
        self._roll_back_due = self.banks.unconfirmed
        if self._roll_back_due and not self.moving:
            self.roll_back()
        if self.state in (State.ARMED, State.DONE):
            self.state = State.IDLE
        elif self.state in (State.MOVING, State.DRAINING):
            self._stop()
        return Result.DONE

    def _finish(self) -> Result:
        if self.state is not State.DONE:
            return Result.WRONG_STATE
        self.state = State.IDLE
        return Result.DONE

    def _clear_fault(self) -> Result:
        if self.state is not State.FAULT:
            return Result.WRONG_STATE
        if self.moving:
            return Result.NOT_AT_REST
        self.fault, self.fault_sample = Fault.NONE, 0
        self._setpoints.hold(self.drive.position_rad)
        self.drive.power_on()
        self.state = State.IDLE
        return Result.DONE

    def _gain_command(self, opcode: int, argument: int) -> Result:
        if self.state is not State.IDLE:
            return Result.WRONG_STATE
        if self.moving:
            return Result.NOT_AT_REST
        if opcode == Opcode.COMMIT:
            result = self.banks.commit(self._now_s())
            if result is Result.DONE:
                self._exchange_gains()
            return result
        if opcode == Opcode.CONFIRM:
            return self.banks.confirm()
        if opcode == Opcode.ROLL_BACK:
            return self.roll_back()
        return self.banks.store() if argument == STORE_SIGNATURE else Result.WRONG_ARGUMENT


def _complete(trajectory: Trajectory) -> bool:
    """Whether every axis has a motion, with finite values."""
    for motion in trajectory.axes.values():
        if isinstance(motion, Multisine):
            values = [value for component in motion.components for value in astuple(component)]
        else:
            values = [*motion.speeds_rad_s, motion.dwell_s, motion.acceleration_rad_s2]
            if not (motion.speeds_rad_s and values[-2] >= 0.0 and values[-1] > 0.0):
                return False
        if not values or not all(map(math.isfinite, values)):
            return False
    return trajectory.lead_in_s > 0.0 and trajectory.duration_s > 0.0

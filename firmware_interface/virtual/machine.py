"""The board's state machine: what happens in a control sample, and what faults do.

Time comes from outside: `sample` lets one control period pass, and `now_s` is the clock of
watchdog, lease and confirm window. What hosts ask for stands in `commands.py`.
"""

import math
from collections.abc import Callable, Sequence
from typing import Final

from firmware_interface.board_types import AxisLimits
from firmware_interface.gains import MOST_LOSS, POSITIVE, SIGNED, AxisGains, Bank
from firmware_interface.motion import Trajectory
from firmware_interface.plant.plant import Plant
from firmware_interface.registers import AXES, Fault, Result, State, WatchdogAction
from firmware_interface.virtual import controller, register_file
from firmware_interface.virtual.drive import (
    EFFORT_PER_COUNT_NM,
    RAD_PER_COUNT,
    SAMPLE_PERIOD_S,
    Drive,
    DriveSample,
)
from firmware_interface.virtual.setpoints import Handover, SetpointGenerator, TrajectoryCheck
from firmware_interface.virtual.settings import BoardSettings, GainBanks

# What is wired to the board: emergency stop, limit switches, reference marks.


class Inputs:
    """The port layer's inputs; tests press and release them.

    Parameters
    ----------
    homed : int
        Bit n: axis n counts from the machine's reference mark.
    switches_rad : float
        Distance from the machine's zero at which an axis presses its limit switches.

    Attributes
    ----------
    sto_active : bool
        The wired emergency stop cuts the effort.
    sto_latched : bool
        It did so since the latch was re-armed, were it for less than a sample.
    pressed_by_hand : int
        Limit switches that are pressed wherever the axes stand, as `limit_switches`.
    """

    def __init__(self, homed: int = 0, switches_rad: float = math.inf) -> None:
        self.homed = homed
        self.sto_active = self.sto_latched = False
        self.pressed_by_hand = 0
        self._switches_rad = switches_rad
        self._reached = 0

    @property
    def limit_switches(self) -> int:
        """Bits 2n and 2n + 1: the switch at the negative and at the positive end of axis n."""
        return self.pressed_by_hand | self._reached

    def feel(self, output_rad: Sequence[float]) -> None:
        """The axes stand here."""
        self._reached = 0
        for axis, position in enumerate(output_rad):
            self._reached |= (position <= -self._switches_rad) << 2 * axis
            self._reached |= (position >= self._switches_rad) << 2 * axis + 1

    def press_stop(self) -> None:
        """Pull the wired emergency stop."""
        self.sto_active = self.sto_latched = True

    def release_stop(self) -> None:
        """Let go of it; the latch stays."""
        self.sto_active = False

    def rearm_stop(self) -> None:
        """Forget the pulses of before."""
        self.sto_latched = self.sto_active

    def bar(self, setpoints: Sequence[controller.Setpoint]) -> bool:
        """Whether a setpoint moves onto a switch that is pressed; away from it is allowed."""
        pressed = self.limit_switches
        return pressed != 0 and any(
            pressed >> 2 * axis & (1 if setpoint.velocity_rad_s < 0.0 else 2)
            for axis, setpoint in enumerate(setpoints)
            if setpoint.velocity_rad_s != 0.0
        )


_MOTION: Final = frozenset({State.MOVING, State.DRAINING, State.STOPPING})
# In which a stop brings the axes to rest: soft feedback needs less for a heavy axis.
_REST_SAMPLES_AFTER_RAMP: Final = round(2.0 / SAMPLE_PERIOD_S)
# States in which gains may be exchanged while the law acts.
_TAKES_GAINS: Final = frozenset({State.IDLE, State.DRAINING, State.DONE})


class Machine:
    """Everything of the board but its commands, its clock and its wire.

    Parameters
    ----------
    registers : RegisterFile
    settings : BoardSettings
    now_s : callable
    plant : Plant
    inputs : Inputs
    identifier : Identifier, optional
        The board's own network, if it has one.

    Attributes
    ----------
    check : TrajectoryCheck or None
        What ARM has still to look at, or has passed.
    handover : Handover
        Gains that a sample is to put in force.
    """

    def __init__(
        self,
        registers: register_file.RegisterFile,
        settings: BoardSettings,
        now_s: Callable[[], float],
        plant: Plant,
        inputs: Inputs,
        identifier: register_file.Identifier | None = None,
    ) -> None:
        self.state = State.INIT
        self.fault = settings.fault if settings_sound(settings) else Fault.SELF_TEST
        self.fault_sample = 0
        self.samples = 0
        self.now_s = now_s
        self.inputs = inputs
        self.session = register_file.Session(now_s)
        self.banks = GainBanks(registers, settings)
        self.handover = Handover([settings.limits[axis] for axis in AXES], settings.map_version)
        self.capture = register_file.CaptureRing(registers)
        self.identification = register_file.OwnIdentification(
            registers, settings.map_version, identifier
        )
        self.drive = Drive(self.banks.active, settings.limits, plant, inputs.homed)
        self.check: TrajectoryCheck | None = None
        self.roll_back_due = False
        self._restless = 0
        self._registers = registers
        self._limits: list[AxisLimits] = [settings.limits[axis] for axis in AXES]
        self._setpoints = SetpointGenerator(self.drive.position_rad)
        self._until_capture = 0
        self._to_capture = 0

    @property
    def moving(self) -> bool:
        """An axis moves or is about to."""
        return self._setpoints.moving or not self.drive.at_rest

    @property
    def in_motion(self) -> bool:
        """A motion runs or comes to its end; what guards it may not be changed."""
        return self._setpoints.moving or self.state in _MOTION

    @property
    def busy(self) -> bool:
        """Too much goes on for a host to lose the board."""
        return self.moving or self.in_motion or self.state is State.CHECKING

    @property
    def enabled(self) -> bool:
        """The control law may command effort."""
        return self.drive.powered

    @property
    def rest_rad(self) -> list[float]:
        """Where the axes are held, by axis."""
        return [setpoint.position_rad for setpoint in self._setpoints.current]

    # ---- time

    def sample(self) -> None:
        """Let one control period pass."""
        self.samples += 1
        self._look_around()
        if not self.enabled:
            self._setpoints.hold(self.drive.position_rad)
        self._setpoints.advance()
        if self.handover.offered is not None:
            self._hand_over(self.handover.offered)
        measured = self.drive.sample(self._setpoints.current)
        if self.enabled:
            self._protect(measured)
        if self.state is State.MOVING:
            self._capture_sample(measured)
        else:
            self.identification.stopped()
        if self.state is State.CHECKING and self.check:
            self.check.go_on()
        self._end_stop()
        self._follow_up()
        if self._sign_of_life_owed or self.state is State.CHECKING:
            self.session.keep()
        self._take_back()

    def _take_back(self) -> None:
        """Roll back what nobody has confirmed, once the axes stand or have no effort."""
        if self.banks.expired(self.now_s()):
            self.roll_back_due = True
        if self.roll_back_due and (not self.moving or not self.enabled):
            self.roll_back()

    def roll_back(self) -> Result:
        """Put the previous gains back; what was armed was checked with those that go."""
        self.roll_back_due = False
        result = self.banks.roll_back()
        self.drive.set_gains(self.banks.active)
        # friction holds a resting axis off its setpoint; stiffer gains would pull it there at once
        self._setpoints.hold(self.drive.position_rad)
        if self.state in (State.CHECKING, State.ARMED):
            self.state = State.IDLE
        return result

    @property
    def takes_gains(self) -> Result:
        """Whether gains may be exchanged while the law acts."""
        if self.state not in _TAKES_GAINS or self.fault or self.roll_back_due:
            return Result.WRONG_STATE
        return Result.DONE if self.enabled else Result.NOT_ENABLED

    def _hand_over(self, gains: Bank) -> None:
        """Put the gains on offer in force in the sample that comes, or leave all as it is."""
        if self.takes_gains is not Result.DONE or self.banks.unconfirmed:
            self.handover.end(Result.WRONG_STATE)
            return
        moving = self.state is State.DRAINING and self.moving
        setpoints = self._setpoints.current
        transfer = self.handover.considered(self.drive, gains, setpoints, moving=moving)
        if transfer is not None:
            self._take_over(gains, transfer, moving=moving)

    def _take_over(self, gains: Bank, transfer: controller.Transfer, *, moving: bool) -> None:
        self.drive.take_over(transfer)
        self._setpoints.take_up(transfer.setpoints, moving=moving)
        self.banks.commit(self.now_s(), gains)

    def commit(self, gains: Bank) -> Result:
        """Put gains in force where the axes stand, or leave all as it is and say why."""
        if not self.enabled:  # nothing acts that could jump
            self.banks.commit(self.now_s(), gains)
            self.drive.set_gains(self.banks.active)
            return Result.DONE
        setpoints = self._setpoints.current
        transfer = self.handover.considered(self.drive, gains, setpoints, moving=False)
        if transfer is not None:
            self._take_over(gains, transfer, moving=False)
        return self.handover.result

    def _capture_sample(self, measured: DriveSample) -> None:
        if self._until_capture > 0:
            self._until_capture -= 1
            return
        self.capture.add(measured)
        self.identification.add(measured)
        if self.capture.samples == self._to_capture:
            self.capture.flush()
            self.identification.captured()
            self._setpoints.stop()
            self.state = State.DRAINING

    def _follow_up(self) -> None:
        """Leave states whose end has come."""
        if self.state is State.INIT:
            self.state = State.FAULT if self.fault else State.IDLE
        elif self.state is State.CHECKING and self.check and not self.check.remaining:
            self.state = State.ARMED if self.check.passed else State.IDLE
        elif self.state is State.DRAINING and not self.moving and self.capture.drained:
            self.state = State.DONE
        elif self.state is State.STOPPING and not self.moving:
            if self.fault:
                self.coast()
            else:
                self.state = State.IDLE

    # ---- effort

    def switch_on(self) -> None:
        """Release the brake and hold where the axes stand."""
        self._setpoints.hold(self.drive.position_rad)
        self.drive.power_on()

    def switch_off(self) -> None:
        """Apply the brake; no effort."""
        self.drive.power_off()
        self._setpoints.hold(self.drive.position_rad)

    # ---- motion

    def follow(self, trajectory: Trajectory) -> None:
        """Start the motion and its capture."""
        self.capture.clear()
        self._until_capture = round(trajectory.lead_in_s / SAMPLE_PERIOD_S)
        self._to_capture = round(trajectory.duration_s / SAMPLE_PERIOD_S)
        self._setpoints.follow(trajectory)
        self.state = State.MOVING

    def stop(self) -> None:
        """Decelerate to rest; an axis that is not there soon after the ramp loses its effort."""
        self._setpoints.stop()
        self.state = State.STOPPING
        self._restless = 0

    def bring_to_rest(self) -> None:
        """Stop where an axis moves, under effort, in a state that no motion ends."""
        stops = self.state in (State.DRAINING, State.STOPPING)
        if self.enabled and self.moving and not stops:
            self.stop()

    def _end_stop(self) -> None:
        """Cut the effort where an axis still moves some time after the ramp of a stop.

        Gains that are to go back wait no longer for rest either.
        """
        stops = self.state in (State.DRAINING, State.STOPPING)
        stops = stops or (self.roll_back_due and self.state is not State.MOVING)
        restless = stops and not self._setpoints.moving and not self.drive.at_rest
        self._restless = self._restless + 1 if restless and self.enabled else 0
        if self._restless > _REST_SAMPLES_AFTER_RAMP:
            self._latch(Fault.STOP_OVERDUE)
            self.coast()

    # ---- protection

    def _look_around(self) -> None:
        """Switches, emergency stop and watchdog, before anything is moved."""
        self.inputs.feel(self.drive.plant.output_rad)
        if self.inputs.sto_latched and self.fault is not Fault.STO:
            self._latch(Fault.STO)
            self.coast()
        elif self._abandoned:
            self._latch(Fault.WATCHDOG)
            if self._registers.integer("watchdog.action") == WatchdogAction.COAST:
                self.coast()
            else:
                self.stop()

    @property
    def _sign_of_life_owed(self) -> bool:
        """A motion goes on, which ends when its last page is fetched, and a host watches over it.

        Nobody holds the board in a motion that another host stops: that one needs no guard.
        """
        return (
            self.state in _MOTION
            and not self.fault
            and self.session.key != register_file.FREE
            and (self._setpoints.moving or self.state is State.DRAINING)
        )

    @property
    def _abandoned(self) -> bool:
        """The host that owes a sign of life has fallen silent."""
        return self._sign_of_life_owed and self.session.silence_s > self._registers.value(
            "watchdog.timeout"
        )

    def _protect(self, measured: DriveSample) -> None:
        if not (self._setpoints.finite and self.drive.finite):
            fault = Fault.NOT_FINITE
        elif self.inputs.bar(self._setpoints.current):
            fault = Fault.LIMIT_SWITCH
        else:
            fault = violated(self._limits, measured, self.drive)
        if not fault and self.drive.oscillates:
            fault = Fault.OSCILLATION
        if fault:
            self._latch(fault)
            self.coast()

    def _latch(self, fault: Fault) -> None:
        """The first fault stays until it is cleared, but WATCHDOG gives way to the emergency stop.

        A host clears WATCHDOG by itself, and the emergency stop only for a person.
        """
        self.roll_back_due = self.banks.unconfirmed
        if not self.fault or (fault is Fault.STO and self.fault is Fault.WATCHDOG):
            self.fault, self.fault_sample = fault, self.samples

    def coast(self) -> None:
        """Effort off, in FAULT."""
        self.switch_off()
        self.state = State.FAULT

    def clear_fault(self) -> None:
        """Forget the fault; the effort stays off."""
        self.fault, self.fault_sample = Fault.NONE, 0
        self.inputs.rearm_stop()
        self.state = State.IDLE


# The limits that the board enforces by itself, sample by sample.


def violated(limits: Sequence[AxisLimits], measured: DriveSample, drive: Drive) -> Fault:
    """The first limit that an axis under control has left, or NONE.

    Every comparison is made so that a value which is not a number violates it.
    """
    for limit, position, error, speed in zip(
        limits, measured.position, measured.following_error, drive.speed_rad_s, strict=True
    ):
        if not abs(position) * RAD_PER_COUNT <= limit.travel_rad:
            return Fault.TRAVEL
        if not abs(error) * RAD_PER_COUNT <= limit.following_error_rad:
            return Fault.FOLLOWING_ERROR
        if not abs(speed) <= limit.speed_rad_s:
            return Fault.SPEED
    return Fault.NONE


# What a board makes sure of at power-up before it takes a command.

LONGEST_WINDOW_S: Final = 1800.0
_LARGEST_EFFORT_COUNT: Final = 2**15 - 1
_LARGEST_JUMP_NM: Final = 1e6
_LARGEST_STATED: Final = 1e6
# A quarter of the counter's round: leaving the travel shows long before it wraps.
_LARGEST_TRAVEL_COUNT: Final = 2**29


def settings_sound(settings: BoardSettings) -> bool:
    """Whether the board may work with these settings: finite, positive, representable."""
    return 0.0 < settings.confirm_window_s < LONGEST_WINDOW_S and all(
        axis in settings.limits
        and axis in settings.gains
        and _limits_sound(settings.limits[axis])
        and _gains_sound(settings.gains[axis], settings.limits[axis].gain_maximum)
        for axis in AXES
    )


def _limits_sound(limits: AxisLimits) -> bool:
    sizes = (
        limits.travel_rad,
        limits.speed_rad_s,
        limits.acceleration_rad_s2,
        limits.effort_nm,
        limits.following_error_rad,
        limits.gain_step,
    )
    return (
        all(math.isfinite(size) and size > 0.0 for size in sizes)
        and 0.0 <= limits.effort_jump_nm <= _LARGEST_JUMP_NM
        and 0.0 <= limits.inertia <= _LARGEST_STATED
        and 0.0 <= limits.viscous_friction <= _LARGEST_STATED
        and limits.effort_nm / EFFORT_PER_COUNT_NM <= _LARGEST_EFFORT_COUNT
        and limits.travel_rad / RAD_PER_COUNT <= _LARGEST_TRAVEL_COUNT
        and limits.gain_step <= 1.0
        and all(math.isfinite(m) and m >= 0.0 for m in limits.gain_maximum.numbers().values())
        and limits.gain_maximum.transmission_loss <= MOST_LOSS
    )


def _gains_sound(gains: AxisGains, maxima: AxisGains) -> bool:
    largest = maxima.numbers()
    return all(
        abs(value) <= largest[name]
        and (value >= 0.0 or name in SIGNED)
        and (value > 0.0 or name not in POSITIVE)
        for name, value in gains.numbers().items()
    )

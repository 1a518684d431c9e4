"""Plant, encoders, PWM and controllers: what happens in one control sample."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from firmware_interface.board_types import AxisLimits
from firmware_interface.gains import AxisGains
from firmware_interface.law_memory import Memory
from firmware_interface.plant.feed_drive import COUNTS_PER_TURN, FEED_DRIVE
from firmware_interface.plant.motions import SAMPLE_S
from firmware_interface.plant.plant import DELAY, Plant
from firmware_interface.virtual.controller import AxisController, Setpoint
from firmware_interface.virtual.oscillation import OscillationWatch
from firmware_interface.virtual.transfer import Transfer, transfer

SAMPLE_PERIOD_S: Final = SAMPLE_S
CONTROL_DELAY_S: Final = DELAY * SAMPLE_PERIOD_S
EFFORT_PER_COUNT_NM: Final = 0.004
"""Torque at the gearbox output of one PWM count."""
RAD_PER_COUNT: Final = 2.0 * math.pi / COUNTS_PER_TURN
"""Encoder resolution at the gearbox output."""
_REST_SAMPLES: Final = 20
_REST_COUNTS: Final = 2


class DriveSample(NamedTuple):
    """One control sample in counts, by axis; following error is reference - position."""

    position: list[int]
    effort: list[int]
    following_error: list[int]


class Drive:
    """The machine behind the board.

    Parameters
    ----------
    gains : mapping
        In force at power-up, by axis.
    limits : mapping
        By axis.
    plant : Plant
        May be in motion.
    homed : int
        Bit n: axis n counts from the machine's zero; any other from where it stands now.

    Attributes
    ----------
    powered : bool
        The control law acts and the brake is released.
    oscillates : bool
        In the sample that was taken last, the feedback was seen to keep an axis swinging.
    """

    def __init__(
        self,
        gains: Mapping[str, AxisGains],
        limits: Mapping[str, AxisLimits],
        plant: Plant,
        homed: int,
    ) -> None:
        self.plant = plant
        self._controllers = [
            AxisController(gains[axis], SAMPLE_PERIOD_S, limits[axis].effort_nm)
            for axis in FEED_DRIVE
        ]
        self._limits_nm = [limits[axis].effort_nm for axis in FEED_DRIVE]
        self._positions: deque[list[int]] = deque(maxlen=_REST_SAMPLES)
        standing = [round(angle / RAD_PER_COUNT) for angle in plant.shown_rad]
        self._zero = [0 if homed >> n & 1 else count for n, count in enumerate(standing)]
        self.powered = self.oscillates = False
        self._watch_anew()

    @property
    def at_rest(self) -> bool:
        """The encoders stood still for the last 50 ms."""
        if len(self._positions) < _REST_SAMPLES:
            return False
        if self._positions.count(self._positions[-1]) == _REST_SAMPLES:
            return True
        columns = zip(*self._positions, strict=True)
        return all(max(column) - min(column) <= _REST_COUNTS for column in columns)

    @property
    def position_rad(self) -> list[float]:
        """What the encoders read, by axis."""
        return [count * RAD_PER_COUNT for count in self._read_encoders()]

    @property
    def speed_rad_s(self) -> list[float]:
        """Mean over the last 50 ms, by axis."""
        if len(self._positions) < 2:
            return [0.0] * len(self._controllers)
        time_s = (len(self._positions) - 1) * SAMPLE_PERIOD_S
        first, last = self._positions[0], self._positions[-1]
        return [(b - a) * RAD_PER_COUNT / time_s for a, b in zip(first, last, strict=True)]

    @property
    def finite(self) -> bool:
        """Every effort since power_on was a number."""
        return all(controller.finite for controller in self._controllers)

    @property
    def memories(self) -> list[Memory]:
        """What the laws remember of their references, by axis."""
        return [controller.memory for controller in self._controllers]

    def set_gains(self, gains: Mapping[str, AxisGains]) -> None:
        """Exchange the gains of all axes between two samples; they are held where they stand."""
        for controller, axis, position in zip(
            self._controllers, FEED_DRIVE, self.position_rad, strict=True
        ):
            controller.exchange(gains[axis], position)

    def considered(
        self, gains: Mapping[str, AxisGains], setpoints: Sequence[Setpoint], *, moving: bool
    ) -> Transfer:
        """What these gains would make of the sample that comes; see `transfer`."""
        by_axis = [gains[axis] for axis in FEED_DRIVE]
        return transfer(self._controllers, by_axis, setpoints, self.position_rad, moving=moving)

    def take_over(self, transferred: Transfer) -> None:
        """Go on with the gains of a transfer, in the sample for which it was considered."""
        self._controllers = transferred.controllers

    def power_on(self) -> None:
        """Release the brake and take up control where the axes stand."""
        self.powered = True
        for controller, position in zip(self._controllers, self.position_rad, strict=True):
            controller.reset(position)
        self._watch_anew()

    def power_off(self) -> None:
        """Apply the brake; no effort until the next power_on."""
        self.powered = False

    def _watch_anew(self) -> None:
        self._watches = [
            OscillationWatch(
                limit_nm / EFFORT_PER_COUNT_NM,
                _REST_COUNTS,
                period_s=SAMPLE_PERIOD_S,
                control_delay_s=CONTROL_DELAY_S,
            )
            for limit_nm in self._limits_nm
        ]

    def sample(self, setpoints: Sequence[Setpoint]) -> DriveSample:
        """Latch the encoders, compute the efforts, let one period pass."""
        positions = self._read_encoders()
        self._positions.append(positions)
        counts = self._efforts(setpoints, positions) if self.powered else [0] * len(positions)
        effort = [count * EFFORT_PER_COUNT_NM for count in counts]
        recorded = self.plant.recorded_nm(effort)
        self.plant.advance(effort)
        errors = [
            round(s.position_rad / RAD_PER_COUNT) - p
            for s, p in zip(setpoints, positions, strict=True)
        ]
        self.oscillates = self.powered and self._watched(positions, errors, counts)
        in_record = [round(nm / EFFORT_PER_COUNT_NM) for nm in recorded]
        return DriveSample(positions, in_record, errors)

    def _watched(self, positions: list[int], errors: list[int], efforts: list[int]) -> bool:
        """Show a sample to all watches; whether one of them sees an oscillation."""
        seen = [
            watch.seen(position, error, effort - controller.feedforward_nm / EFFORT_PER_COUNT_NM)
            for watch, position, error, effort, controller in zip(
                self._watches, positions, errors, efforts, self._controllers, strict=True
            )
        ]
        return any(seen)

    def _read_encoders(self) -> list[int]:
        angles = self.plant.shown_rad
        return [round(a / RAD_PER_COUNT) - zero for a, zero in zip(angles, self._zero, strict=True)]

    def _efforts(self, setpoints: Sequence[Setpoint], positions: list[int]) -> list[int]:
        """Efforts in PWM counts; none at all as soon as one is not a number."""
        counts = [
            round(c.effort_nm(s, p * RAD_PER_COUNT, other) / EFFORT_PER_COUNT_NM)
            for c, s, p, other in zip(
                self._controllers, setpoints, positions, reversed(setpoints), strict=True
            )
        ]
        return counts if self.finite else [0] * len(counts)

"""Plant, encoders, PWM and controllers: what happens in one control sample."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from firmware_interface import board_types, control_law
from firmware_interface.gains import AxisGains
from firmware_interface.plant import drives, feed_drive
from firmware_interface.plant.plant import DELAY, Plant
from firmware_interface.virtual.controller import AxisController, Setpoint, Transfer, transfer

SAMPLE_PERIOD_S: Final = drives.SAMPLE_S
CONTROL_DELAY_S: Final = DELAY * SAMPLE_PERIOD_S
EFFORT_PER_COUNT_NM: Final = 0.004
"""Torque at the gearbox output of one PWM count."""
RAD_PER_COUNT: Final = 2.0 * math.pi / feed_drive.COUNTS_PER_TURN
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
        limits: Mapping[str, board_types.AxisLimits],
        plant: Plant,
        homed: int,
    ) -> None:
        self.plant = plant
        self._controllers = [
            AxisController(gains[axis], SAMPLE_PERIOD_S, limits[axis].effort_nm)
            for axis in feed_drive.FEED_DRIVE
        ]
        self._limits_nm = [limits[axis].effort_nm for axis in feed_drive.FEED_DRIVE]
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
    def memories(self) -> list[control_law.Memory]:
        """What the laws remember of their references, by axis."""
        return [controller.memory for controller in self._controllers]

    def set_gains(self, gains: Mapping[str, AxisGains]) -> None:
        """Exchange the gains of all axes between two samples; they are held where they stand."""
        for controller, axis, position in zip(
            self._controllers, feed_drive.FEED_DRIVE, self.position_rad, strict=True
        ):
            controller.exchange(gains[axis], position)

    def considered(
        self, gains: Mapping[str, AxisGains], setpoints: Sequence[Setpoint], *, moving: bool
    ) -> Transfer:
        """What these gains would make of the sample that comes; see `transfer`."""
        by_axis = [gains[axis] for axis in feed_drive.FEED_DRIVE]
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


# Whether the feedback keeps an axis swinging to and fro.
#
# A swing is the way of the deviation (position - reference) from one turning point to the next;
# what rest allows is none. Two swings are a cycle. The feedback feeds a cycle if, over it, the
# effort less the feed-forward does positive work on the deviation: a passivity observer (Hannaford
# and Ryu, Time-domain passivity control of haptic interfaces, IEEE Trans. Robotics and Automation
# 18, 2002). A hand that pushes the axis, stick-slip, and whatever else the feedback damps put work
# into it. Where the reference itself changes its speed more than the deviation does, it may ask for
# such work. What swings faster than the encoder can show is seen by the effort alone: it alternates
# from sample to sample.

LARGE_SHARE: Final = 0.3
"""Of the effort limit: what the effort sweeps in a swing that counts, and its rms value where it
alternates."""
# Means over so many samples, of deviation and effort alike: encoder rounding, which the feedback
# turns into effort one sample later, would look like work.
_SMOOTHED: Final = 4
LONGEST_SWING_S: Final = 0.7
SHORTEST_TIME_S: Final = 0.25
"""An impact rings for less."""
_LATEST: Final = 3  # samples of control delay; a longer one counts as this
_FED_CYCLES: Final = 2  # that overlap: three swings
_DECAY: Final = 0.5  # a swing of less than this share of the largest is one that dies away


class _Swing:
    """Sums over the samples of a swing, in counts."""

    __slots__ = (
        "effort",
        "highest",
        "lowest",
        "reference_square",
        "reference_way",
        "samples",
        "square",
        "way",
        "work",
    )

    def __init__(self) -> None:
        self.samples = 0
        self.way = self.square = self.work = self.effort = 0.0
        self.reference_way = self.reference_square = 0.0
        self.lowest, self.highest = float("inf"), float("-inf")

    def add(self, other: "_Swing") -> None:
        self.samples += other.samples
        self.way += other.way
        self.square += other.square
        self.work += other.work
        self.effort += other.effort
        self.reference_way += other.reference_way
        self.reference_square += other.reference_square
        self.lowest = min(self.lowest, other.lowest)
        self.highest = max(self.highest, other.highest)


class OscillationWatch:
    """Watches one axis, sample by sample.

    Parameters
    ----------
    effort_limit : float
        In counts.
    rest : int
        Counts that an axis at rest may stray.
    period_s, control_delay_s : float
        Of the loop; from the encoder latch to the effort that follows from it.
    """

    def __init__(
        self, effort_limit: float, rest: int, *, period_s: float, control_delay_s: float
    ) -> None:
        self._large = LARGE_SHARE * effort_limit
        self._rest = rest
        self._longest, self._shortest = LONGEST_SWING_S / period_s, SHORTEST_TIME_S / period_s
        late, rest_s = divmod(control_delay_s, period_s)
        late = min(late, _LATEST)
        self._before_share = rest_s / period_s
        self._efforts: deque[float] = deque([0.0] * (int(late) + 2), maxlen=int(late) + 2)
        self._in_force = deque([0.0] * _SMOOTHED, maxlen=_SMOOTHED)
        self._seen: deque[tuple[int, int]] = deque(maxlen=_SMOOTHED)
        self._last, self._now, self._back = _Swing(), _Swing(), _Swing()
        self._direction = 0
        self._fed_cycles, self._fed_samples, self._largest = 0, 0, 0.0
        self._alternating, self._forgotten = 0.0, period_s / SHORTEST_TIME_S

    def seen(self, position: int, following_error: int, feedback: float) -> bool:
        """Take in a sample; whether the axis is kept swinging.

        Parameters
        ----------
        position, following_error : int
            In counts; following error is reference - position.
        feedback : float
            Effort that this sample asks for, less the feed-forward, in counts.
        """
        first, second = self._efforts[0], self._efforts[1]
        self._efforts.append(feedback)
        # what was asked for at the beginning of the period came into force a control delay later
        self._in_force.append(second + self._before_share * (first - second))
        full = len(self._seen) == _SMOOTHED
        oldest_deviation, oldest_position = self._seen[0] if full else (0, 0)
        self._seen.append((-following_error, position))
        if not full:
            return False
        step = (-following_error - oldest_deviation) / _SMOOTHED
        reference_step = (position - oldest_position) / _SMOOTHED - step
        effort = sum(self._in_force) / _SMOOTHED
        taken = self._in_force[-1] - effort
        self._alternating += self._forgotten * (taken * taken - self._alternating)
        back = self._back
        back.samples += 1
        back.way += step
        back.square += step * step
        back.work += effort * step
        back.effort += effort
        back.reference_way += reference_step
        back.reference_square += reference_step * reference_step
        if effort < back.lowest:
            back.lowest = effort
        if effort > back.highest:
            back.highest = effort
        beyond_rest = abs(back.way) > self._rest
        if not self._direction and beyond_rest:
            self._direction = 1 if back.way > 0 else -1
        if self._direction * back.way > 0:
            self._now.add(back)
            self._back = _Swing()
        elif beyond_rest and self._direction and self._swung():
            return True
        return self._alternating > self._large * self._large

    def _swung(self) -> bool:
        """At a turning point, where a swing has ended; whether it is one too many."""
        if self._fed():
            self._fed_samples += self._now.samples
            self._fed_samples += 0 if self._fed_cycles else self._last.samples
            self._fed_cycles += 1
            self._largest = max(self._largest, abs(self._now.way))
        else:
            self._fed_cycles, self._fed_samples, self._largest = 0, 0, 0.0
        self._last, self._now, self._back = self._now, self._back, _Swing()
        self._direction = -self._direction
        return self._fed_cycles >= _FED_CYCLES and self._fed_samples >= self._shortest

    def _fed(self) -> bool:
        """Whether the feedback fed the cycle that ends here."""
        last, now, cycle = self._last, self._now, _Swing()
        cycle.add(last)
        cycle.add(now)
        drift = cycle.way / cycle.samples
        # a constant effort, against a load, does no work on a swing to and fro
        work = cycle.work - cycle.effort * drift
        speed_power = cycle.square - cycle.way * drift
        asked_power = cycle.reference_square - cycle.reference_way**2 / cycle.samples
        return (
            all(
                swing.highest - swing.lowest >= self._large and swing.samples <= self._longest
                for swing in (last, now)
            )
            and work > 0.0
            and speed_power > asked_power
            and abs(now.way) >= _DECAY * max(self._largest, abs(last.way))
        )

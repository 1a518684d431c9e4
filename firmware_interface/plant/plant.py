"""One drive behind a board: a command per sample goes in, what the encoders show comes out."""

from collections import deque
from collections.abc import Sequence
from typing import Final, Protocol

import numpy as np

from firmware_interface.plant.drives import Drives
from firmware_interface.plant.effect import Effect
from firmware_interface.plant.functions import Value
from firmware_interface.plant.mechanism import STEPS_PER_SAMPLE, overriding
from firmware_interface.plant.motions import SAMPLE_S
from firmware_interface.plant.moving_axis import MovingAxis

DELAY: Final = 0.2
"""Share of a sample after which a new command begins to act: 0.5 ms of 2.5."""
LEAD_IN_S: Final = 5.0
"""A host goes to the start of its motion, and gathers speed there, before it records."""
_REMEMBERED: Final = 64
"""Samples of effort from which the recorded one is made."""


class Axis(Protocol):
    """What moves in an axis."""

    acceleration: float
    other_velocity: float
    other_acceleration: float

    @property
    def angle(self) -> tuple[float, float, float]:
        """Of the masses, rad."""

    @property
    def velocity(self) -> tuple[float, float, float]:
        """Of the masses, rad/s."""

    def at(self, time_s: float) -> None:
        """Tell the time, once per sample."""

    def advance(self, torque: float) -> None:
        """One step under a motor torque."""

    def advance_sound(self, torque: float, steps: int) -> None:
        """As many steps of a sound axis."""

    def jam(self) -> None:
        """Block the motor where it is."""

    def break_coupling(self) -> None:
        """Part the motor from what it drives."""


class Plant:
    """A drive that stands at zero, with its effects.

    Parameters
    ----------
    drive : Drives
        One.
    effects : sequence of Effect
        Drawn for it.
    sample_s : float
        Time that passes in a sample.
    delay : float
        Share of a sample after which a new command begins to act.
    lead_in_s : float
        From the first effort to zero on the clock of the effects.
    """

    def __init__(
        self,
        drive: Drives,
        effects: Sequence[Effect] = (),
        sample_s: float = SAMPLE_S,
        delay: float = DELAY,
        lead_in_s: float = LEAD_IN_S,
    ) -> None:
        chain, axes = drive.chain, range(drive.shape[1])
        for effect in effects:
            chain = effect.chain(chain)
        own = [[e.of_axis(0, axis) for e in effects if e.hit[0, axis]] for axis in axes]
        step_s = sample_s / STEPS_PER_SAMPLE
        moving = [MovingAxis(chain, axis, own[axis], step_s) for axis in axes]
        self._axes: Sequence[Axis] = moving
        self._sound = all(axis.sound for axis in moving)
        self._encoders = [[e.encoder for e in overriding(some, "encoder")] for some in own]
        self._amplifiers = [[e.applied for e in overriding(some, "applied")] for some in own]
        self._recorders = [e.recorded for e in overriding(effects, "recorded")]
        self._commands = deque([[0.0] * len(axes)] * _REMEMBERED, _REMEMBERED)
        self._sample_s = sample_s
        self._late = round(delay * STEPS_PER_SAMPLE)
        self._torque = [0.0] * len(axes)
        self._time_s = -lead_in_s
        self._begun = False

    @property
    def output_rad(self) -> list[float]:
        """Gearbox output angle of each axis."""
        return [axis.angle[0] for axis in self._axes]

    @property
    def output_rad_s(self) -> list[float]:
        """Gearbox output speed of each axis."""
        return [axis.velocity[0] for axis in self._axes]

    @property
    def table_rad(self) -> list[float]:
        """Angle of each axis's table, which no encoder of this drive shows."""
        return [axis.angle[2] for axis in self._axes]

    @property
    def torque_nm(self) -> list[float]:
        """What the motor of each axis makes of the last command."""
        return list(self._torque)

    @property
    def shown_rad(self) -> list[float]:
        """What the encoders show, before they count it."""
        shown = self.output_rad
        for axis, encoders in enumerate(self._encoders):
            for encoder in encoders:
                shown[axis] = encoder(shown[axis])
        return shown

    def advance(self, command: Sequence[float]) -> None:
        """Let one sample pass: the command before it acts until the new one comes, N·m."""
        self._begun = self._begun or any(command)
        self._commands.append(list(command))
        acting = [self._applied(axis, float(torque)) for axis, torque in enumerate(command)]
        for moving in self._axes:
            moving.at(self._time_s)
        self._steps(self._torque, self._late)
        self._steps(acting, STEPS_PER_SAMPLE - self._late)
        self._torque = acting
        if self._begun:
            self._time_s += self._sample_s

    def lose_encoder(self, axis: int) -> None:
        """From now on the counts of an axis stand still: no more pulses come."""
        stands_rad = self.shown_rad[axis]

        def lost(angle: Value) -> Value:
            return angle * 0.0 + stands_rad

        self._encoders[axis].append(lost)

    def jam(self, axis: int) -> None:
        """Block an axis where it is."""
        self._axes[axis].jam()

    def break_coupling(self, axis: int) -> None:
        """Part an axis from what it drives."""
        self._axes[axis].break_coupling()

    def recorded_nm(self, command: Sequence[float]) -> list[float]:
        """Effort that stands in the record for a command about to be given."""
        if not self._recorders:
            return list(command)
        efforts = np.array([*self._commands, command])[:, None, :]
        stamps = self._time_s + self._sample_s * np.arange(1.0 - len(efforts), 1.0)
        for recorder in self._recorders:
            efforts = recorder(efforts, stamps)
        last: list[float] = efforts[-1, 0].tolist()
        return last

    def _applied(self, axis: int, torque: float) -> float:
        for made_of in self._amplifiers[axis]:
            torque = float(made_of(torque, self._time_s))
        return torque

    def _steps(self, torque: Sequence[float], count: int) -> None:
        if self._sound:
            for axis, given in zip(self._axes, torque, strict=True):
                axis.advance_sound(given, count)
            return
        pairs = list(zip(self._axes, reversed(self._axes), torque, strict=True))
        for _ in range(count):
            # an axis sees the other as it was before the step, whichever goes first
            for axis, other, _given in pairs:
                axis.other_velocity = other.velocity[2]
                axis.other_acceleration = other.acceleration
            for axis, _other, given in pairs:
                axis.advance(given)

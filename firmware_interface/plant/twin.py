"""A sound drive that moves as a faulty one does: what the same motion would have taken of it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firmware_interface.plant.drives import Array, Drives
from firmware_interface.plant.effect import Effect
from firmware_interface.plant.mechanism import STEPS_PER_SAMPLE, Mechanism, overriding
from firmware_interface.plant.motions import SAMPLE_S, Motion

_NUDGE_RAD = 1e-6


class Twin:
    """The drives without their effects, with motors that move as the encoders say.

    Give it to `simulate`. Inverse dynamics by simulation: the encoder sits on the motor, so the
    motor's motion is given, the other masses follow it, and the torque on the motor results.

    Parameters
    ----------
    drives, motion, effects
        As `simulate` gets them.
    axis : (B,) array of int
        The one of every drive to be remembered.

    Attributes
    ----------
    torque : (T, B) array
        In every step, `STEPS_PER_SAMPLE` a row of the motion, N·m.
    velocity : (T + 1, B) array
        Of the angle that the encoder shows, before each step and after the last one, rad/s.
    """

    def __init__(
        self, drives: Drives, motion: Motion, effects: Sequence[Effect], axis: NDArray[np.intp]
    ) -> None:
        whole = np.ones(drives.shape)
        start, speed = motion.position[0] * whole, motion.velocity[0] * whole
        self._sound = Mechanism(drives.chain, (), SAMPLE_S / STEPS_PER_SAMPLE, start, speed)
        self._encoders = [e.encoder for e in overriding(effects, "encoder")]
        self._of = np.arange(len(axis)), axis
        steps = STEPS_PER_SAMPLE * len(motion.position)
        self.torque = np.empty((steps, len(axis)))
        self.velocity = np.empty((steps + 1, len(axis)))
        self.velocity[0] = speed[self._of]
        self._step = 0

    def follow(self, drive: Mechanism) -> None:
        """Go one step along with a drive that has just made it."""
        velocity = drive.velocity[0] * self._slope(drive.angle[0])
        needed = self._sound.follow(velocity)
        self.torque[self._step] = needed[self._of]
        self._step += 1
        self.velocity[self._step] = velocity[self._of]

    def _slope(self, angle: Array) -> Array:
        """Shown angle per true angle."""
        if not self._encoders:
            return np.ones_like(angle)
        high, low = angle + _NUDGE_RAD, angle - _NUDGE_RAD
        for encoder in self._encoders:
            high, low = encoder(high), encoder(low)
        return np.asarray((high - low) / (2 * _NUDGE_RAD))

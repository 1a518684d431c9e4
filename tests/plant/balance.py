"""Momentum balance of recordings along the true motion: what a rigid body leaves unexplained."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firmware_interface.plant.drives import SAMPLE_S, Array
from firmware_interface.plant.simulation import Recordings


@dataclass(frozen=True)
class Balance:
    """Means over the periods between stamps, all (B, A, N - 2) but `time_s` (N - 2,).

    Attributes
    ----------
    effort : torque that was commanded for the period, N·m
    missing : effort less that of the rigid body, N·m
    """

    time_s: Array
    angle: Array
    velocity: Array
    acceleration: Array
    effort: Array
    missing: Array

    @property
    def direction(self) -> Array:
        """Sign of the velocity."""
        return np.sign(self.velocity)

    def clear(self, speed: float = 0.1, samples: int = 60) -> NDArray[np.bool_]:
        """Where the motion has long been, and long stays, faster than `speed`."""
        slow = averaged(abs(self.velocity) < speed, 2 * samples + 1) > 0
        slow[..., :samples] = slow[..., -samples:] = True
        return ~slow


def balance(recordings: Recordings, parameters: Array) -> Balance:
    """Hold the commands against the rigid body of `parameters`, (B, A, 4)."""
    inertia, viscous, coulomb, offset = np.moveaxis(parameters, -1, 0)[..., None]
    angle, velocity = recordings.true_angle[..., 1:], recordings.true_velocity[..., 1:]
    command = recordings.true_command
    mean_velocity = np.diff(angle) / SAMPLE_S
    acceleration = np.diff(velocity) / SAMPLE_S
    # a command acts 0.5 ms late: for a fifth of the period the one before still does
    effort = 0.8 * command[..., 1:-1] + 0.2 * command[..., :-2]
    rigid = inertia * acceleration + viscous * mean_velocity
    rigid += coulomb * np.sign(mean_velocity) + offset
    return Balance(
        time_s=recordings.time_s[1:-1] + SAMPLE_S / 2,
        angle=(angle[..., 1:] + angle[..., :-1]) / 2,
        velocity=mean_velocity,
        acceleration=acceleration,
        effort=effort,
        missing=effort - rigid,
    )


def averaged(values: Array, samples: int = 41) -> Array:
    """Moving average along time: it takes out the chain's own ringing."""
    kernel = np.ones(samples) / samples
    return np.apply_along_axis(np.convolve, -1, values, kernel, "same")

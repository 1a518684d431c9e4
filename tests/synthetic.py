"""Recordings like those of the real machines, made by the independent plant.

A clone has no measured recordings. These take the same paths through the code: an axis in metres
and newtons that repeats its laps, a motor in amperes that turns one way with uneven time stamps,
and an arm whose axes bear weight and push each other. All are seeded and written to files, so
that they are also read as files are.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import save_recording
from firmware_interface.plant import (
    SAMPLE_S,
    Motion,
    Noise,
    Recordings,
    draw,
    draw_drives,
    simulate,
)
from firmware_interface.plant.drives import LEAD, TAIL

LEAD_M_PER_RAD = 0.004 / (2.0 * np.pi)
LAP_S = 4.8
_FINE_RAD = 2.0 * np.pi / 2**18
_MOTOR_INERTIA = 0.0002
"""A·s²/rad."""
_SEED = 31


@dataclass(frozen=True)
class Synthetic:
    """A recording and what is true of it, in its own units.

    Attributes
    ----------
    path : Path
    hidden : mapping of str to float
        Size of each hidden effect on the first axis, as the plant defines it.
    truth : (4,) array
        Base parameters of the first axis.
    """

    path: Path
    hidden: Mapping[str, float]
    truth: NDArray[np.float64]


def carriage(folder: Path) -> Synthetic:
    """One prismatic axis: friction by direction, and effort that is recorded late."""
    made, hidden = _made(("asymmetric_friction", "time_delay"), strength=0.75)
    axis = AxisRecord(
        made.position[0, 0] * LEAD_M_PER_RAD, made.effort[0, 0] / LEAD_M_PER_RAD, "m", "N"
    )
    per_m = np.array(
        [LEAD_M_PER_RAD**-2, LEAD_M_PER_RAD**-2, 1 / LEAD_M_PER_RAD, 1 / LEAD_M_PER_RAD]
    )
    hidden["asymmetric_friction"] /= LEAD_M_PER_RAD**2
    return Synthetic(
        _saved(folder / "carriage.csv", made, {"q": axis}), hidden, per_m * made.truth[0, 0]
    )


def arm(folder: Path) -> Synthetic:
    """Two joints that bear weight by their angle; the first is pushed by the second."""
    made, hidden = _made(("position_dependent_load", "cross_axis_coupling"), strength=0.9)
    joints = {
        name: AxisRecord(made.position[0, axis], made.effort[0, axis], "rad", "N*m")
        for axis, name in enumerate(("j1", "j2"))
    }
    return Synthetic(_saved(folder / "arm.csv", made, joints), hidden, made.truth[0, 0])


def motor(folder: Path) -> Synthetic:
    """A motor that a speed loop turns once a second: ripple of 12 and 18 orders.

    The controller compensates half of the ripple: a speed loop alone would make an effort that
    follows the speed, which no diagnosis can tell from negative viscous friction.
    """
    rng = np.random.default_rng(_SEED)
    steps = rng.uniform(0.9e-3, 1.1e-3, 6_000)
    angle, speed = np.zeros(len(steps)), 2.0 * np.pi
    effort = np.empty(len(steps))
    for row, step_s in enumerate(steps):
        here = angle[row]
        ripple = 0.05 * np.sin(12.0 * here) + 0.03 * np.cos(18.0 * here)
        wanted = 2.0 * np.pi * (1.0 + 0.1 * np.sin(30.0 * row * 1e-3))
        effort[row] = 0.1 + 0.09 * (wanted - speed) + 0.5 * ripple
        speed += step_s * (effort[row] - 0.05 - 0.008 * speed - ripple) / _MOTOR_INERTIA
        if row + 1 < len(steps):
            angle[row + 1] = here + step_s * speed
    time_s = np.concatenate([[0.0], np.cumsum(steps[:-1])])
    effort += 0.002 * rng.standard_normal(len(effort))
    axis = AxisRecord(_FINE_RAD * np.round(angle / _FINE_RAD), effort, "rad", "A")
    path = folder / "motor.csv"
    save_recording(Recording(time_s, {"m": axis}, path.name, 0.0005), path)
    return Synthetic(path, {"torque_ripple": 0.05}, np.array([_MOTOR_INERTIA, 0.008, 0.05, 0.0]))


def _made(effects: tuple[str, ...], strength: float) -> tuple[Recordings, dict[str, float]]:
    """Two drives on one motion, and the sizes on the first axis of the first, which is recorded."""
    drives, motion = draw_drives(2, _SEED), _laps()
    hidden = draw(effects, drives, motion, _SEED, strength=strength)
    made = simulate(
        drives, motion, effects=hidden, noise=Noise(0.01, 0.05), seed=_SEED, steps_per_sample=5
    )
    return made, {effect.name: float(effect.size[0, 0]) for effect in hidden}


def _laps() -> Motion:
    """Four equal laps of three sines, with few reversals."""
    time_s = SAMPLE_S * np.arange(-LEAD, round(4 * LAP_S / SAMPLE_S) + TAIL)[:, None, None]
    position = velocity = acceleration = np.zeros((len(time_s), 1, 2))
    for swing_rad, order in ((3.0, 1), (0.3, 4), (0.05, 11)):
        rate = 2.0 * np.pi * order / LAP_S
        angle = rate * time_s + np.array([0.3, 1.9])
        position = position + swing_rad * np.sin(angle)
        velocity = velocity + swing_rad * rate * np.cos(angle)
        acceleration = acceleration - swing_rad * rate**2 * np.sin(angle)
    return Motion("laps", position, velocity, acceleration)


def _saved(path: Path, made: Recordings, axes: dict[str, AxisRecord]) -> Path:
    save_recording(Recording(made.time_s, axes, path.name, float(made.effort_shift_s[0])), path)
    return path

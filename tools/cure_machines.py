"""Machines of the independent plant with an effect, and the motions that they make."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Multisine, Reference, SineComponent, reference
from firmware_interface.plant import COUNT_RAD, Drives, Effect, Plant, draw, draw_drives
from firmware_interface.plant import Motion as PlantMotion
from firmware_interface.plant.drives import LEAD, SAMPLE_S, TAIL
from firmware_interface.plant.hiding import CLEAR
from firmware_interface.plant.plant import DELAY
from firmware_interface.registers import AXES
from firmware_interface.virtual.controller import AxisController, Setpoint
from firmware_interface.virtual.drive import EFFORT_PER_COUNT_NM

Array = NDArray[np.float64]

EFFORT_LIMIT_NM: Final = 25.0
_NOISE: Final = 0.02  # of the recorded effort, over its rms
_LEAD_IN_S: Final = 3.0
DURATION_S: Final = 15.0
"""Of the motion that is judged."""
_INSIDE: Final = 0.9  # of the range of the identification's motion, that the judged one uses
_HIGHEST_HZ: Final = 1.0


@dataclass(frozen=True)
class Machine:
    """A drive with an effect on one of its axes."""

    drives: Drives
    effects: Sequence[Effect]
    axis: str

    def follow(
        self,
        banks: Mapping[str, AxisGains],
        motions: Mapping[str, Multisine],
        duration_s: float,
        begins_s: float = -_LEAD_IN_S,
    ) -> "Followed":
        """Move from rest, in the loop of a board; the effects' clock begins at a time."""
        plant = Plant(self.drives, self.effects, lead_in_s=-begins_s)
        laws = [AxisController(banks[axis], SAMPLE_S, EFFORT_LIMIT_NM) for axis in AXES]
        first, last = -round(_LEAD_IN_S / SAMPLE_S), round(duration_s / SAMPLE_S)
        times = np.arange(first, last, dtype=np.float64) * SAMPLE_S
        ways = [reference(motions[axis], times, _LEAD_IN_S, 0.0) for axis in AXES]
        rows = []
        for k in range(len(times)):
            shown = [round(angle / COUNT_RAD) * COUNT_RAD for angle in plant.shown_rad]
            points = [_setpoint(way, k) for way in ways]
            command = [
                round(law.effort_nm(point, angle, other) / EFFORT_PER_COUNT_NM)
                * EFFORT_PER_COUNT_NM
                for law, point, angle, other in zip(
                    laws, points, shown, reversed(points), strict=True
                )
            ]
            recorded = plant.recorded_nm(command)
            rows.append([shown, recorded, plant.table_rad, [p.position_rad for p in points]])
            plant.advance(command)
        columns = np.array(rows)[times >= -0.5 * SAMPLE_S]
        return Followed(times[times >= -0.5 * SAMPLE_S], *np.moveaxis(columns, 0, -1))


@dataclass(frozen=True)
class Followed:
    """What a motion left: (N,) and (A, N) arrays."""

    time_s: Array
    position: Array
    effort: Array
    table: Array
    reference: Array

    def recording(self, rng: np.random.Generator) -> Recording:
        """What the board recorded."""
        size = np.sqrt(np.mean(self.effort**2, axis=-1, keepdims=True))
        effort = self.effort + _NOISE * size * rng.standard_normal(self.effort.shape)
        axes = {
            axis: AxisRecord(self.position[i], effort[i], "rad", "N*m", self.reference[i])
            for i, axis in enumerate(AXES)
        }
        return Recording(self.time_s, axes, "benchmark", (0.5 + DELAY) * SAMPLE_S)

    def error_rad(self, axis: str) -> float:
        """Rms distance of the table from its reference."""
        i = AXES.index(axis)
        return float(np.sqrt(np.mean((self.reference[i] - self.table[i]) ** 2)))


def drawn_machine(
    effect: str, motions: Mapping[str, Multisine], duration_s: float, rng: np.random.Generator
) -> Machine:
    """A random drive with an effect that is clearly there, on one random axis."""
    seed = int(rng.integers(2**31))
    drives = draw_drives(1, seed)
    scale = _plant_motion(motions, duration_s)
    rank = rng.uniform(*CLEAR)
    effects = draw([effect], drives, scale, seed, strength=rank, one_axis=True)
    hit = int(np.argmax(effects[0].hit[0]))
    return Machine(drives, effects, AXES[hit])


def _plant_motion(motions: Mapping[str, Multisine], duration_s: float) -> PlantMotion:
    """A motion as the plant takes it, for the scales of its effects."""
    times = np.arange(-LEAD, round(duration_s / SAMPLE_S) + TAIL) * SAMPLE_S
    ways = [reference(motions[axis], times, LEAD * SAMPLE_S, 0.0) for axis in AXES]
    columns = (
        np.stack([getattr(way, name) for way in ways], axis=-1)[:, None]
        for name in ("position_rad", "velocity_rad_s", "acceleration_rad_s2")
    )
    return PlantMotion("benchmark", *columns)


def other_motions(
    motions: Mapping[str, Multisine], duration_s: float, rng: np.random.Generator
) -> dict[str, Multisine]:
    """Eight sinusoids of equal speed and random frequency, inside the range of the motions."""
    found = {}
    for axis, motion in motions.items():
        rates = 2.0 * np.pi * np.exp(rng.uniform(np.log(0.05), np.log(_HIGHEST_HZ), 8))
        phases = rng.uniform(0.0, 2.0 * np.pi, 8)
        unit = Multisine(
            tuple(
                SineComponent(1.0 / rate, rate, phase)
                for rate, phase in zip(rates.tolist(), phases.tolist(), strict=True)
            )
        )
        room = _extremes(motion, duration_s) / _extremes(unit, DURATION_S)
        share = _INSIDE * float(np.min(room))
        parts = (
            replace(part, amplitude_rad=share * part.amplitude_rad) for part in unit.components
        )
        found[axis] = Multisine(tuple(parts))
    return found


def _extremes(motion: Multisine, duration_s: float) -> Array:
    """Highest and lowest position, and largest speed and acceleration."""
    way = reference(motion, np.arange(0.0, duration_s, SAMPLE_S), 1.0, 0.0)
    return np.array(
        [
            way.position_rad.max(),
            -way.position_rad.min(),
            np.abs(way.velocity_rad_s).max(),
            np.abs(way.acceleration_rad_s2).max(),
        ]
    )


def _setpoint(way: Reference, k: int) -> Setpoint:
    return Setpoint(
        float(way.position_rad[k]), float(way.velocity_rad_s[k]), float(way.acceleration_rad_s2[k])
    )

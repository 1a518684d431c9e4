"""How much better axes follow with gains that know an effect, on machines that no one has seen.

    python tools/cure_benchmark.py --machines 3
    python tools/cure_benchmark.py --effects backlash torque_ripple --seed 40 --rows rows.jsonl

Each machine is a random feed drive of the independent plant with one effect on one axis, clearly
there. It makes one multisine in its own loop, without feed-forward. `identify` finds its model from
that recording, diagnosis included. Two sets of gains are designed: from the base model alone, and
from the model with what the diagnosis found. With each, the machine makes another multisine, of
other frequencies, inside the range of the first. The error is the distance of the table from its
reference, rms after the lead-in; with an encoder on the motor, the board does not see it. The ratio
says how many times smaller the effects of the model make it.
"""

import argparse
import json
import statistics
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.control.gain_design import GainDesign, design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.drive.description import load_drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.errors import EdgeIdentError
from edge_ident.identification.identify import identify
from edge_ident.model.model import AxisModel, base_axis
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.gains import OFF, AxisGains
from firmware_interface.motion import Multisine, Reference, SineComponent, reference
from firmware_interface.plant import COUNT_RAD, EFFECTS, Drives, Effect, Plant, draw, draw_drives
from firmware_interface.plant import Motion as PlantMotion
from firmware_interface.plant.hiding import CLEAR
from firmware_interface.plant.motions import LEAD, SAMPLE_S, TAIL
from firmware_interface.plant.plant import DELAY
from firmware_interface.virtual.controller import AxisController, Setpoint

Array = NDArray[np.float64]

AXES: Final = ("x", "z")
_EFFORT_STEP_NM: Final = 0.004
_EFFORT_LIMIT_NM: Final = 25.0
_NOISE: Final = 0.02
"""Of the recorded effort, over its rms."""
_LEAD_IN_S: Final = 3.0
_DURATION_S: Final = 15.0
"""Of the motion that is judged."""
_INSIDE: Final = 0.9
"""Of the range of the identification's motion, that the judged one uses."""
_HIGHEST_HZ: Final = 1.0


@dataclass(frozen=True)
class Machine:
    """A drive with an effect on one of its axes."""

    drives: Drives
    effects: Sequence[Effect]
    axis: str

    def follow(
        self, banks: Mapping[str, AxisGains], motions: Mapping[str, Multisine], duration_s: float
    ) -> "Followed":
        """Move from rest, in the loop of a board."""
        plant = Plant(self.drives, self.effects, lead_in_s=_LEAD_IN_S)
        laws = [AxisController(banks[axis], SAMPLE_S, _EFFORT_LIMIT_NM) for axis in AXES]
        times = np.arange(-round(_LEAD_IN_S / SAMPLE_S), round(duration_s / SAMPLE_S)) * SAMPLE_S
        ways = [reference(motions[axis], times, _LEAD_IN_S, 0.0) for axis in AXES]
        rows = []
        for k in range(len(times)):
            shown = [round(angle / COUNT_RAD) * COUNT_RAD for angle in plant.shown_rad]
            points = [_setpoint(way, k) for way in ways]
            command = [
                round(law.effort_nm(point, angle, other) / _EFFORT_STEP_NM) * _EFFORT_STEP_NM
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


@dataclass(frozen=True)
class Row:
    """One machine."""

    effect: str
    seed: int
    trusted: bool
    found: tuple[str, ...]
    rigid_mrad: float
    map3_mrad: float
    cured_mrad: float
    bandwidths_rad_s: tuple[float, float]
    used: tuple[str, ...]
    unused: tuple[str, ...]

    @property
    def ratio(self) -> float:
        """How many times smaller the error became."""
        return self.rigid_mrad / self.cured_mrad


def measured(effect: str, seed: int) -> Row:
    """Hide an effect in a machine, identify it, and judge the gains."""
    rng = np.random.default_rng([seed, EFFECTS.index(effect)])
    trajectory = named_trajectory(load_drive(), "multisine", 1)
    motions = dict(trajectory.axes)
    machine = _machine(effect, motions, trajectory.duration_s, rng)
    recording = machine.follow(_own_gains(machine), motions, trajectory.duration_s).recording(rng)
    found = identify(recording)
    judged = _other_motions(motions, trajectory.duration_s, rng)
    hardware = LoopHardware(SAMPLE_S, DELAY * SAMPLE_S, COUNT_RAD, _EFFORT_LIMIT_NM)
    old = LoopHardware(SAMPLE_S, DELAY * SAMPLE_S, COUNT_RAD, _EFFORT_LIMIT_NM, None, 3)
    base = {name: axis.base.estimate if axis.base else axis.estimate for name, axis in found.axes.items()}
    rigid = {name: design(base_axis(estimate), hardware) for name, estimate in base.items()}
    cured = {name: design(axis.model, hardware) for name, axis in found.axes.items()}
    before = {name: design(axis.model, old) for name, axis in found.axes.items()}
    errors = [
        1e3 * machine.follow(_gains(some), judged, _DURATION_S).error_rad(machine.axis)
        for some in (rigid, before, cured)
    ]
    own = cured[machine.axis]
    terms = found.axes[machine.axis].model.terms[1:]
    return Row(
        effect,
        seed,
        found.trusted,
        tuple(term.effect for term in terms),
        *errors,
        (rigid[machine.axis].bandwidth_rad_s, own.bandwidth_rad_s),
        tuple(f"{u.effect}: {u.sentence}" for u in own.used),
        tuple(f"{u.effect}: {u.reason}" for u in own.unused),
    )

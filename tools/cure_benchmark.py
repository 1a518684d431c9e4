"""How much better axes follow with gains that know an effect, on machines that no one has seen.

    python tools/cure_benchmark.py --machines 3
    python tools/cure_benchmark.py --effects backlash torque_ripple --seed 40 --rows rows.jsonl

Each machine is a random feed drive of the independent plant with one effect on one axis, clearly
there. It makes one multisine in its own loop, without feed-forward. `identify` finds its model from
that recording, diagnosis included. Two sets of gains are designed: from the base model alone, and
from the model with what the diagnosis found. With each, the machine makes another multisine, of
other frequencies, inside the range of the first and right after it: what warms is warm by then. The
error is the distance of the table from its
reference, rms after the lead-in; with an encoder on the motor, the board does not see it. The ratio
says how many times smaller the effects of the model make it.
"""

import argparse
import json
import statistics
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
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
from edge_ident.identification.result import AxisIdentification
from edge_ident.model.model import AxisModel, base_axis
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Multisine, Reference, SineComponent, reference
from firmware_interface.plant import COUNT_RAD, EFFECTS, Drives, Effect, Plant, draw, draw_drives
from firmware_interface.plant import Motion as PlantMotion
from firmware_interface.plant.hiding import CLEAR
from firmware_interface.plant.motions import LEAD, SAMPLE_S, TAIL
from firmware_interface.plant.plant import DELAY
from firmware_interface.virtual.controller import AxisController, Setpoint
from firmware_interface.virtual.settings import CONSERVATIVE_GAINS

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
        self,
        banks: Mapping[str, AxisGains],
        motions: Mapping[str, Multisine],
        duration_s: float,
        begins_s: float = -_LEAD_IN_S,
    ) -> "Followed":
        """Move from rest, in the loop of a board; the effects' clock begins at a time."""
        plant = Plant(self.drives, self.effects, lead_in_s=-begins_s)
        laws = [AxisController(banks[axis], SAMPLE_S, _EFFORT_LIMIT_NM) for axis in AXES]
        first, last = -round(_LEAD_IN_S / SAMPLE_S), round(duration_s / SAMPLE_S)
        times = np.arange(first, last, dtype=np.float64) * SAMPLE_S
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
    """One machine.

    Attributes
    ----------
    errors_mrad : tuple of three floats
        With gains of the base model, of a board of register map 3, and of one of map 4.
    bandwidths_rad_s : tuple of two floats
        Of the base model's gains, and of the cured ones.
    """

    effect: str
    seed: int
    trusted: bool
    found: tuple[str, ...]
    errors_mrad: tuple[float, ...]
    bandwidths_rad_s: tuple[float, float]
    used: tuple[str, ...]
    unused: tuple[str, ...]

    @property
    def ratio(self) -> float:
        """How many times smaller the error became."""
        return self.errors_mrad[0] / self.errors_mrad[-1]


def measured(effect: str, seed: int) -> Row:
    """Hide an effect in a machine, identify it, and judge the gains."""
    rng = np.random.default_rng([seed, EFFECTS.index(effect)])
    trajectory = named_trajectory(load_drive(), "multisine", 1)
    after_s = trajectory.duration_s
    motions = {name: way for name, way in trajectory.axes.items() if isinstance(way, Multisine)}
    machine = _machine(effect, motions, after_s, rng)
    recording = machine.follow(_own_gains(machine), motions, after_s).recording(rng)
    found = identify(recording)
    judged = _other_motions(motions, after_s, rng)
    hardware = LoopHardware(SAMPLE_S, DELAY * SAMPLE_S, COUNT_RAD, _EFFORT_LIMIT_NM)
    old = LoopHardware(SAMPLE_S, DELAY * SAMPLE_S, COUNT_RAD, _EFFORT_LIMIT_NM, None, 3)
    rigid = {name: design(_base(axis), hardware) for name, axis in found.axes.items()}
    before, cured = (
        {name: design(axis.model, some, at_s=axis.end_s) for name, axis in found.axes.items()}
        for some in (old, hardware)
    )
    errors = tuple(
        1e3 * machine.follow(_gains(some), judged, _DURATION_S, after_s).error_rad(machine.axis)
        for some in (rigid, before, cured)
    )
    own = cured[machine.axis]
    terms = found.axes[machine.axis].model.terms[1:]
    return Row(
        effect,
        seed,
        found.trusted,
        tuple(term.effect for term in terms),
        errors,
        (rigid[machine.axis].bandwidth_rad_s, own.bandwidth_rad_s),
        tuple(f"{u.effect}: {u.sentence}" for u in own.used),
        tuple(f"{u.effect}: {u.reason}" for u in own.unused),
    )


def _base(axis: AxisIdentification) -> AxisModel:
    """The base model alone, of the same recording."""
    return base_axis(axis.least_squares, supported=axis.model.terms[0].supported)


def _machine(
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


def _own_gains(machine: Machine) -> dict[str, AxisGains]:
    """The drive's own feedback, without feed-forward."""
    control = machine.drives.control
    return {
        axis: replace(
            CONSERVATIVE_GAINS,
            proportional=float(control.position_gain[0, i]),
            derivative=float(control.velocity_gain[0, i]),
            velocity_filter_s=float(control.filter_s[0, i]),
        )
        for i, axis in enumerate(AXES)
    }


def _other_motions(
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
        room = _extremes(motion, duration_s) / _extremes(unit, _DURATION_S)
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


def _gains(designs: Mapping[str, GainDesign]) -> dict[str, AxisGains]:
    return {axis: found.gains for axis, found in designs.items()}


def main(arguments: Sequence[str]) -> int:
    """Measure, and print a line per machine and the medians."""
    options = _options(arguments)
    rows: dict[str, list[Row]] = {}
    for effect in options.effects:
        for seed in range(options.seed, options.seed + options.machines):
            try:
                row = measured(effect, seed)
            except EdgeIdentError as error:
                print(f"{effect} {seed}: {error}", flush=True)
                continue
            rows.setdefault(effect, []).append(row)
            print(_line(row), flush=True)
            if options.rows is not None:
                with options.rows.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({**asdict(row), "ratio": row.ratio}) + "\n")
    print(f"\n{'effect':30} machines  named  median ratio")
    for effect, some in rows.items():
        named = sum(effect in row.found for row in some)
        ratio = statistics.median(row.ratio for row in some)
        print(f"{effect:30} {len(some):8} {named:6} {ratio:13.2f}")
    return 0


def _line(row: Row) -> str:
    rigid, before, cured = row.errors_mrad
    return (
        f"{row.effect} {row.seed}: {rigid:.3g} mrad, with map 3 {before:.3g}, "
        f"cured {cured:.3g} ({row.ratio:.2f} times smaller); found "
        f"{', '.join(row.found) or 'nothing'}; {'; '.join((*row.used, *row.unused))}"
        f"{'' if row.trusted else '; not trusted'}"
    )


def _options(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--effects", nargs="+", choices=EFFECTS, default=EFFECTS)
    parser.add_argument("--machines", type=int, default=3, help="of each effect")
    parser.add_argument("--seed", type=int, default=1, help="of the first machine")
    parser.add_argument("--rows", type=Path, help="file that a line of JSON is added to for each")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

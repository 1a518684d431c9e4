"""How much better axes follow with gains that know an effect, on machines that no one has seen.

    python tools/cure_benchmark.py --machines 3
    python tools/cure_benchmark.py --effects backlash torque_ripple --seed 40 --rows rows.jsonl

Each machine is a random feed drive of the independent plant with one effect on one axis, clearly
there. It makes one multisine in its own loop, without feed-forward, and gets gains from the base
model of that recording. With these it makes the same multisine again. `identify` finds its model
from this second recording, diagnosis included, and gains are designed from it: from the base model
alone, and from the model with what the diagnosis found.

With each, the machine makes another multisine, of other frequencies, inside the range of the first
and right after it: what warms is warm by then. The error is the distance of the table from its
reference, rms after the lead-in; with an encoder on the motor, the board does not see it. The ratio
says how many times smaller the effects of the model make the error, against the better one of the
two base models.
"""

import argparse
import json
import statistics
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from edge_ident.control.gain_design import GainDesign, design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.drive.description import load_drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.errors import EdgeIdentError
from edge_ident.identification.identify import identify
from edge_ident.identification.result import AxisIdentification, Identification
from edge_ident.model.model import AxisModel, base_axis
from firmware_interface.gains import CONSERVATIVE_GAINS, AxisGains
from firmware_interface.motion import Multisine
from firmware_interface.plant import COUNT_RAD, EFFECTS
from firmware_interface.plant.motions import SAMPLE_S
from firmware_interface.plant.plant import DELAY
from firmware_interface.registers import AXES
from tools.cure_machines import (
    DURATION_S,
    EFFORT_LIMIT_NM,
    Machine,
    drawn_machine,
    other_motions,
)


@dataclass(frozen=True)
class Row:
    """One machine.

    Attributes
    ----------
    errors_mrad : tuple of three floats
        With gains of the better base model, of a board of register map 3, and of one of map 4.
    """

    effect: str
    seed: int
    trusted: bool
    found: tuple[str, ...]
    errors_mrad: tuple[float, ...]
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
    machine = drawn_machine(effect, motions, after_s, rng)
    hardware = LoopHardware(SAMPLE_S, DELAY * SAMPLE_S, COUNT_RAD, EFFORT_LIMIT_NM)
    first = identify(
        machine.follow(_own_gains(machine), motions, after_s).recording(rng), diagnose=False
    )
    plain = _gains(_rigid(first, hardware))
    found = identify(machine.follow(plain, motions, after_s).recording(rng))
    judged = other_motions(motions, after_s, rng)
    old = LoopHardware(SAMPLE_S, DELAY * SAMPLE_S, COUNT_RAD, EFFORT_LIMIT_NM, None, 3)
    before, cured = (
        {name: design(axis.model, some, at_s=axis.end_s) for name, axis in found.axes.items()}
        for some in (old, hardware)
    )
    first_error, *errors = (
        1e3 * machine.follow(gains, judged, DURATION_S, after_s).error_rad(machine.axis)
        for gains in (plain, *map(_gains, (_rigid(found, hardware), before, cured)))
    )
    own = cured[machine.axis]
    terms = found.axes[machine.axis].model.terms[1:]
    return Row(
        effect,
        seed,
        found.trusted,
        tuple(term.effect for term in terms),
        (min(first_error, errors[0]), *errors[1:]),
        tuple(f"{u.effect}: {u.sentence}" for u in own.used),
        tuple(f"{u.effect}: {u.reason}" for u in own.unused),
    )


def _rigid(found: Identification, hardware: LoopHardware) -> dict[str, GainDesign]:
    return {name: design(_base(axis), hardware) for name, axis in found.axes.items()}


def _base(axis: AxisIdentification) -> AxisModel:
    """The base model alone, of the same recording."""
    return base_axis(axis.least_squares, supported=axis.model.terms[0].supported)


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

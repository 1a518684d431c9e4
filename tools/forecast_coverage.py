"""How often the forecast's 90 % intervals hold the tracking error that is then measured.

    python -m tools.forecast_coverage --machines 100 --seed 7000
    python -m tools.forecast_coverage --whole --motion multisine --strength 0.5 0.9

Random machines of the independent plant, some with a hidden effect. Each is identified and, where
its base model is not enough, diagnosed. Short motions hide most effects; whole multisines show
them. Gains are designed, forecast on both motions, put in force without a verdict, and measured.
Axes are counted by their diagnosis: it is wrong where it names a cause that is not there.
"""

import argparse
import math
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from edge_ident.commissioning.drawn_loads import Grounds, RecordedMotion
from edge_ident.commissioning.further_motions import second_motion, within_limits
from edge_ident.commissioning.gain_change import check_change
from edge_ident.commissioning.promise import Errors, Promise, promised
from edge_ident.commissioning.run import board_designs
from edge_ident.commissioning.tracking_forecast import of_motor
from edge_ident.control.position_loop import LoopHardware
from edge_ident.drive.motions import MOTIONS, MotionName, named_trajectory
from edge_ident.errors import EdgeIdentError
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from firmware_interface.gains import Bank
from tools.judged_machines import JudgedMachine, judged_machine, why

_KEPT = "whole promise kept"
Row = tuple[str, float, bool, bool]
"""What was forecast, measured over forecast, whether its interval holds it, and its limit."""


@dataclass(frozen=True)
class Tried:
    """New gains on one machine: what was known before them, and what was recorded.

    Attributes
    ----------
    kinds : mapping of axis name to str
        How right its diagnosis is.
    grounds : Grounds
    hardware : mapping of axis name to LoopHardware
    active, wanted : mapping of axis name to AxisGains
    motions : mapping of motion to pair of RecordedMotion
        With the gains in force, and with the wanted ones.
    """

    kinds: Mapping[str, str]
    grounds: Grounds
    hardware: Mapping[str, LoopHardware]
    active: Bank
    wanted: Bank
    motions: Mapping[str, tuple[RecordedMotion, RecordedMotion]]

    def promise(self) -> Promise:
        """What was forecast, and what was measured."""
        promise = Promise(
            {
                name: promised(before, self.grounds, self.hardware, self.active, self.wanted)
                for name, (before, _) in self.motions.items()
            }
        )
        return promise.measured(
            {
                name: {axis: Errors.of(after.errors(axis)) for axis in after.references}
                for name, (_, after) in self.motions.items()
            }
        )


def main() -> None:
    """Print the table, after every machine."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--seed", type=int, default=7000)
    parser.add_argument("--clean", type=float, default=0.5, help="share without a hidden effect")
    parser.add_argument(
        "--strength", type=float, nargs=2, default=(0.3, 0.8), help="of effects, 0 faint, 1 strong"
    )
    parser.add_argument("--motion", choices=MOTIONS[:2], default="sinusoid", help="to identify")
    parser.add_argument("--cycles", type=int, default=1, help="of this motion")
    parser.add_argument("--whole", action="store_true", help="motions at their whole length")
    options = parser.parse_args()
    rows: dict[str, list[Row]] = defaultdict(list)
    ends: Counter[str] = Counter()
    for seed in range(options.seed, options.seed + options.machines):
        try:
            machine = drawn_machine(
                seed, options.clean, tuple(options.strength), brief=not options.whole
            )
            tried = trial(machine, options.motion, options.cycles)
        except EdgeIdentError as error:
            ends[why(error)] += 1
            continue
        ends[_machine_kind(tried) if tried else "not trusted"] += 1
        if tried:
            _add(rows, tried)
        _print(rows, ends)


def drawn_machine(
    seed: int, clean: float, strength: tuple[float, float], *, brief: bool
) -> JudgedMachine:
    """With soft gains; by chance without a hidden effect."""
    effects = int(np.random.default_rng([seed, 13]).random() >= clean)
    return judged_machine(seed, tuned=False, effects=effects, strength=strength, brief=brief)


def trial(machine: JudgedMachine, name: MotionName, cycles: int) -> Tried | None:
    """Identify a machine from a named motion and try gains; None where nothing is trusted."""
    board, drive = machine.board, machine.drive
    board.enable()
    capture, _ = machine.move(named_trajectory(drive, name, cycles))
    found = identify(capture.recording, None)
    if not found.trusted:
        return None
    grounds, active = Grounds.of(found), board.active_gains()
    wanted = {axis: of.gains for axis, of in board_designs(board, found).items()}
    check_change(board, active, wanted, large_steps=True)
    second = within_limits(second_motion(drive, name), grounds.model, active, board.limits())
    ways = {name: named_trajectory(drive, name, 1), second.name: second.trajectory}
    recorded = {name: capture, second.name: machine.move(second.trajectory)[0]}
    before = {
        name: RecordedMotion.along(recorded[name].recording, way) for name, way in ways.items()
    }
    board.stage_gains(wanted)
    board.commit()
    after = {
        name: RecordedMotion.along(of_motor(machine.move(way)[0].recording, wanted, way), way)
        for name, way in ways.items()
    }
    board.roll_back()
    motions = {name: (before[name], after[name]) for name in ways}
    return Tried(_kinds(machine, found), grounds, machine.hardware, active, wanted, motions)


def _kinds(machine: JudgedMachine, found: Identification) -> dict[str, str]:
    kinds = {}
    for name, axis in found.axes.items():
        diagnosis, hidden = axis.diagnosis, set(machine.hidden[name])
        named = (*diagnosis.causes, *diagnosis.minor) if diagnosis else ()
        causes = {cause.term.effect for cause in named}
        if causes - hidden:
            kinds[name] = "wrong diagnosis"
        elif not hidden:
            kinds[name] = "sound"
        else:
            kinds[name] = "right diagnosis" if causes else "hidden effect not found, trusted"
    return kinds


def _machine_kind(tried: Tried) -> str:
    """The kinds of its axes, each once."""
    return " + ".join(sorted(set(tried.kinds.values())))


def _add(rows: dict[str, list[Row]], tried: Tried) -> None:
    promise = tried.promise()
    for motion, axis, of_axis in promise.every:
        assert of_axis.measured is not None
        for quantity in ("rms", "peak"):
            expected = getattr(of_axis.after, quantity)
            measured = getattr(of_axis.measured, f"{quantity}_rad")
            within = measured <= expected.limit_rad(promise.judged)
            ratio = measured / expected.middle_rad
            row = f"{motion} {quantity}", ratio, expected.holds(measured), within
            rows[tried.kinds[axis]].append(row)
    kept = not promise.broken
    rows[_machine_kind(tried)].append((_KEPT, 1.0, kept, kept))


def _print(rows: dict[str, list[Row]], ends: Counter[str]) -> None:
    print(f"\n{sum(ends.values())} machines: {dict(ends)}")
    for kind, of_kind in rows.items():
        for what in dict.fromkeys(row[0] for row in of_kind):
            chosen = [row for row in of_kind if row[0] == what]
            share = np.mean([row[2] for row in chosen])
            spread = np.percentile([math.log(row[1]) for row in chosen], [5, 50, 95])
            ends_at = ", ".join(f"{math.exp(value):.2f}" for value in spread)
            below = np.mean([row[3] for row in chosen])
            print(
                f"{kind:34} {what:20} {len(chosen):5d} held {share:6.1%}, limit {below:6.1%}, "
                f"measured/forecast {ends_at}",
                flush=True,
            )


if __name__ == "__main__":
    main()

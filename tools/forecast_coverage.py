"""How often the forecast's 90 % intervals hold the tracking error that is then measured.

    python -m tools.forecast_coverage --machines 100 --seed 7000

Random machines of the independent plant, some with a hidden effect. Each is identified and, where
its base model is not enough, diagnosed. Gains are designed, forecast on both motions, put in force
without a verdict, and measured. Machines are counted by their diagnosis: it is wrong where it names
a cause that is not there.
"""

import argparse
import math
from collections import Counter, defaultdict

import numpy as np

from edge_ident.commissioning.drawn_loads import Grounds
from edge_ident.commissioning.gain_change import check_change
from edge_ident.commissioning.promise import Errors, Promise, promised
from edge_ident.commissioning.recorded_motion import Moved
from edge_ident.commissioning.run import board_designs
from edge_ident.commissioning.second_motion import second_motion, within_limits
from edge_ident.drive.motions import named_trajectory
from edge_ident.errors import EdgeIdentError
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from tools.judged_machines import JudgedMachine, judged_machine, why

Row = tuple[str, float, bool, bool]
"""What was forecast, measured over forecast, whether its interval holds it, and its limit."""


def main() -> None:
    """Print the table, after every machine."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--seed", type=int, default=7000)
    parser.add_argument("--clean", type=float, default=0.5, help="share without a hidden effect")
    options = parser.parse_args()
    rows: dict[str, list[Row]] = defaultdict(list)
    ends: Counter[str] = Counter()
    for seed in range(options.seed, options.seed + options.machines):
        effects = int(np.random.default_rng([seed, 13]).random() >= options.clean)
        try:
            machine = judged_machine(seed, tuned=False, effects=effects)
            kind, found = _judged(machine)
        except EdgeIdentError as error:
            ends[why(error)] += 1
            continue
        ends[kind] += 1
        rows[kind] += found
        _print(rows, ends)


def _judged(machine: JudgedMachine) -> tuple[str, list[Row]]:
    board, drive = machine.board, machine.drive
    board.enable()
    first = named_trajectory(drive, "sinusoid", 1)
    capture, _ = machine.move(first)
    found = identify(capture.recording, None)
    if not found.trusted:
        return "not trusted", []
    kind, grounds = _kind(machine, found), Grounds.of(found)
    active = board.active_gains()
    wanted = {name: of.gains for name, of in board_designs(board, found).items()}
    check_change(board, active, wanted, large_steps=True)
    motion = second_motion(drive, "sinusoid")
    second = within_limits(motion, grounds.model, active, board.limits()).trajectory
    motions = {"sinusoid": (first, capture), "multisine": (second, machine.move(second)[0])}
    promise = Promise(
        {
            name: promised(
                Moved.along(of.recording, way), grounds, machine.hardware, active, wanted
            )
            for name, (way, of) in motions.items()
        }
    )
    board.stage_gains(wanted)
    board.commit()
    after = {
        name: Moved.along(machine.move(way)[0].recording, way) for name, (way, _) in motions.items()
    }
    board.roll_back()
    errors = {
        name: {axis: Errors.of(moved.errors(axis)) for axis in moved.ways}
        for name, moved in after.items()
    }
    return kind, _rows(promise.measured(errors))


def _kind(machine: JudgedMachine, found: Identification) -> str:
    causes = {
        cause.term.effect
        for axis in found.axes.values()
        if axis.diagnosis is not None
        for cause in (*axis.diagnosis.causes, *axis.diagnosis.minor)
    }
    if causes - set(machine.hidden):
        return "wrong diagnosis"
    if not machine.hidden:
        return "sound"
    return "right diagnosis" if causes else "hidden effect not found, trusted"


def _rows(promise: Promise) -> list[Row]:
    found = []
    for motion, _, of_axis in promise.every:
        assert of_axis.measured is not None
        for quantity in ("rms", "peak"):
            expected = getattr(of_axis.after, quantity)
            measured = getattr(of_axis.measured, f"{quantity}_rad")
            within = measured <= expected.limit_rad(promise.judged)
            ratio = measured / expected.middle_rad
            found.append((f"{motion} {quantity}", ratio, expected.holds(measured), within))
    kept = not promise.broken
    found.append(("whole promise kept", 1.0, kept, kept))
    return found


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

"""Does a run find out by itself what is wrong? Runs on virtual drives that hide drawn faults.

    python -m tools.run_campaign single --first 1000 --count 100 --output single.jsonl
    python -m tools.run_campaign pair --first 1000 --count 30 --output pair.jsonl
    python -m tools.run_campaign sound --first 1000 --count 50 --output sound.jsonl

`single` and `pair` take the seeds whose draw of `run --device virtual --hide-seed N` has one fault
or two, each above the tolerance: with it alone, the base model leaves at least 1 % of the effort on
the drive's own sinusoid. `sound` takes random drives with nothing wrong. Every run begins with the
sinusoid, and its clock is that of the board.

`--arms` compares: `run` designs its further motions; `one` makes none; `multisine`, `staircase` and
`random` (the multisine with random phases) make as many as `run` did, each as long.

A line of the output is one run. What stands in the file is not repeated, and the table counts it.
"""

import argparse
import json
import math
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

import edge_ident
from edge_ident.commissioning.motion.safety import ready_to_move
from edge_ident.commissioning.run import Plan, commission
from edge_ident.commissioning.study.identification_motions import (
    IdentificationMotion,
    Study,
    capture_file,
    captured,
    identified,
)
from edge_ident.commissioning.study.separation import judged
from edge_ident.diagnosis.tolerance import TOLERANCE
from edge_ident.drive.description import load_drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.errors import EdgeIdentError
from edge_ident.identification.identify import identify
from edge_ident.identification.result import AxisIdentification, Identification
from firmware_interface.gains import CONSERVATIVE_GAINS, FEEDBACK, AxisGains
from firmware_interface.motion import Multisine, Trajectory
from firmware_interface.plant import Hidden, Plant, draw_drives
from tests.short_runs import Silent
from tools.campaign_scores import line, scored, table

_RIGID: Final = {
    *FEEDBACK,
    "inertia_feedforward",
    "viscous_feedforward",
    "coulomb_feedforward",
    "coulomb_smoothing_rad_s",
    "offset_feedforward",
}
_FAULTS: Final = {"single": 1, "pair": 2, "sound": 0}
_ARMS: Final = ("run", "one", "multisine", "staircase", "random")
Row = dict[str, Any]


def plant(kind: str, seed: int) -> tuple[Plant, list[Row]]:
    """A drive, and what is wrong with it."""
    if kind == "sound":
        return Plant(draw_drives(1, seed)), []
    hidden = Hidden.drawn(seed)
    return hidden.plant(), [asdict(fault) for fault in hidden.faults]


def above_tolerance(seed: int) -> bool:
    """Whether the base model leaves enough of the sinusoid with each fault alone.

    A fault that is so strong that the board stops the motion does not count.
    """
    hidden = Hidden.drawn(seed)
    for effect, fault in zip(hidden.effects, hidden.faults, strict=True):
        try:
            with studied(Hidden((effect,), (fault,)).plant(), 1) as study:
                capture = captured(study, named_trajectory(study.drive, "sinusoid"), 1)
                study.board.finish()
        except EdgeIdentError:
            return False
        axis = identify(capture.recording, diagnose=False).axes[fault.axis]
        if axis.adequacy.relative_residual < TOLERANCE:
            return False
    return True


@contextmanager
def studied(behind: Plant, most: int) -> Iterator[Study]:
    """A board that is ready to move, with a drive behind it."""
    with (
        tempfile.TemporaryDirectory() as folder,
        edge_ident.connect("virtual", plant=behind) as board,
        ready_to_move(board, Silent().say),
    ):
        yield Plan(most_motions=most).study(board, load_drive(), None, Path(folder), Silent())


def run(kind: str, seed: int, arm: str, motions: int) -> Row:
    """One run; `motions` is how many the arm makes where it does not decide by itself."""
    behind, faults = plant(kind, seed)
    started_s = time.process_time()
    try:
        found = _decides(behind, motions) if arm in ("run", "one") else _told(behind, arm, motions)
    except EdgeIdentError as error:
        found = {"axes": {}, "error": error.cause}
    row = {"kind": kind, "seed": seed, "arm": arm, "faults": faults, **found}
    return {**row, **scored(row), "processor_s": round(time.process_time() - started_s, 2)}


def _decides(behind: Plant, most: int) -> Row:
    """What `edge-ident run` does."""
    with (
        tempfile.TemporaryDirectory() as folder,
        edge_ident.connect("virtual", plant=behind) as board,
    ):
        plan = Plan(most_motions=most)
        outcome = commission(board, load_drive(), None, plan, Path(folder), Silent())
    compensated = [_compensated(design.gains) for design in outcome.designs.values()]
    made = outcome.separation.motions
    return {
        "axes": _axes(outcome.identification),
        "motions": len(made),
        "seconds": round(sum(motion.duration_s for motion in made), 1),
        "ended": outcome.separation.ended,
        "conclusion": outcome.conclusion,
        "rigid_gains": not any(compensated),
    }


def _told(behind: Plant, arm: str, motions: int) -> Row:
    """Motions that somebody chose beforehand, diagnosed together."""
    with studied(behind, motions) as study:
        first = named_trajectory(study.drive, "sinusoid")
        capture = captured(study, first, 1)
        study.board.finish()
        found = identified(study, capture.recording)
        made = [IdentificationMotion(capture_file(1), first, capture, found)]
        for number in range(2, motions + 1):
            trajectory = _chosen(arm, study, first, number)
            capture = captured(study, trajectory, number, made[0].capture)
            study.board.finish()
            last = IdentificationMotion(capture_file(number), trajectory, capture, made[-1].found)
            made.append(judged(study, made, last))
    seconds = round(sum(one.duration_s for one in made), 1)
    return {"axes": _axes(made[-1].found), "motions": motions, "seconds": seconds}


def _chosen(arm: str, study: Study, first: Trajectory, number: int) -> Trajectory:
    """A fixed motion, as long as the sinusoid; with other phases, no faster than the multisine."""
    if arm != "random":
        return replace(named_trajectory(study.drive, arm), duration_s=first.duration_s)  # type: ignore[arg-type]
    fixed = named_trajectory(study.drive, "multisine")
    rng = np.random.default_rng([number, 17])
    axes = {}
    for name, motion in fixed.axes.items():
        assert isinstance(motion, Multisine)
        phases = rng.uniform(-math.pi, math.pi, len(motion.components))
        axes[name] = Multisine(
            tuple(
                replace(sine, phase_rad=float(phase))
                for sine, phase in zip(motion.components, phases, strict=True)
            )
        )
    return replace(fixed, axes=axes)


def _compensated(gains: AxisGains) -> list[str]:
    """Gains beyond those of a rigid body that are not as in the soft ones, where they are off."""
    off = CONSERVATIVE_GAINS.numbers()
    return [n for n, value in gains.numbers().items() if n not in _RIGID and value != off[n]]


def _axes(found: Identification) -> Row:
    return {name: _axis(axis) for name, axis in found.axes.items()}


def _axis(axis: AxisIdentification) -> Row:
    diagnosis = axis.diagnosis
    if diagnosis is None:
        return {"verdict": "adequate", "causes": [], "minor": [], "rivals": [], "suspected": []}
    return {
        "verdict": diagnosis.verdict.value,
        "causes": list(dict.fromkeys(cause.term.effect for cause in diagnosis.causes)),
        "minor": list(dict.fromkeys(cause.term.effect for cause in diagnosis.minor)),
        "rivals": [other.effect for cause in diagnosis.causes for other in cause.inseparable],
        "suspected": [cause.term.effect for cause in diagnosis.suspected],
    }


def cases(
    kind: str, first: int, count: int, known: Mapping[int, bool]
) -> Iterator[tuple[int, bool]]:
    """Seeds, and whether each counts, until enough of them do."""
    seed = first
    while count:
        counts = kind == "sound" or (
            len(Hidden.drawn(seed).faults) == _FAULTS[kind]
            and (known[seed] if seed in known else above_tolerance(seed))
        )
        count -= counts
        yield seed, counts
        seed += 1


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kind", choices=_FAULTS)
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--count", type=int, default=20, help="seeds that count")
    parser.add_argument("--arms", default="run", help="of " + ", ".join(_ARMS))
    parser.add_argument("--output", type=Path, required=True)
    given = parser.parse_args()
    rows = [json.loads(line) for line in given.output.open()] if given.output.exists() else []
    done = {(row["seed"], row["arm"]): row for row in rows if row["kind"] == given.kind}
    counted = {seed: row["counts"] for (seed, arm), row in done.items() if arm == "counts"}
    with given.output.open("a") as file:
        for seed, counts in cases(given.kind, given.first, given.count, counted):
            if seed not in counted:
                _write(file, {"kind": given.kind, "seed": seed, "arm": "counts", "counts": counts})
            for arm in given.arms.split(",") if counts else ():
                if (seed, arm) not in done:
                    own = done.get((seed, "run"), {"motions": 1}).get("motions", 1)
                    motions = {"run": Plan().most_motions, "one": 1}.get(arm, own)
                    done[seed, arm] = _row(given.kind, seed, arm, motions, done)
                    _write(file, done[seed, arm])
                    print(line(done[seed, arm]), flush=True)
    print(table(done.values()))


def _row(kind: str, seed: int, arm: str, motions: int, done: Mapping[tuple[int, str], Row]) -> Row:
    """One run; an arm that makes no further motion is what `run` was, if that made none."""
    if arm != "run" and motions == 1 and (seed, "run") in done:
        return {**done[seed, "run"], "arm": arm}
    return run(kind, seed, arm, motions)


def _write(file: Any, row: Row) -> None:
    file.write(json.dumps(row) + "\n")
    file.flush()


if __name__ == "__main__":
    main()

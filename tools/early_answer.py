"""What `run --until` saves, and what it costs: on virtual drives with random parameters.

    python -m tools.early_answer sound --count 100 --until 0.02 --output sound.jsonl
    python -m tools.early_answer single --first 1000 --count 100 --output single.jsonl

`sound` takes random drives with nothing wrong, `single` those that hide one drawn fault, as
`tools.run_campaign` makes them. Every drive makes the motion twice, whole and with `--until`, and
both are identified without a network and without a diagnosis. An error is that of a parameter over
its true value; of the offset, over the true Coulomb friction. Of hidden faults, it counts whether
the base model is found inadequate.

A line of the output is one drive. What stands in the file is not repeated, and the table counts it.
"""

import argparse
import json
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from edge_ident.commissioning.motion.capture import come_to_rest
from edge_ident.commissioning.study.early_answer import Looks
from edge_ident.commissioning.study.identification_motions import captured
from edge_ident.drive.motions import MOTIONS, named_trajectory
from edge_ident.errors import EdgeIdentError
from edge_ident.identification.identify import identify
from edge_ident.model.model import NORMAL_95, PARAMETERS
from firmware_interface.plant import Hidden, draw_drives
from firmware_interface.registers import AXES
from tools.run_campaign import plant, studied

Row = dict[str, Any]
_ARMS: Final = ("whole", "until")


def seeds(kind: str, first: int, count: int) -> Iterator[int]:
    """Those of drives of this kind."""
    while count:
        if kind == "sound" or len(Hidden.drawn(first).faults) == 1:
            count -= 1
            yield first
        first += 1


def row(kind: str, seed: int, motion: Any, cycles: int, until: float) -> Row:
    """One drive, with and without the option."""
    began_s = time.process_time()
    asked = {"kind": kind, "seed": seed, "motion": motion, "cycles": cycles, "asked": until}
    try:
        found: Row = {arm: _one(kind, seed, motion, cycles, until, arm) for arm in _ARMS}
    except EdgeIdentError as error:
        found = {"error": error.cause}
    return {**asked, **found, "processor_s": round(time.process_time() - began_s, 2)}


def _one(kind: str, seed: int, motion: Any, cycles: int, until: float, arm: str) -> Row:
    with studied(plant(kind, seed)[0], 1) as study:
        trajectory = named_trajectory(study.drive, motion, cycles)
        looks = Looks(study, trajectory, until)
        enough = looks.enough if arm == "until" else None
        capture = captured(study, trajectory, 1, enough=enough)
        come_to_rest(study.board, capture)
        found = identify(capture.recording, diagnose=False)
        answer = looks.answer(capture, found)
    truth = draw_drives(1, seed).chain.rigid_body[0] if kind == "sound" else None
    axes = {}
    for index, name in enumerate(AXES):
        axis = found.axes[name]
        axes[name] = {"adequate": axis.adequacy.adequate, "trusted": axis.trusted}
        if truth is not None:
            inertia, viscous, coulomb, _ = truth[index]
            errors = np.abs(axis.estimate.parameters - truth[index])
            covered = errors <= NORMAL_95 * axis.estimate.std
            relative = errors / [inertia, viscous, coulomb, coulomb]
            axes[name] |= {"errors": relative.tolist(), "covered": covered.tolist()}
    return {"share": answer.share, "reached": answer.reached, "axes": axes}


def table(rows: Iterable[Row]) -> str:
    """Shares of the motion and errors, or what became of hidden faults."""
    every = list(rows)
    made = [one for one in every if "error" not in one]
    ended = [one for one in made if one["until"]["reached"]]
    shares = [one["until"]["share"] for one in ended] or [np.nan]
    lines = [
        f"{len(made)} drives, {len(every) - len(made)} that the board stopped; "
        f"{len(ended)} motions ended early, after {min(shares):.0%} to {max(shares):.0%}, "
        f"median {np.median(shares):.0%}",
        f"share of all motions: median {np.median([one['until']['share'] for one in made]):.0%}",
    ]
    if all(one["kind"] == "sound" for one in made):
        return "\n".join([*lines, *_errors("all", made), *_errors("ended early", ended)])
    seen = [one for one in made if not _adequate(one["whole"])]
    missed = [str(one["seed"]) for one in seen if one["until"]["reached"]]
    lines.append(
        f"{len(seen)} whole motions show that the base model is inadequate; of these, "
        f"{len(missed)} ended early: {', '.join(missed) or 'none'}"
    )
    return "\n".join(lines)


def _adequate(of: Row) -> bool:
    return all(axis["adequate"] for axis in of["axes"].values())


def _errors(what: str, rows: list[Row]) -> Iterator[str]:
    if not rows:
        return
    yield f"{what}: {len(rows)} drives; errors in %, median / 90 %; 95 % intervals that hold"
    for index, parameter in enumerate(PARAMETERS):
        cells = []
        for arm in _ARMS:
            axes = [axis for one in rows for axis in one[arm]["axes"].values()]
            errors = 100.0 * np.array([axis["errors"][index] for axis in axes])
            held = np.mean([axis["covered"][index] for axis in axes])
            middle, most = np.quantile(errors, [0.5, 0.9])
            cells.append(f"{arm} {middle:.2f} / {most:.2f}, {held:.1%}")
        yield f"  {parameter:16} {'   '.join(cells)}"


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kind", choices=("sound", "single"))
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--count", type=int, default=100, help="drives")
    parser.add_argument("--motion", choices=MOTIONS, default="sinusoid")
    parser.add_argument("--cycles", type=int, default=1)
    parser.add_argument("--until", type=float, default=0.02, help="a fraction")
    parser.add_argument("--output", type=Path, required=True)
    given = parser.parse_args()
    rows = [json.loads(line) for line in given.output.open()] if given.output.exists() else []
    done = {one["seed"] for one in rows}
    with given.output.open("a") as file:
        for seed in seeds(given.kind, given.first, given.count):
            if seed not in done:
                rows.append(row(given.kind, seed, given.motion, given.cycles, given.until))
                file.write(json.dumps(rows[-1]) + "\n")
                file.flush()
    print(table(rows))


if __name__ == "__main__":
    main()

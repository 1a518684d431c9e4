"""Designed motions on random drives of the independent plant: is any limit exceeded?

Every drive hides an effect and has limits and a controller of its own, which the plan does not
know. The designed motion is then simulated on that very machine, flexible parts, friction and
overshoot included, from rest to rest.

    python -m tools.planned_motions --drives 1000
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from edge_ident.drive.description import Drive
from edge_ident.errors import DataError
from edge_ident.experiment.plan import plan_motion
from edge_ident.experiment.result import MotionPlan
from edge_ident.model.effects import catalogue, named
from tests.planned import Hidden, Peaks, diagnosed, followed, hidden, random_limits

_BATCH = 84
_SHOWN = 8  # exceedances that a line shows, the largest first
# What is compared with which limit; `tests.planned.Peaks` says how it is measured.
_LIMITS = {
    "travel": "travel_limit_rad",
    "speed": "speed_limit_rad_s",
    "acceleration": "acceleration_limit_rad_s2",
    "effort": "effort_limit_nm",
    "jolt": "acceleration_limit_rad_s2",
}


_NONE = MotionPlan(None, {}, (), (), 0.0, "", 0)  # of a drive whose limits allow no motion


@dataclass(frozen=True)
class Designed:
    """One drive and its plan.

    Attributes
    ----------
    effect : str
    drive : Drive
    plan : MotionPlan
    seconds : float
        Processor time of the design.
    shares : mapping of str to float
        Peaks of the simulated machine over the limits; empty without a motion.
    """

    effect: str
    drive: Drive
    plan: MotionPlan
    seconds: float
    shares: dict[str, float]


def lasting() -> list[str]:
    """Effects of one axis that come back with every motion, and that can be fitted alone.

    A limit of the effort cannot: the lower it is, the less is left of the recording.
    """
    return [
        name
        for name, effect in catalogue().items()
        if not effect.tied_to_time
        and not effect.needs_source
        and not effect.effort_delay
        and any(form.linear for form in effect.search.forms)
    ]


def designed(effect: str, count: int, seed: int, budget: float = 1.0) -> Iterator[Designed]:
    """Plans for drives that hide an effect, and what their machines make of them."""
    found = hidden(effect, count, seed)
    alternatives = [name for name in named(effect).search.alternatives if name in lasting()]
    planned = []
    for number, recording in enumerate(found.recordings):
        diagnosis = diagnosed(recording, effect, *alternatives)
        drive = random_limits(found, number, 1000 * seed + number)
        started_s = time.process_time()
        try:
            plan = plan_motion(diagnosis, [recording], drive, budget=budget)
        except DataError as error:
            print(f"{effect}, drive {number}: {error}", flush=True)
            plan = _NONE
        planned.append((drive, plan, time.process_time() - started_s))
    peaks = _peaks(found, [(drive, plan) for drive, plan, _ in planned])
    for number, (drive, plan, seconds) in enumerate(planned):
        shares = {} if plan.trajectory is None else _shares(peaks, number, drive)
        yield Designed(effect, drive, plan, seconds, shares)


def _peaks(found: Hidden, planned: list[tuple[Drive, MotionPlan]]) -> Peaks:
    """Where there is no plan, the drive's own motion is simulated and not looked at."""
    motions = [plan.trajectory or drive.trajectory() for drive, plan in planned]
    return followed(found, motions, [drive.axes["x"].speed_limit_rad_s for drive, _ in planned])[1]


def _shares(peaks: Peaks, number: int, drive: Drive) -> dict[str, float]:
    return {
        name: float(getattr(peaks, name)[number] / getattr(drive.axes["x"], limit))
        for name, limit in _LIMITS.items()
    }


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drives", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--budget", type=float, default=1.0, help="length of the search")
    given = parser.parse_args()
    effects, done = lasting(), list[Designed]()
    for batch in range(-(-given.drives // _BATCH)):
        effect = effects[batch % len(effects)]
        count = min(_BATCH, given.drives - len(done))
        done += designed(effect, count, given.seed + batch, given.budget)
        print(f"{effect}: {_line(done[-count:])}", flush=True)
    print(f"all: {_line(done)}")


def _line(done: list[Designed]) -> str:
    moved = [one for one in done if one.shares]
    seconds = [one.seconds for one in done]
    text = f"{len(moved)} of {len(done)} drives have a motion"
    for name in _LIMITS if moved else ():
        shares = np.array([one.shares[name] for one in moved])
        over = ", ".join(f"{share:.2f}" for share in sorted(shares[shares > 1.0])[::-1][:_SHOWN])
        text += f"; {name}: {np.count_nonzero(shares > 1.0)} exceed{over and f' ({over})'}, "
        text += f"largest {np.max(shares):.2f}"
    return f"{text}; {np.mean(seconds):.2f} s each, longest {np.max(seconds):.2f} s"


if __name__ == "__main__":
    main()

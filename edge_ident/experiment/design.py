"""All axes of a drive together: what each is designed for, and the motion that is found for them.

A board moves all axes by one kind of motion. So the search is made with sums of sines and with
staircases, and the better kind is taken. Axes are searched for one after the other; each knows how
those before it move.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.drive.description import Drive
from edge_ident.errors import DataError
from edge_ident.experiment.axis_case import AxisCase
from edge_ident.experiment.limits import Load, Use
from edge_ident.experiment.search import Problem, search
from edge_ident.experiment.shapes import Shape, SineShape, StairShape, scaled
from edge_ident.model.effects import named
from firmware_interface.motion import Multisine, SineComponent, Staircase, Trajectory

Array = NDArray[np.float64]
Move = Multisine | Staircase

_BUDGET: Final = 1200.0
"""What a search may cost, about in ms of one core. The number of motions follows from it and not
from a clock, so that the same input gives the same motion."""
_PER_MOTION: Final = 5.0
_PER_TERM: Final = 0.7
_PER_MEMORY: Final = 4.0
"""Cost of a term that is integrated along the motion, in ms."""
_USUAL_S: Final = 22.0
"""Duration for which these hold."""
_SHARES: Final = {"multisine": 0.75, "staircase": 0.25}
_FEWEST_EVALUATIONS: Final = 8
_SHRINK: Final = 0.98
_MOST_SHRINKS: Final = 12
_LENGTHEN: Final = 1.25


@dataclass(frozen=True)
class DesignOfKind:
    """The best motion of one kind, and what it separates.

    Attributes
    ----------
    trajectory : Trajectory
    distances, needed : mapping of axis name to (P,) array
        Of the pairs of each axis, on this motion.
    best : mapping of axis name to (P,) array
        The largest distances of all motions of this kind that were tried.
    uses : mapping of axis name to (Use, Use)
        As commanded, and at worst.
    tried : int
    """

    trajectory: Trajectory
    distances: Mapping[str, Array]
    needed: Mapping[str, Array]
    best: Mapping[str, Array]
    uses: Mapping[str, tuple[Use, Use]]
    tried: int

    def value(self, reachable: Mapping[str, NDArray[np.bool_]]) -> tuple[int, float]:
        """How good it is: the pairs that it separates, then the smallest of their distances."""
        shares = np.concatenate([self.distances[n] / self.needed[n] for n in self.distances])
        counted = shares[np.concatenate([reachable[n] for n in self.distances])]
        return int(np.count_nonzero(shares >= 1.0)), float(np.min(counted, initial=np.inf))


@dataclass(frozen=True)
class MotionKind:
    """How the motions of one kind are drawn.

    Attributes
    ----------
    name : str
    usual : callable
        The usual motions of an axis, the first of them its own where nothing is designed.
    drawn : callable
        A random shape.
    still : Multisine or Staircase
        An axis at rest.
    """

    name: str
    usual: Callable[[AxisCase], tuple[Shape, ...]]
    drawn: Callable[[AxisCase, np.random.Generator], Shape]
    still: Move


def motion_kinds(duration_s: float) -> tuple[MotionKind, ...]:
    """Sums of sines, and staircases."""
    rate = 2.0 * math.pi / duration_s
    return (
        MotionKind(
            "multisine",
            lambda case: (
                SineShape.of(case.named, rate, case.highest(rate)),
                SineShape.of(case.sinusoid, rate, case.highest(rate)),
            ),
            lambda case, rng: SineShape.drawn(rng, rate, case.highest(rate)),
            Multisine((SineComponent(0.0, rate, 0.0),)),
        ),
        MotionKind(
            "staircase",
            lambda case: (StairShape.usual(duration_s),),
            lambda case, rng: StairShape.drawn(rng, duration_s),
            Staircase((0.0,), duration_s, 1.0),
        ),
    )


def design_of_kind(
    kind: MotionKind,
    drive: Drive,
    cases: Mapping[str, AxisCase],
    duration_s: float,
    lead_in_s: float,
    seed: int,
    budget: float,
    on_tried: Callable[[], None],
) -> DesignOfKind:
    """Search for the best motion of one kind; `on_tried` is called for every motion compared.

    Raises
    ------
    DataError
        The limits allow an axis no motion.
    """
    motions: dict[str, Move] = dict.fromkeys(drive.axes, kind.still)
    for name, case in cases.items():
        motions[name] = case.problem.sized(kind.usual(case)[0])
    best, tried = {}, 0
    for number, (name, case) in enumerate(cases.items()):
        problem = case.problem.beside(_others(motions, name))
        if not problem.pairs:
            continue
        rng = np.random.default_rng([seed, number, list(_SHARES).index(kind.name)])
        searched = search(
            problem,
            partial(kind.drawn, case),
            kind.usual(case),
            rng,
            _evaluations(problem, kind.name, cases, budget),
            on_tried,
        )
        best[name] = searched.of_pairs
        tried += searched.tried
        motions[name] = searched.motion or motions[name]
    return _finished(drive, cases, motions, duration_s, lead_in_s, best, tried)


def evaluations(kind: MotionKind, cases: Mapping[str, AxisCase], budget: float) -> int:
    """How many motions of one kind are compared, about."""
    problems = [case.problem for case in cases.values() if case.problem.pairs]
    return sum(_evaluations(problem, kind.name, cases, budget) for problem in problems)


def _evaluations(problem: Problem, kind: str, cases: Mapping[str, AxisCase], budget: float) -> int:
    """How many motions may be compared for one axis."""
    axes = sum(bool(case.problem.pairs) for case in cases.values())
    integrated = sum(named(t.effect).memory_size > 0 for t in problem.terms)
    cost = _PER_MOTION + _PER_TERM * len(problem.terms) + _PER_MEMORY * integrated
    cost *= problem.duration_s / _USUAL_S
    return round(budget * max(_FEWEST_EVALUATIONS, round(_SHARES[kind] * _BUDGET / (axes * cost))))


def _others(motions: Mapping[str, Move], name: str) -> dict[str, Move]:
    return {other: motion for other, motion in motions.items() if other != name}


def _finished(
    drive: Drive,
    cases: Mapping[str, AxisCase],
    motions: dict[str, Move],
    duration_s: float,
    lead_in_s: float,
    best: Mapping[str, Array],
    tried: int,
) -> DesignOfKind:
    """Motions as large as the limits allow beside their causes, and what they separate."""
    for name, case in cases.items():
        beside = case.problem.beside(_others(motions, name))
        motions[name] = _within(name, beside, motions[name])
    distances, needed, loads, largest = {}, {}, {}, {}
    for name, case in cases.items():
        problem = case.problem.beside(_others(motions, name))
        seen = problem.distances(motions[name])
        loads[name] = problem.loaded(seen)
        if problem.pairs:
            least = problem.needed()
            distances[name] = np.zeros(len(least)) if seen is None else seen.apart
            needed[name] = least if seen is None else seen.needed
            largest[name] = np.maximum(best[name] * needed[name], distances[name])
    short = _lead_in(drive, cases, motions, loads, lead_in_s)
    uses = {
        name: case.problem.allowed.uses(motions[name], duration_s, short, loads[name])
        for name, case in cases.items()
    }
    trajectory = Trajectory(motions, duration_s, short)  # type: ignore[arg-type]
    return DesignOfKind(trajectory, distances, needed, largest, uses, tried)


def _within(name: str, problem: Problem, motion: Move) -> Move:
    """A motion, made smaller as long as it leaves the limits with the causes that it shows."""
    for _ in range(_MOST_SHRINKS):
        loads = problem.loaded(problem.distances(motion))
        worst = problem.allowed.uses(motion, problem.duration_s, problem.lead_in_s, loads)[1]
        share = worst.of(problem.allowed.with_margin)
        if share <= 1.0:
            return motion
        motion = scaled(motion, _SHRINK / share)
    raise DataError(
        f"axis {name}: friction and causes alone take {worst.effort_nm:.3g} N*m, the effort limit "
        f"less its margin is {problem.allowed.with_margin.effort_nm:.3g} N*m",
        "give the description of this drive with --drive",
    )


def _lead_in(
    drive: Drive,
    cases: Mapping[str, AxisCase],
    motions: Mapping[str, Move],
    loads: Mapping[str, Sequence[Load]],
    longest_s: float,
) -> float:
    """The shortest lead-in with which no axis leaves its limits."""
    lead_in_s = drive.lead_in_s
    while lead_in_s < longest_s:
        if all(
            case.problem.allowed.uses(motions[n], case.problem.duration_s, lead_in_s, loads[n])[
                1
            ].within(case.problem.allowed.with_margin)
            for n, case in cases.items()
        ):
            return lead_in_s
        lead_in_s *= _LENGTHEN
    return longest_s

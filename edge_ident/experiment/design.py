"""All axes of a drive together: what each is designed for, and the motion that is found for them.

A board moves all axes by one kind of motion. So the search is made with sums of sines and with
staircases, and the better kind is taken. Axes are searched for one after the other; each knows how
those before it move.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import delayed
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import as_diagnosed, prepare_axis
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import MotionName, named_trajectory, scaled
from edge_ident.errors import DataError
from edge_ident.experiment.compared import (
    Compared,
    Instruments,
    Key,
    base_columns,
    key,
    term_columns,
    term_effort,
)
from edge_ident.experiment.limits import Allowed, Load, Use
from edge_ident.experiment.rivals import Judge, Pair, Rivals, Typical, distance, rivals
from edge_ident.experiment.search import Problem, Shape, SineShape, StairShape, search
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion, inverse_effort, obeyed
from edge_ident.model.model import PARAMETERS, AxisModel, Term, axes_of
from edge_ident.model.motion import Array, Motion
from edge_ident.model.search import Excitation
from edge_ident.signals.conditioning import unit_length
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording
from firmware_interface.motion import Multisine, SineComponent, Staircase, Trajectory

# One axis of a drive: what its recordings and its diagnosis say, ready for the search.

_USUAL: Final[tuple[MotionName, ...]] = ("multisine", "sinusoid")
# Smallest singular value of the base model's columns that counts, over the largest: what the
# recordings hardly show stays as the diagnosis has it.
_RANK: Final = 0.03
# Effort along the recordings, of their peak, beyond which they contradict a rival: its fit leaves a
# tenth at most, and reversals are not fitted.
_CREDIBLE: Final = 1.1
# Smallest share of the effort that arrives at the axis; with less, a drive does not move.
_LEAST_ARRIVES: Final = 0.01
# Share of the comparison's band up to which lines are placed: what they cause is faster.
_BAND_SHARE: Final = 0.5


@dataclass(frozen=True)
class AxisCase:
    """One axis.

    Attributes
    ----------
    problem : Problem
        Its other axes are still at rest.
    rivals : Rivals
    named, sinusoid : Multisine
        The drive's own motions.
    before : (P,) array
        Distances of the pairs on the recordings.
    """

    problem: Problem
    rivals: Rivals
    named: Multisine
    sinusoid: Multisine
    before: Array

    def highest(self, rate_rad_s: float) -> int:
        """Largest multiple of a frequency that the loop follows and the comparison passes."""
        instruments = self.problem.instruments
        band = instruments.band(instruments.motion(self.named, self.problem.duration_s))
        passed = _BAND_SHARE * 2.0 * np.pi * band.cutoff_hz
        return max(1, int(min(passed, self.problem.allowed.loops.bandwidth_rad_s) / rate_rad_s))


def axis_case(
    name: str,
    axis: AxisDiagnosis,
    recordings: Sequence[Recording],
    drive: Drive,
    allowed: Allowed,
    duration_s: float,
    lead_in_s: float,
) -> AxisCase:
    """Prepare one axis.

    Raises
    ------
    DataError
        The drive's own motions are too short to show anything.
    """
    parts = as_diagnosed(recordings, name)
    data = prepare_axis(parts, name, timed=not delayed(axis.model))
    base = replace(axis.model, terms=axis.model.terms[:1])
    noise = axis.noise_floor * nonzero_rms(axis.traces.effort[axis.traces.valid])
    instruments = Instruments.of_recordings(
        data,
        float(base.parameters[0]),
        noise,
        drive.sampling_period_s,
        drive.axes[name].encoder_resolution_rad,
    )
    excitation = data.excitation(base.parameters)
    motions = {n: named_trajectory(drive, n).axes for n in _USUAL}
    typical = _typical(name, base, excitation, instruments, motions, duration_s)
    if not data.other_axes:  # those of the drive do not show in the recordings
        typical = replace(typical, source=None)
    found = rivals(axis, typical)
    before = Compared.of_recordings(data, noise)
    bases = _bases(data, before, base, found.pairs)
    judge = Judge(excitation)
    problem = Problem(
        base, found.pairs, judge, instruments, allowed, bases, (), (), {}, duration_s, lead_in_s
    )
    problem = _explanations(data, problem)
    named, sinusoid = (_sines(of[name]) for of in motions.values())
    others = {n: m for n, m in motions["multisine"].items() if n != name}
    problem = replace(problem, loads=problem.loaded(problem.beside(others).distances(named)))
    return AxisCase(problem, found, named, sinusoid, _before(data, problem, before))


def _typical(
    name: str,
    base: AxisModel,
    excitation: Excitation,
    instruments: Instruments,
    motions: Mapping[MotionName, Mapping[str, Multisine] | Mapping[str, Staircase]],
    duration_s: float,
) -> Typical:
    """At which size untested effects are tested, along the first usual motion that shows any."""
    for axes in motions.values():
        moved = {n: instruments.motion(motion, duration_s) for n, motion in axes.items()}
        own = moved.pop(name)
        reference = instruments.compared(own, moved)
        if reference is not None:
            effort = rms(base_columns(reference, base).effort)
            return Typical(base, excitation, reference, effort, next(iter(moved), None))
    raise DataError(
        f"axis {name}: hardly a sample of the drive's own motions would lie away from standstill "
        "and reversals",
        "give a longer motion with --seconds",
    )


def _sines(motion: Multisine | Staircase) -> Multisine:
    assert isinstance(motion, Multisine)
    return motion


def _bases(
    data: AxisData, before: Compared, base: AxisModel, pairs: Sequence[Pair]
) -> dict[Key, AxisModel]:
    """The base term beside each rival: what the recordings leave for it."""
    shown = base_columns(before, base)
    columns, length = unit_length(shown.columns.T)
    target = data.effort[data.valid] - shown.effort
    found = {}
    for pair in pairs:
        left = target - sum(term_effort(before, base, t) for t in pair.others if _seen(t, data))
        for rival in filter(lambda t: _seen(t, data), pair.terms):
            beside = left - term_effort(before, base, rival)
            change = np.linalg.lstsq(columns, beside, rcond=_RANK)[0] / length
            values = base.parameters + change[: len(PARAMETERS)]
            own = dict(zip(PARAMETERS, values.tolist(), strict=True))
            found[key(rival)] = replace(base, terms=(replace(base.terms[0], values=own),))
    return found


def _seen(term: Term, data: AxisData) -> bool:
    return set(axes_of(term.source_axis, data.other_axes)) <= set(data.other_axes)


def _explanations(data: AxisData, problem: Problem) -> Problem:
    """The problem with what every rival says of the effort, before a motion shows its causes."""
    every = [
        (*pair.others, *own) for pair in problem.pairs for own in ((), *((t,) for t in pair.terms))
    ]
    different = tuple({tuple(map(key, terms)): terms for terms in every}.values()) or ((),)
    loads = tuple(_load(data, problem, terms) for terms in different)
    return replace(problem, loads=loads, explanations=different)


def _load(data: AxisData, problem: Problem, terms: tuple[Term, ...]) -> Load:
    base = problem.bases.get(key(terms[-1]), problem.base) if terms else problem.base
    excess_nm = _excess(data, replace(base, terms=(base.terms[0], *terms))) if terms else 0.0
    speed_rad_s = problem.allowed.limit.speed_rad_s
    lets_go = any(_lets_go(t, speed_rad_s) for t in terms)
    return Load(base.parameters, 0.0, _arrives(terms, problem), excess_nm, lets_go)


def _lets_go(term: Term, speed: float) -> bool:
    """Whether a cause may let go of the axis: a part of its load, or friction that falls."""
    effect = named(term.effect)
    if effect.memory_size:
        return effect.overrides("inertia")
    zero = np.zeros(2)
    from_rest = Motion.known(zero, zero, np.array([0.0, speed]), zero)
    friction = np.broadcast_to(effect.friction(from_rest, along_motion(term)), zero.shape)
    return bool(friction[1] < friction[0])


def _arrives(terms: Sequence[Term], problem: Problem) -> float:
    """Share of the effort limit that the actuator gives, in the eyes of causes."""
    limit = problem.allowed.with_margin.effort_nm
    return float(np.clip(_given(terms, limit) / limit, _LEAST_ARRIVES, 1.0))


def _given(terms: Sequence[Term], command: float) -> float:
    """What the actuator makes of a command."""
    effort = np.array([command])
    for t in terms:
        effort = named(t.effect).torque(effort, np.zeros(1), along_motion(t))
    return float(effort[0])


def _excess(data: AxisData, axis: AxisModel) -> float:
    """Effort that a model expects beyond what the recordings may hold, reversals included.

    Friction and play that switch in an instant are smooth in no formula, so a model may expect
    peaks at reversals, which are not fitted, that the machine never had.
    """
    if not all(_seen(t, data) for t in axis.terms[1:]):
        return 0.0
    beyond = [0.0]
    for s in data.segments:
        needed = float(np.max(np.abs(inverse_effort(obeyed(axis), s.motion, s.others))))
        held = _given(axis.terms, float(np.max(np.abs(s.raw_effort))))
        beyond.append(needed - _CREDIBLE * held)
    return max(beyond) if np.all(np.isfinite(beyond)) else np.inf


def _before(data: AxisData, problem: Problem, compared: Compared) -> Array:
    """Distances of all pairs on the recordings."""
    base = base_columns(compared, problem.base)
    usable = [t for t in problem.terms if _seen(t, data)]
    beside = [(problem.bases.get(key(t), problem.base), t) for t in usable]
    columns = dict(zip(map(key, usable), term_columns(compared, beside), strict=True))
    return np.array(
        [
            distance(pair, base, columns, compared.noise)
            if all(key(t) in columns for t in (*pair.terms, *pair.others))
            else 0.0
            for pair in problem.pairs
        ]
    )


Move = Multisine | Staircase

# What a search may cost, about in ms of one core. The number of motions follows from it and not
# from a clock, so that the same input gives the same motion.
_BUDGET: Final = 1200.0
_PER_MOTION: Final = 5.0
_PER_TERM: Final = 0.7
_PER_MEMORY: Final = 4.0  # cost of a term that is integrated along the motion, in ms
_USUAL_S: Final = 22.0  # duration for which these hold
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

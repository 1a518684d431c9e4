"""The search for the motion of one axis: random shapes, and changes of the best of them."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.experiment.compared import (
    Columns,
    Compared,
    Instruments,
    Key,
    base_columns,
    key,
    term_columns,
)
from edge_ident.experiment.limits import Allowed, Load
from edge_ident.experiment.rivals import Judge, Pair, distance
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Term, axes_of
from edge_ident.model.motion import Array, Motion
from firmware_interface.motion import (
    MAXIMUM_COMPONENTS,
    MAXIMUM_LEVELS,
    Multisine,
    SineComponent,
    Staircase,
)

# Motions to choose from: shapes that are drawn, changed a little, and scaled to the limits.

# Exponent by which amplitudes of position fall with the frequency: then accelerations are equal.
_STEEPEST: Final = 2.0
# Share of the drawn motions that use the limits; the others are smaller by up to a decade.
_FULL: Final = 0.6
_LEAST_SHARE: Final = 0.1
_SWAPPED: Final = 0.15  # share of the lines that a change moves to another frequency
_SLOWEST: Final = 0.01  # slowest level of a staircase, of the fastest


class Shape(Protocol):
    """A motion but for its size.

    Attributes
    ----------
    share : float
        Of the size that the limits allow.
    """

    @property
    def share(self) -> float: ...

    def motion(self, size: float) -> Multisine | Staircase:
        """The motion of a size."""
        ...

    def changed(self, rng: np.random.Generator, step: float) -> Self:
        """A similar shape."""
        ...


@dataclass(frozen=True)
class SineShape:
    """A multisine of whole periods in the recording.

    Attributes
    ----------
    orders : (K,) array of int
        Periods in the recording, all different.
    amplitudes, phases : (K,) arrays
    rate_rad_s : float
        Of one period in the recording.
    highest : int
        Largest order.
    share : float
    """

    orders: NDArray[np.intp]
    amplitudes: Array
    phases: Array
    rate_rad_s: float
    highest: int
    share: float = 1.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, rate_rad_s: float, highest: int) -> "SineShape":
        """Random lines, denser at low frequencies, with amplitudes along a power law."""
        wanted = min(MAXIMUM_COMPONENTS, highest)
        weights = 1.0 / np.arange(1, highest + 1)
        orders = rng.choice(highest, wanted, replace=False, p=weights / np.sum(weights)) + 1
        slope = rng.uniform(0.0, _STEEPEST)
        amplitudes = np.exp(rng.normal(0.0, 0.3, wanted) - slope * np.log(orders))
        phases = rng.uniform(-math.pi, math.pi, wanted)
        share = 1.0 if rng.random() < _FULL else float(_LEAST_SHARE ** rng.random())
        return cls(orders, amplitudes, phases, rate_rad_s, highest, share)

    @classmethod
    def of(cls, motion: Multisine, rate_rad_s: float, highest: int) -> "SineShape":
        """The shape of a multisine, its lines moved to whole periods."""
        parts: dict[int, tuple[float, float]] = {}
        for sine in motion.components:
            order = max(1, min(round(sine.angular_frequency_rad_s / rate_rad_s), highest))
            parts.setdefault(order, (sine.amplitude_rad, sine.phase_rad))
        amplitudes, phases = np.array(list(parts.values())).T
        return cls(np.array(list(parts)), amplitudes, phases, rate_rad_s, highest)

    def motion(self, size: float) -> Multisine:
        """The motion whose largest amplitude is `size`."""
        scaled = size / float(np.max(self.amplitudes)) * self.amplitudes
        return Multisine(
            tuple(
                SineComponent(float(a), float(k * self.rate_rad_s), math.remainder(p, math.tau))
                for a, k, p in zip(scaled, self.orders, self.phases, strict=True)
            )
        )

    def changed(self, rng: np.random.Generator, step: float) -> "SineShape":
        """Other amplitudes and phases, now and then another line."""
        count = len(self.orders)
        orders = self.orders.copy()
        for k in np.flatnonzero(rng.random(count) < _SWAPPED):
            free = np.setdiff1d(np.arange(1, self.highest + 1), orders)
            if len(free):
                orders[k] = rng.choice(free)
        share = min(1.0, self.share * math.exp(rng.normal(0.0, 0.5 * step)))
        return replace(
            self,
            orders=orders,
            amplitudes=self.amplitudes * np.exp(rng.normal(0.0, step, count)),
            phases=self.phases + rng.normal(0.0, 2.0 * step, count),
            share=share,
        )


@dataclass(frozen=True)
class StairShape:
    """A staircase: each level forth and back for the same time.

    Attributes
    ----------
    levels : (K,) array
        Speeds; the largest is one.
    dwell_s : float
    ramp_s : float
        In which the fastest level is reached from rest.
    share : float
    """

    levels: Array
    dwell_s: float
    ramp_s: float
    share: float = 1.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, duration_s: float) -> "StairShape":
        """Levels over a random range of speeds, and ramps of a random part of the time."""
        count = int(rng.integers(2, MAXIMUM_LEVELS // 2 + 1))
        lowest = float(_SLOWEST ** rng.random())
        levels = np.geomspace(lowest, 1.0, count)
        return cls._filling(duration_s, levels, 0.5 * rng.uniform(0.05, 0.6))

    @classmethod
    def usual(cls, duration_s: float) -> "StairShape":
        """Five levels, from a tenth to the fastest."""
        return cls._filling(duration_s, np.geomspace(0.1, 1.0, 5), 0.1)

    @classmethod
    def _filling(cls, duration_s: float, levels: Array, ramp: float) -> "StairShape":
        """Levels that fill a recording; the longest ramp takes a share of a level's time."""
        slot_s = duration_s / (2 * len(levels))
        ramp_s = ramp * slot_s
        return cls(levels, slot_s - 2.0 * ramp_s * float(np.mean(levels)), ramp_s)

    def motion(self, size: float) -> Staircase:
        """The motion whose fastest level is `size`."""
        speeds = tuple(float(sign * size * level) for level in self.levels for sign in (1, -1))
        return Staircase(speeds, self.dwell_s, size / self.ramp_s)

    def changed(self, rng: np.random.Generator, step: float) -> "StairShape":
        """Other levels; the longest time on a level that the recording has."""
        levels = self.levels * np.exp(rng.normal(0.0, step, len(self.levels)))
        return replace(self, levels=np.sort(levels) / float(np.max(levels)))


# The search for the motion of one axis: random shapes, and changes of the best of them.
#
# As many pairs as possible are to be separated; then the smallest distance of all pairs, over what
# each needs, is to be largest (maximin). A pair that no drawn motion brings near what it needs does
# not count in it: it would decide alone, and not be separated for that. Such pairs are searched for
# once more, each by itself, so that the result can say how far apart the best motion brings them.
# The search is the same for the same input.

_DRAWN: Final = 0.5  # share of the evaluations that draw new shapes; the others change the best
# Distance over what is needed, from which changes may still separate a pair.
_WITHIN_REACH: Final = 0.5
_STEP: Final = 0.4  # first relative change of amplitudes
_GROWS: Final = 1.5
# Changes of the step after a success and after a failure: level at one success in five (Rechenberg
# 1973).
_SHRINKS: Final = 0.87
# Share of the effort limit that is tried for inertia and viscous friction, at least: the effort of
# some causes falls with the motion.
_LEAST_EFFORT: Final = 0.1
# Share of the evaluations for pairs that are not separated yet, each by itself.
_ALONE: Final = 0.25
_MOST_ALONE: Final = 2


@dataclass(frozen=True)
class Problem:
    """What the motion of one axis is designed for.

    Attributes
    ----------
    base : AxisModel
        The base term alone.
    pairs : tuple of Pair
    judge : Judge
    instruments : Instruments
    allowed : Allowed
    bases : mapping of Key to AxisModel
        The base term beside each rival, as the recordings show it.
    loads : tuple of Load
        Of each explanation.
    explanations : tuple of tuple of Term
        The causes in the eyes of each.
    others : mapping of axis name to motion
        How the other axes move.
    duration_s, lead_in_s : float
    """

    base: AxisModel
    pairs: tuple[Pair, ...]
    judge: Judge
    instruments: Instruments
    allowed: Allowed
    bases: Mapping[Key, AxisModel]
    loads: tuple[Load, ...]
    explanations: tuple[tuple[Term, ...], ...]
    others: Mapping[str, Multisine | Staircase]
    duration_s: float
    lead_in_s: float

    @property
    def terms(self) -> tuple[Term, ...]:
        """All different terms."""
        every = [t for pair in self.pairs for t in (*pair.terms, *pair.others)]
        return tuple({key(t): t for t in every}.values())

    def sized(self, shape: Shape) -> Multisine | Staircase:
        """A shape as large as the limits allow beside the friction and the causes of any rival."""
        limit = self.allowed.with_margin
        moving = []
        for load in self.loads:
            given = load.arrives * limit.effort_nm
            left = max(given - load.static_nm, _LEAST_EFFORT * given)
            moving.append(replace(load.moving, arrives=load.arrives * left / given))
        unit = self.allowed.uses(shape.motion(1.0), self.duration_s, self.lead_in_s, moving)[1]
        return shape.motion(shape.share / unit.of(limit))

    def beside(self, others: Mapping[str, Multisine | Staircase]) -> "Problem":
        """The same where the other axes move like this."""
        return replace(self, others=others)

    def compared(self, motion: Multisine | Staircase) -> Compared | None:
        """The samples of a motion; None where hardly one shows the axis in motion."""
        sources = {axis for t in self.terms for axis in axes_of(t.source_axis, self.others)}
        others: dict[str, Motion] = {
            name: self.instruments.motion(other, self.duration_s)
            for name, other in self.others.items()
            if name in sources
        }
        moved = self.instruments.motion(motion, self.duration_s)
        return self.instruments.compared(moved, others)

    def needed(self, samples: int = 100) -> Array:
        """Distances (P,) that all pairs need."""
        return np.array([self.judge.needed(pair, samples) for pair in self.pairs])

    def loaded(self, seen: "Distances | None") -> tuple[Load, ...]:
        """The loads with the effort of the causes that a motion shows."""
        if seen is None:
            return self.loads
        return tuple(
            load.with_causes(added) for load, added in zip(self.loads, seen.added_nm, strict=True)
        )

    def distances(self, motion: Multisine | Staircase) -> "Distances | None":
        """How far apart a motion brings all pairs; None where hardly a sample shows it."""
        compared = self.compared(motion)
        if compared is None:
            return None
        base, terms = base_columns(compared, self.base), self.terms
        found = term_columns(compared, [(self.bases.get(key(t), self.base), t) for t in terms])
        columns: dict[Key, Columns] = dict(zip(map(key, terms), found, strict=True))
        return Distances(
            np.array([distance(pair, base, columns, compared.noise) for pair in self.pairs]),
            self.needed(len(base.effort)),
            tuple(
                _added(load.base @ base.raw, [columns[key(t)].raw for t in terms if not acts(t)])
                for load, terms in zip(self.loads, self.explanations, strict=True)
            ),
        )


def acts(term: Term) -> bool:
    """Whether an effect lies in the actuator: it changes what arrives, and not what is needed."""
    return named(term.effect).overrides("torque")


def _added(base: Array, causes: Sequence[Array]) -> float:
    """What causes (N,) add to the peak of a base effort (N,); negative where they lower it."""
    together = base + sum(causes)
    return float(np.max(np.abs(together)) - np.max(np.abs(base)))


@dataclass(frozen=True)
class Distances:
    """How far apart a motion brings the pairs of an axis.

    Attributes
    ----------
    apart, needed : (P,) arrays
    added_nm : tuple of float
        What the causes of each explanation add to the peak effort of its base model.
    """

    apart: Array
    needed: Array
    added_nm: tuple[float, ...]


@dataclass
class Best:
    """What a search has found so far.

    Attributes
    ----------
    pairs : int
    on_tried : callable
    shape : Shape or None
    motion : Multisine or Staircase or None
    scores : (P,) array
        Of that motion.
    of_pairs : (P,) array
        The largest of all motions, pair by pair.
    tried : int
    """

    pairs: int
    on_tried: Callable[[], None]
    shape: Shape | None = None
    motion: Multisine | Staircase | None = None
    scores: Array = field(init=False)
    of_pairs: Array = field(init=False)
    tried: int = 0

    def __post_init__(self) -> None:
        self.scores = np.zeros(self.pairs)
        self.of_pairs = np.zeros(self.pairs)


def value(scores: Array, counted: NDArray[np.bool_]) -> tuple[int, float]:
    """What is to be largest: the separated pairs, then the smallest distance of those counted."""
    smallest = float(np.min(scores[counted])) if np.any(counted) else float(np.max(scores))
    return int(np.count_nonzero(scores >= 1.0)), smallest


def search(
    problem: Problem,
    draw: Callable[[np.random.Generator], Shape],
    known: Sequence[Shape],
    rng: np.random.Generator,
    evaluations: int,
    on_tried: Callable[[], None],
) -> Best:
    """Search for the motion of one axis.

    Parameters
    ----------
    problem : Problem
    draw : callable
        Draws a shape.
    known : sequence of Shape
        Usual motions; they are tried first.
    rng : Generator
    evaluations : int
    on_tried : callable
        Called with every motion that is compared.
    """
    best = Best(len(problem.pairs), on_tried)
    drawn = max(int(_DRAWN * evaluations) - len(known), 1)
    tried = [_evaluated(problem, s, best) for s in (*known, *(draw(rng) for _ in range(drawn)))]
    counted = best.of_pairs >= _WITHIN_REACH
    _keep(best, tried, counted)
    alone_each = int(_ALONE * evaluations)
    _refine(problem, best, counted, rng, evaluations - best.tried - alone_each)
    hard = np.flatnonzero(best.of_pairs < 1.0)[:_MOST_ALONE]
    if not len(hard):
        _refine(problem, best, counted, rng, alone_each)
    for place in hard:
        alone = np.arange(len(problem.pairs)) == place
        other = Best(len(problem.pairs), on_tried)
        _keep(other, tried, alone)
        _refine(problem, other, alone, rng, alone_each // len(hard))
        best.of_pairs = np.maximum(best.of_pairs, other.of_pairs)
        best.tried += other.tried
        if other.motion is not None and value(other.scores, counted | alone) > value(
            best.scores, counted | alone
        ):
            best.shape, best.motion, best.scores = other.shape, other.motion, other.scores
    return best


_Tried = tuple[Shape, Multisine | Staircase, Array]


def _evaluated(problem: Problem, shape: Shape, best: Best) -> _Tried:
    motion = problem.sized(shape)
    best.tried += 1
    best.on_tried()
    seen = problem.distances(motion)
    scores = np.zeros(len(problem.pairs)) if seen is None else seen.apart / seen.needed
    best.of_pairs = np.maximum(best.of_pairs, scores)
    return shape, motion, scores


def _keep(best: Best, tried: Sequence[_Tried], counted: NDArray[np.bool_]) -> None:
    shape, motion, scores = max(tried, key=lambda one: value(one[2], counted))
    best.shape, best.motion, best.scores = shape, motion, scores


def _refine(
    problem: Problem,
    best: Best,
    counted: NDArray[np.bool_],
    rng: np.random.Generator,
    evaluations: int,
) -> None:
    """Change the best shape; what is better takes its place."""
    step = _STEP
    for _ in range(evaluations if best.shape is not None else 0):
        assert best.shape is not None
        one = _evaluated(problem, best.shape.changed(rng, step), best)
        better = value(one[2], counted) > value(best.scores, counted)
        step *= _GROWS if better else _SHRINKS
        step = min(max(step, 0.02), 1.0)
        if better:
            _keep(best, [one], counted)

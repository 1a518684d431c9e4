"""The result of a design: a motion, what it asks of the drive, and what it separates."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from edge_ident.experiment.limits import Use
from edge_ident.support.rows import Readable
from edge_ident.support.words import listed, spoken
from firmware_interface.motion import Trajectory


class Why(StrEnum):
    """Why two explanations are to be separated."""

    ALTERNATIVE = "alternative"
    """The recordings show one of both, and not which."""
    SUSPECTED = "suspected"
    """The recordings hint at it, and do not support it."""
    UNTESTED = "untested"
    """The recordings could not have shown it."""


@dataclass(frozen=True)
class PlannedPair:
    """Two explanations of one axis, and how far apart their predictions are.

    Attributes
    ----------
    axis : str
    first : str
        An effect.
    second : str or None
        Another effect; None where it is whether the first is there at all.
    why : Why
    before, after : float
        Distance of both predictions on the recordings, and on the designed motion
        (`edge_ident.experiment.rivals`), in standard deviations of the noise. `after` is 0
        where nothing was designed.
    best : float
        The largest distance of all motions that were tried.
    needed : float
        Distance from which the diagnosis decides for the right one in 99 of 100 records.
    error_probability : float
        Of taking the wrong one of both for the true one, on the designed motion.
    """

    axis: str
    first: str
    second: str | None
    why: Why
    before: float
    after: float
    best: float
    needed: float
    error_probability: float

    @property
    def separated(self) -> bool:
        """Whether the designed motion separates the two."""
        return self.after >= self.needed

    @property
    def separable(self) -> bool:
        """Whether any motion that was tried does."""
        return self.best >= self.needed


@dataclass(frozen=True)
class LeftOut:
    """An explanation that no motion can test, and why."""

    axis: str
    effect: str
    reason: str


@dataclass(frozen=True)
class AxisUse:
    """What a motion asks of one axis, beside what the axis allows.

    Attributes
    ----------
    reference : Use
        Of the motion as it is commanded.
    worst : Use
        With the overshoot of the loop, and with the effort of all causes.
    limit : Use
    """

    reference: Use
    worst: Use
    limit: Use


@dataclass(frozen=True, repr=False)
class MotionPlan(Readable):
    """The motion that separates what a diagnosis cannot tell apart.

    `table` has a row for each pair of explanations.

    Attributes
    ----------
    trajectory : Trajectory or None
        None where there is nothing to separate, or no motion inside the limits separates any pair.
    axes : mapping of axis name to AxisUse
        Empty without a trajectory.
    pairs : tuple of PlannedPair
    left_out : tuple of LeftOut
    margin : float
        Share of each limit that the motion, overshoot included, stays away from it.
    loops : str
        Which overshoot is allowed for, in words.
    tried : int
        Number of motions that were compared.

    Examples
    --------
    >>> import edge_ident
    >>> recording = edge_ident.simulate()
    >>> plan = edge_ident.plan_motion(edge_ident.diagnose([recording]), [recording])
    >>> plan.trajectory is not None, all(pair.separated for pair in plan.pairs)
    (True, True)
    """

    trajectory: Trajectory | None
    axes: Mapping[str, AxisUse]
    pairs: tuple[PlannedPair, ...]
    left_out: tuple[LeftOut, ...]
    margin: float
    loops: str
    tried: int

    @property
    def inseparable(self) -> tuple[PlannedPair, ...]:
        """Pairs that no motion inside the limits separates."""
        return tuple(pair for pair in self.pairs if not pair.separable)


# What a designed motion is for, and what it asks of the drive, in sentences.

QUANTITIES: Final = (
    ("travel", "travel_rad", "rad"),
    ("speed", "speed_rad_s", "rad/s"),
    ("acceleration", "acceleration_rad_s2", "rad/s²"),
    ("effort", "effort_nm", "N·m"),
)
"""Name, field of `Use` and unit of what a motion asks of an axis."""


def question(pair: PlannedPair) -> str:
    """What is asked of two explanations."""
    if pair.second is None:
        return f"whether there is {spoken(pair.first)}"
    return f"{spoken(pair.first)} or {spoken(pair.second)}"


def inseparable_sentence(pair: PlannedPair) -> str:
    """Sentence that no motion separates a pair, with the number that shows it."""
    rivals = (
        question(pair) if pair.second is None else f"{spoken(pair.first)} and {spoken(pair.second)}"
    )
    verb = "show" if pair.second is None else "separate"
    return (
        f"no motion inside the limits can {verb} {rivals}: the best reaches a distance of "
        f"{pair.best:.2g}, needed is {pair.needed:.2g}"
    )


def inseparable_reasons(plan: MotionPlan) -> str:
    """Why no motion was designed, with the numbers that show it."""
    reasons = [f"axis {pair.axis}, {inseparable_sentence(pair)}" for pair in plan.pairs]
    reasons += [
        f"axis {left.axis}, {left.effect.replace('_', ' ')}: {left.reason}"
        for left in plan.left_out
    ]
    return "several explanations are left: " + "; ".join(reasons)


def announced(plan: MotionPlan) -> Iterator[str]:
    """What a motion settles, and its peaks on each axis beside the limits."""
    for axis in dict.fromkeys(pair.axis for pair in plan.pairs):
        asked = [pair for pair in plan.pairs if pair.axis == axis and pair.separated]
        if asked:
            pairs = (
                f"{question(p)} (distance {p.after:.3g}, needed {p.needed:.2g})" for p in asked
            )
            yield f"axis {axis}, to be settled: {listed(pairs)}"
    for axis, use in plan.axes.items():
        yield f"axis {axis}, peaks with overshoot: {_peaks(use)}"


def _peaks(use: AxisUse) -> str:
    parts = []
    for name, field, unit in QUANTITIES:
        worst, limit = getattr(use.worst, field), getattr(use.limit, field)
        beside = f" of {limit:.3g}" if math.isfinite(limit) else ""
        parts.append(f"{name} {worst:.3g}{beside} {unit}")
    return ", ".join(parts)

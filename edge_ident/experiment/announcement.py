"""What a designed motion is for, and what it asks of the drive, in sentences."""

import math
from collections.abc import Iterator
from typing import Final

from edge_ident.experiment.result import AxisUse, MotionPlan, PlannedPair
from edge_ident.support.words import listed, spoken

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

"""A designed motion as JSON document, and as tables for the terminal."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict, astuple, fields
from pathlib import Path
from typing import Any, Final

from edge_ident.drive.motions import motion_document
from edge_ident.experiment.result import AxisUse, MotionPlan, PlannedPair, Why, inseparable_sentence
from edge_ident.report.view import Grid, Line, Part, ResultView
from edge_ident.support.documents import finite
from edge_ident.support.rows import Cell, Table, table_of
from edge_ident.support.words import spoken
from firmware_interface.motion import Multisine, Staircase, Trajectory


def plan_document(plan: MotionPlan, file: Path | None) -> dict[str, Any]:
    """Schema edge-ident/plan/1.

    Parameters
    ----------
    plan : MotionPlan
    file : Path or None
        Where the motion was written.
    """
    return {
        "schema": "edge-ident/plan/1",
        "conclusion": conclusion(plan),
        "motion": None if plan.trajectory is None else motion_document(plan.trajectory),
        "motion_file": None if file is None else str(file),
        "axes": {name: uses_document(use) for name, use in plan.axes.items()},
        "pairs": pair_documents(plan.pairs),
        "left_out": [asdict(left) for left in plan.left_out],
        "margin": plan.margin,
        "loops": plan.loops,
        "tried": plan.tried,
    }


def pair_documents(pairs: Iterable[PlannedPair]) -> list[dict[str, Any]]:
    """Pairs of explanations, and whether they are separated."""
    return [
        {**asdict(pair), "separated": pair.separated, "separable": pair.separable} for pair in pairs
    ]


def uses_document(use: AxisUse) -> dict[str, dict[str, float | None]]:
    """What a motion asks of an axis; infinite limits are null."""
    return {
        name: {quantity: finite(value) for quantity, value in of.items()}
        for name, of in asdict(use).items()
    }


def conclusion(plan: MotionPlan) -> str:
    """What the plan comes to, in one sentence."""
    if not plan.pairs:
        return "there is nothing to separate"
    separated = sum(pair.separated for pair in plan.pairs)
    if not separated:
        return "no motion inside the limits separates any of the pairs"
    every = len(plan.pairs)
    if separated == every:
        return "the motion separates " + ("the pair" if every == 1 else f"all {every} pairs")
    return f"the motion separates {separated} of {every} pairs"


def plan_next_step(plan: MotionPlan) -> str:
    """What to do where there is no motion."""
    if not plan.pairs:
        return "nothing to do: one explanation is left for what the recordings show"
    return "allow the drive more in its description (--drive), or a longer motion (--seconds)"


def _parts(plan: MotionPlan) -> Iterator[Part]:
    """What is to be separated, the motion of each axis, and what it asks of the drive."""
    yield Line(conclusion(plan), tone="strong")
    if plan.pairs:
        yield _pairs_table(plan)
        yield Line("  distances are in standard deviations of the noise")
    for pair in plan.inseparable:
        yield Line(f"  axis {pair.axis}: {inseparable_sentence(pair)}")
    for left in plan.left_out:
        yield Line(f"  axis {left.axis}: {spoken(left.effect)} is left out: {left.reason}")
    if plan.trajectory is None:
        return
    yield _motion_table(plan.trajectory)
    yield _limits_table(plan)
    yield Line(
        f"  every limit less {plan.margin:.0%} is kept with the overshoot of the loop; {plan.loops}"
    )


_WHY = {
    Why.ALTERNATIVE: "not separated so far",
    Why.SUSPECTED: "suspected",
    Why.UNTESTED: "not testable so far",
}


def _pairs_table(plan: MotionPlan) -> Grid:
    distances = "distance on the\nrecordings", "on this\nmotion", "at best", "needed"
    rows = [
        (
            pair.axis,
            spoken(pair.first),
            "no effect" if pair.second is None else spoken(pair.second),
            _WHY[pair.why],
            *(f"{distance:.1f}" for distance in (pair.before, pair.after, pair.best, pair.needed)),
        )
        for pair in plan.pairs
    ]
    return Grid("", ("axis", "explanation", "or", "why", *distances), rows, plain=True)


def _motion_table(trajectory: Trajectory) -> Grid:
    headings = "axis", f"motion, {trajectory.duration_s:.1f} s"
    rows = [(name, "\n".join(_lines(motion))) for name, motion in trajectory.axes.items()]
    return Grid("", headings, rows, plain=True)


def _lines(motion: Multisine | Staircase) -> Iterator[str]:
    if isinstance(motion, Staircase):
        speeds = ", ".join(f"{speed:.3g}" for speed in motion.speeds_rad_s)
        yield f"speeds of {speeds} rad/s"
        yield (
            f"{motion.dwell_s:.3g} s at each, {motion.acceleration_rad_s2:.3g} rad/s² between them"
        )
        return
    for sine in sorted(motion.components, key=lambda s: s.angular_frequency_rad_s):
        yield (
            f"{sine.amplitude_rad:.4g} rad at {sine.angular_frequency_rad_s:.4g} rad/s, phase "
            f"{sine.phase_rad:+.3f} rad"
        )


_PEAKS = {
    "travel_rad": "distance from zero, stop included (rad)",
    "speed_rad_s": "speed (rad/s)",
    "acceleration_rad_s2": "acceleration (rad/s²)",
    "effort_nm": "effort (N·m)",
    "following_rad": "distance from the reference (rad)",
}


def _limits_table(plan: MotionPlan) -> Grid:
    headings = "axis", "peak", "as commanded", "with overshoot", "limit"
    rows = [
        (
            name,
            label,
            *(f"{getattr(of, field):.3g}" for of in (use.reference, use.worst, use.limit)),
        )
        for name, use in plan.axes.items()
        for field, label in _PEAKS.items()
        if field != "following_rad" or math.isfinite(use.limit.following_rad)
    ]
    return Grid("", headings, rows, plain=True)


# The pairs as a table that a data frame takes.


def plan_table(plan: MotionPlan) -> Table:
    """A row for each pair of explanations: how far apart they are before and on the motion."""
    names = (*(of.name for of in fields(PlannedPair)), "separated")
    rows = ((*map(_cell, astuple(pair)), pair.separated) for pair in plan.pairs)
    return table_of(names, rows)


def _cell(value: object) -> Cell:
    return value if value is None or isinstance(value, bool | float) else str(value)


VIEW: Final = ResultView(plan_table, _parts)

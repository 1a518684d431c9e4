"""Proposals for the column that holds the time."""

from collections.abc import Sequence

import numpy as np

from edge_ident.files.table import Column
from edge_ident.signals.contract_columns import TIME
from edge_ident.signals.read_columns import Proposal, ReadColumn, read_columns, without_unit
from edge_ident.signals.time_units import TIME_UNITS, likely_unit, only_plausible


def propose_time(
    columns: Sequence[Column], period_s: float | None
) -> tuple[dict[str, Proposal], list[str]]:
    """Propose the column of time, with questions where it is not certain.

    Parameters
    ----------
    columns : sequence of Column
        That are nothing else.
    period_s : float or None
        Sampling period that the file states.
    """
    read = read_columns(columns)
    named = [r for r in read if r.role.quantity == "time" and (not r.unit or r.unit.base == "s")]
    found = named or [r for r in read if r.unit and r.unit.base == "s" and not r.role.quantity]
    if not found:
        found = [r for r in read if not r.unit and _is_clock(r.column)][:1]
    if not found:
        return {}, ["no column holds the time: give its sampling period, --period SECONDS"]
    found = sorted(found, key=lambda r: "header.stamp" not in r.heading)  # when it was measured
    first, asked = found[0], []
    if any(not np.array_equal(r.column.values, first.column.values) for r in found[1:]):
        headings = " or ".join(r.heading for r in found)
        asked.append(f"which column is the time: {headings}?")
    if not named:
        says = "Only its unit suggests it" if first.unit else "It only ever increases"
        asked.append(f"is {first.heading} the time? {says}")
    proposal, question = _in_its_unit(first, period_s)
    return {first.heading: proposal}, asked + question


def _in_its_unit(read: ReadColumn, period_s: float | None) -> tuple[Proposal, list[str]]:
    """The unit of a time, and the question where no one states it."""
    if read.unit is not None:
        return Proposal(TIME, f"a time in {read.column.unit}"), []
    if read.unknown is not None:
        proposal, question = without_unit(read, TIME, "a time")
        return proposal, [question]
    step = float(np.median(np.diff(read.column.values)))
    for text, factor in TIME_UNITS.items() if period_s else ():
        if np.isclose(step * factor, period_s or 0.0, rtol=1e-3):
            reason = f"a time, in {text} because the header states a period of {period_s:g} s"
            return Proposal(TIME, reason, text), []
    text = likely_unit(read.column.values)
    if only_plausible(step, text):
        other = "ms" if text == "s" else "s"
        reason = f"a time, in {text}: in {other}, no drive is sampled every {step:g} {other}"
        return Proposal(TIME, reason, text), []
    return Proposal(TIME, "a time", text), [f"{read.heading} states no unit: {text}?"]


def _is_clock(column: Column) -> bool:
    """Whether a column only ever increases, and does not count samples."""
    steps = np.diff(column.values)
    return bool(np.all(steps > 0.0) and np.any(steps != 1.0))

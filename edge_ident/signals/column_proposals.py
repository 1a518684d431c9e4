"""Proposals for columns that nobody named: from what headings and units say together."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.files.table import Column
from edge_ident.files.units import Unit, stated_unit
from edge_ident.signals import contract_columns
from edge_ident.signals.read_columns import (
    COORDINATES,
    EFFORT_LETTERS,
    LENGTHS,
    PLACEHOLDERS,
    Proposal,
    ReadColumn,
    ReadOptions,
    Role,
    axis_names,
    is_speed,
    name_ending,
    read_columns,
    resolved_unit,
    without_unit,
)

# Proposals for columns of axes that nobody named: from what headings and units say together.

_EFFORT_OF: Final = {
    contract_columns.UNITS[contract_columns.QUANTITIES[quantity][0]]: quantity
    for quantity in contract_columns.EFFORTS
}
_GUESSED: Final = {"torque": "Nm", "force": "N", "current": "A", "voltage": "V", "effort": "Nm"}
# Travel of an axis without a unit, from which mm is the likelier reading than m.
_LONG_M: Final = 1.0
# Travel of an angle without a unit, from which degrees are likelier than rad: two turns.
_WIDE_RAD: Final = 4.0 * np.pi
_NO_POSITION: Final = ("time", "velocity", "temperature", "other")
# Different whole numbers of a position, from which they are counts: a course in mm or degrees has
# values between.
_FEWEST_COUNTS: Final = 50


def propose_axes(
    columns: Sequence[Column], options: ReadOptions, labels: Mapping[str, str]
) -> tuple[dict[str, Proposal], list[str]]:
    """Propose the columns of every axis, with questions where they are not certain.

    Parameters
    ----------
    columns : sequence of Column
        That are nothing else.
    options : ReadOptions
    labels : mapping of str to str
        Names of axes that headings have the index of.
    """
    columns_read = read_columns(columns, labels)
    read = [_of_formula(r, columns_read) for r in columns_read]
    efforts = [r for r in read if r.role.quantity in _GUESSED]
    positions = [r for r in read if r.role.quantity == "position"]
    asked = []
    if not positions:
        positions = [r for r in read if r.is_length and not r.role.quantity]
        asked += [f"is {r.heading} a position? Only its unit suggests it" for r in positions]
    if not positions:
        positions = [r for r in read if r.role.quantity == "velocity" and not r.role.commanded]
    if not positions:
        positions = [r for r in read if is_speed(r.unit) and not r.role.quantity]
        asked += [f"is {r.heading} a speed? Only its unit suggests it" for r in positions]
    if not efforts:
        efforts = [r for r in read if _is_effort(r) and not r.role.quantity]
        asked += [f"is {r.heading} the effort? Only its unit suggests it" for r in efforts]
    if not positions or not efforts:
        positions, efforts, asked = _by_elimination(read, positions, efforts, asked)
    if not positions or not efforts:
        lacks = "a position" if not positions else "an effort"
        others = [r for r in read if r.role.quantity not in _NO_POSITION and not is_speed(r.unit)]
        proposed, more = _by_course(others, options)
        return proposed, [f"no heading says which column is {lacks}", *more]
    pairs, more = _pairs(positions, efforts)
    names = axis_names([position.role.axis for position, _ in pairs])
    proposed = {}
    for position, effort in pairs:
        axis = names[position.role.axis]
        of_axis, about = _of_axis(position, effort, axis, options)
        proposed |= of_axis | _optional(read, position, of_axis[position.heading], axis)
        asked += about
    return proposed, asked + more


def _by_elimination(
    read: Sequence[ReadColumn],
    positions: list[ReadColumn],
    efforts: list[ReadColumn],
    asked: list[str],
) -> tuple[list[ReadColumn], list[ReadColumn], list[str]]:
    """Take the one column that says nothing for the position or the effort that is missing."""
    silent = [r for r in read if not r.role.quantity and r.unit is None and _changes(r)]
    if len(silent) != 1 or not (positions or efforts):
        return positions, efforts, asked
    what, named = ("effort", "effort") if positions else ("position", "position")
    (only,) = silent
    found = [
        replace(
            only, role=replace(only.role, quantity=named, axis=(positions or efforts)[0].role.axis)
        )
    ]
    asked = [*asked, f"is {only.heading} the {what}? No other column is left"]
    return (positions, found, asked) if positions else (found, efforts, asked)


def _changes(read: ReadColumn) -> bool:
    """Whether a column is neither constant nor a counter."""
    steps = np.diff(read.column.values[~np.isnan(read.column.values)])
    return bool(np.any(steps != 0.0)) and not bool(np.all(steps == 1.0))


def _of_formula(read: ReadColumn, columns: Sequence[ReadColumn]) -> ReadColumn:
    """The column as the position that `q_elbow [rad]` is beside `i_elbow [A]`, or as its effort.

    As it is where its axis has two of these, or none of the other.
    """
    quantity, axis = _by_letter(read), read.role.axis[1:]
    if not quantity:
        return read
    named = [r.role.quantity for r in columns if r.role.axis == axis]
    found = named + [_by_letter(r) for r in columns if r.role.axis[1:] == axis]
    positions, efforts = found.count("position"), sum(map(found.count, _GUESSED))
    alone = positions if quantity == "position" else efforts
    if alone > 1 or not positions or not efforts:
        return read
    return replace(read, role=Role(quantity, read.role.commanded, axis))


def _by_letter(read: ReadColumn) -> str:
    """The quantity that the letter of a formula and the unit say alike, or nothing."""
    letter, unit = "".join(read.role.axis[:1]), read.unit
    if read.role.quantity or unit is None:
        return ""
    if letter in COORDINATES and read.is_length and not read.role.commanded:
        return "position"
    quantity = EFFORT_LETTERS.get(letter, "")
    return quantity if _EFFORT_OF.get(unit.base) == quantity else ""


def _of_axis(
    position: ReadColumn, effort: ReadColumn, axis: str, options: ReadOptions
) -> tuple[dict[str, Proposal], list[str]]:
    """What two columns of an axis may be; beside a torque it turns."""
    of_effort, about_effort = _of_effort(effort, axis, options)
    turns = of_effort.target == f"{axis}_torque_nm"
    if position.role.quantity == "velocity" or is_speed(position.unit):
        rotary = of_effort.target != f"{axis}_force_n"
        of_position, about_position = _of_speed(position, axis, rotary)
    else:
        of_position, about_position = _of_position(position, axis, turns, options)
    proposed = {position.heading: of_position, effort.heading: of_effort}
    return proposed, about_position + about_effort


def _by_course(
    read: Sequence[ReadColumn], options: ReadOptions
) -> tuple[dict[str, Proposal], list[str]]:
    """What two columns beside the time may be: a position runs smoother than an effort."""
    rough = [
        (float(np.std(np.diff(r.column.values, 2)) / np.std(r.column.values)), i)
        for i, r in enumerate(read)
        if np.std(r.column.values) > 0.0 and not np.all(np.diff(r.column.values) > 0.0)
    ]
    if len(rough) != 2:
        return {}, []
    smooth, other = (read[i] for _, i in sorted(rough))
    proposed, asked = _of_axis(smooth, other, "x", options)
    reasons = {
        smooth.heading: "runs smoother than the effort",
        other.heading: "runs rougher than the position",
    }
    return {h: replace(p, reason=reasons[h]) for h, p in proposed.items()}, asked


def _pairs(
    positions: Sequence[ReadColumn], efforts: Sequence[ReadColumn]
) -> tuple[list[tuple[ReadColumn, ReadColumn]], list[str]]:
    """A position and an effort for each axis; measured before commanded."""
    pairs, asked = [], []
    for key in dict.fromkeys(position.role.axis for position in positions):
        here = [p for p in positions if p.role.axis == key]
        of_key = sorted((e for e in efforts if e.role.axis == key), key=lambda e: e.role.commanded)
        if not of_key and len(positions) == len(efforts) == 1:
            of_key = list(efforts)
            asked.append(f"do {here[0].heading} and {of_key[0].heading} belong to one axis?")
        for what, found in (("position", here), ("effort", of_key)):
            if len(found) > 1:
                headings = " or ".join(r.heading for r in found)
                asked.append(f"which column is the {what}: {headings}?")
        if of_key:
            pairs.append((here[0], of_key[0]))
    if not pairs:
        pairs = [(positions[0], efforts[0])]
        asked.append("no position and effort are named for the same axis")
    return pairs, asked


def _of_position(
    read: ReadColumn, axis: str, turns: bool, options: ReadOptions
) -> tuple[Proposal, list[str]]:
    """What a position may be."""
    if read.unit is None:
        return _of_bare_position(read, axis, turns, options)
    unit, missing = resolved_unit(read.unit, options)
    reason = f"a position in {read.column.unit}"
    if missing:
        return _open(f"{axis}_position_rad", reason, missing), [_asks(read, missing)]
    if unit.base not in LENGTHS:
        proposal, asked = without_unit(read, f"{axis}_position_rad", "named a position")
        return proposal, [asked]
    return Proposal(f"{axis}_position_{name_ending(unit.base)}", reason), []


def _of_speed(read: ReadColumn, axis: str, turns: bool) -> tuple[Proposal, list[str]]:
    """What a speed may be, where there is no position."""
    reason = "a speed, which is integrated: no column holds a position"
    if read.unit is not None and is_speed(read.unit):
        return Proposal(f"{axis}_velocity_{name_ending(read.unit.base)}", reason), []
    target = f"{axis}_velocity_rad_s" if turns else f"{axis}_velocity_m_s"
    if read.unknown is not None or read.unit is not None:
        proposal, question = without_unit(read, target, "a speed")
        return proposal, [question]
    text = "rad/s" if turns else "m/s"
    if stated_unit(read.heading) == stated_unit("rpm"):
        return Proposal(f"{axis}_velocity_rad_s", reason, "rpm"), []
    return Proposal(target, reason, text), [f"{read.heading} states no unit: {text}, or rpm?"]


def _of_bare_position(
    read: ReadColumn, axis: str, turns: bool, options: ReadOptions
) -> tuple[Proposal, list[str]]:
    """What a position may be whose unit is not known; counts where the user says their size."""
    heading, values = read.heading, read.column.values
    if read.unknown is not None and read.unknown.lower() == "grad":
        asked = f"{heading} is in grad: degrees (German Grad), or gradians of 0.9 degrees (gon)?"
        return Proposal(f"{axis}_position_rad", "a position in grad", "deg"), [asked]
    if read.unknown is not None:
        proposal, asked = without_unit(read, f"{axis}_position_rad", "a position")
        return proposal, [asked]
    reason = f"a position, from {np.min(values):.4g} to {np.max(values):.4g}"
    if options.resolution is None and _are_counts(values):
        reason = f"whole numbers, from {np.min(values):.0f} to {np.max(values):.0f}, as counts are"
        counts = Proposal(f"{axis}_position_rad", reason, "counts", _placeholder("--resolution"))
        return counts, [f"{heading} states no unit: counts of an encoder?"]
    if options.resolution is not None:
        unit, _ = resolved_unit(Unit("count"), options)
        asked = f"{heading} states no unit: counts, as --resolution suggests?"
        return Proposal(f"{axis}_position_{name_ending(unit.base)}", reason, "counts"), [asked]
    if turns:
        text = "deg" if np.ptp(values) > _WIDE_RAD else "rad"
        other = "deg" if text == "rad" else "rad"
        asked = f"{heading} states no unit: {text}, or {other}, or mm or m of a linear axis?"
        return Proposal(f"{axis}_position_rad", reason, text), [asked]
    text = "mm" if np.ptp(values) > _LONG_M else "m"
    asked = f"{heading} states no unit: {text}, or deg or rad of a rotary axis?"
    return Proposal(f"{axis}_position_m", reason, text), [asked]


def _are_counts(values: NDArray[np.float64]) -> bool:
    """Whether a position is of whole numbers, and goes farther than any in degrees or mm."""
    whole = bool(np.all(np.rint(values) == values))
    return whole and len(np.unique(values)) > _FEWEST_COUNTS


def _of_effort(read: ReadColumn, axis: str, options: ReadOptions) -> tuple[Proposal, list[str]]:
    heading, named = read.heading, read.role.quantity
    text = _GUESSED.get(named, "Nm")
    guess, _ = resolved_unit(stated_unit(text) or Unit("N*m"), options)
    taken = f"named {named}" if named else "taken for the effort"
    if read.unknown is not None:
        proposal, question = without_unit(read, _effort_name(axis, guess.base), taken)
        return proposal, [question]
    if read.unit is None:
        return (
            Proposal(_effort_name(axis, guess.base), taken, text),
            [f"{heading} states no unit: {text}?"],
        )
    unit, missing = resolved_unit(read.unit, options)
    reason = f"{'an' if named == 'effort' else 'a'} {named or 'column'} in {read.column.unit}"
    if missing:
        return _open(f"{axis}_torque_nm", reason, missing), [_asks(read, missing)]
    if unit.base not in _EFFORT_OF:
        proposal, question = without_unit(read, _effort_name(axis, guess.base), taken)
        return proposal, [question]
    fits = named in ("", "effort") or read.unit.base == "%" or _EFFORT_OF[read.unit.base] == named
    asked = [] if fits else [f"{heading} is named {named} and has the unit {read.column.unit}"]
    return Proposal(_effort_name(axis, unit.base), reason), asked


def _optional(
    read: Sequence[ReadColumn], position: ReadColumn, proposal: Proposal, axis: str
) -> dict[str, Proposal]:
    """Reference, velocity and temperature of an axis, where heading and unit leave no doubt."""
    length = (proposal.target or "").rpartition("_")[2]
    found: dict[str, Proposal] = {}
    for quantity, end in (("reference", length), ("velocity", f"{length}_s"), ("temperature", "c")):
        fits = [
            r
            for r in read
            if r.role.quantity == quantity
            and r.role.axis == position.role.axis
            and (quantity == "reference" or not r.role.commanded)
        ]
        stated = [r for r in fits if r.unit is not None and name_ending(r.unit.base) == end]
        bare = [r for r in fits if r.unit is None and r.unknown is None]
        target = f"{axis}_{quantity}_{end}"
        if len(stated) == 1:
            found[stated[0].heading] = Proposal(target, f"a {quantity} in {stated[0].column.unit}")
        elif quantity == "reference" and len(bare) == len(fits) == 1 and proposal.unit is not None:
            reason = "a reference, in the unit of its position"
            found[bare[0].heading] = replace(proposal, target=target, reason=reason)
    return found


def _is_effort(read: ReadColumn) -> bool:
    return read.unit is not None and read.unit.base in (*_EFFORT_OF, "%")


def _effort_name(axis: str, base: str) -> str:
    return f"{axis}_{_EFFORT_OF[base]}_{name_ending(base)}"


def _open(target: str, reason: str, option: str) -> Proposal:
    return Proposal(target, reason, open=_placeholder(option))


def _placeholder(option: str) -> tuple[str, str]:
    return option, PLACEHOLDERS[option][0]


def _asks(read: ReadColumn, option: str) -> str:
    return f"{read.heading} is in {read.column.unit}: say what that is with {option}"


# Proposals for the column that holds the time.


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
        return Proposal(contract_columns.TIME, f"a time in {read.column.unit}"), []
    if read.unknown is not None:
        proposal, question = without_unit(read, contract_columns.TIME, "a time")
        return proposal, [question]
    step = float(np.median(np.diff(read.column.values)))
    for text, factor in contract_columns.TIME_UNITS.items() if period_s else ():
        if np.isclose(step * factor, period_s or 0.0, rtol=1e-3):
            reason = f"a time, in {text} because the header states a period of {period_s:g} s"
            return Proposal(contract_columns.TIME, reason, text), []
    text = contract_columns.likely_unit(read.column.values)
    if contract_columns.only_plausible(step, text):
        other = "ms" if text == "s" else "s"
        reason = f"a time, in {text}: in {other}, no drive is sampled every {step:g} {other}"
        return Proposal(contract_columns.TIME, reason, text), []
    return Proposal(contract_columns.TIME, "a time", text), [
        f"{read.heading} states no unit: {text}?"
    ]


def _is_clock(column: Column) -> bool:
    """Whether a column only ever increases, and does not count samples."""
    steps = np.diff(column.values)
    return bool(np.all(steps > 0.0) and np.any(steps != 1.0))

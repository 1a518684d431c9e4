"""Proposals for columns that nobody named: from what headings and units say together."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from edge_ident.files.table import Column
from edge_ident.files.units import Unit, stated_unit
from edge_ident.signals.column_roles import Role, axis_names, role_of
from edge_ident.signals.column_units import end_of, told
from edge_ident.signals.contract_columns import EFFORTS, QUANTITIES, TIME, UNITS
from edge_ident.signals.read_options import ReadOptions

_EFFORT_OF: Final = {UNITS[QUANTITIES[quantity][0]]: quantity for quantity in EFFORTS}
_GUESSED: Final = {"torque": "Nm", "force": "N", "current": "A", "voltage": "V", "effort": "Nm"}
_LENGTHS: Final = ("m", "rad")
_LONG_M: Final = 1.0
"""Travel of an axis without a unit, from which mm is the likelier reading than m."""
_TIME_UNITS: Final = (("us", 1e-6), ("ms", 1e-3), ("s", 1.0))
_SLOW_S: Final = 0.1
"""Step of a time without a unit, from which it is likelier one of a finer unit."""
_PLACEHOLDERS: Final = {"--resolution": "COUNTS/turn", "--rated-effort": "VALUE_Nm"}


@dataclass(frozen=True)
class Proposal:
    """What a column may be.

    Attributes
    ----------
    target : str or None
        Name in the contract.
    reason : str
    unit : str or None
        That the file does not state.
    open : tuple of str
        Option that still has to be given, and what it wants.
    """

    target: str | None
    reason: str
    unit: str | None = None
    open: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Read:
    """A column with what its heading and its unit say."""

    column: Column
    role: Role
    unit: Unit | None

    @property
    def is_length(self) -> bool:
        return self.unit is not None and self.unit.base in (*_LENGTHS, "count")

    @property
    def is_effort(self) -> bool:
        return self.unit is not None and self.unit.base in (*_EFFORT_OF, "%")


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
    read = [_Read(c, role_of(c.name), _unit(c)) for c in columns]
    named = [r for r in read if r.role.quantity == "time" and (not r.unit or r.unit.base == "s")]
    found = named or [r for r in read if r.unit and r.unit.base == "s" and not r.role.quantity]
    if not found:
        found = [r for r in read if not r.unit and _is_clock(r.column)][:1]
    if not found:
        return {}, ["no column holds the time: give its sampling period, --period SECONDS"]
    first, asked = found[0], []
    heading = first.column.heading
    if any(not np.array_equal(r.column.values, first.column.values) for r in found[1:]):
        headings = " or ".join(r.column.heading for r in found)
        asked.append(f"which column is the time: {headings}?")
    if not named:
        says = "Only its unit suggests it" if first.unit else "It only ever increases"
        asked.append(f"is {heading} the time? {says}")
    if first.unit is not None:
        return {heading: Proposal(TIME, f"a time in {first.column.unit}")}, asked
    step = float(np.median(np.diff(first.column.values)))
    for text, factor in _TIME_UNITS if period_s else ():
        if np.isclose(step * factor, period_s or 0.0, rtol=1e-3):
            reason = f"a time, in {text} because the header states a period of {period_s:g} s"
            return {heading: Proposal(TIME, reason, text)}, asked
    text = "s" if step < _SLOW_S else "ms" if step < 1e3 * _SLOW_S else "us"
    asked.append(f"{heading} states no unit: {text}?")
    return {heading: Proposal(TIME, "a time", text)}, asked


def _is_clock(column: Column) -> bool:
    """Whether a column only ever increases, and does not count samples."""
    steps = np.diff(column.values)
    return bool(np.all(steps > 0.0) and np.any(steps != 1.0))


def propose_axes(
    columns: Sequence[Column], options: ReadOptions
) -> tuple[dict[str, Proposal], list[str]]:
    """Propose the columns of every axis, with questions where they are not certain."""
    read = [_Read(c, role_of(c.name), _unit(c)) for c in columns]
    positions = [r for r in read if r.role.quantity == "position"]
    efforts = [r for r in read if r.role.quantity in _GUESSED]
    asked = []
    if not positions:
        positions = [r for r in read if r.is_length and not r.role.quantity]
        asked += [f"is {r.column.heading} a position? Only its unit suggests it" for r in positions]
    if not efforts:
        efforts = [r for r in read if r.is_effort and not r.role.quantity]
        asked += [f"is {r.column.heading} the effort? Only its unit suggests it" for r in efforts]
    if not positions or not efforts:
        lacks = "a position" if not positions else "an effort"
        asked = [f"no heading says which column is {lacks}"]
        return _by_course([r.column for r in read if r.role.quantity != "time"]), asked
    pairs, more = _pairs(positions, efforts)
    names = axis_names([position.role.axis for position, _ in pairs])
    proposed: dict[str, Proposal] = {}
    for position, effort in pairs:
        axis = names[position.role.axis]
        of_position, about_position = _of_position(position, axis, options)
        of_effort, about_effort = _of_effort(effort, axis, options)
        proposed |= {position.column.heading: of_position, effort.column.heading: of_effort}
        proposed |= _optional(read, position, of_position, axis)
        asked += about_position + about_effort
    return proposed, asked + more


def _by_course(columns: Sequence[Column]) -> dict[str, Proposal]:
    """What two columns beside the time may be: a position runs smoother than an effort."""
    rough = {
        column.heading: float(np.std(np.diff(column.values, 2)) / np.std(column.values))
        for column in columns
        if np.std(column.values) > 0.0 and not np.all(np.diff(column.values) > 0.0)
    }
    if len(rough) != 2:
        return {}
    smooth, other = sorted(rough, key=lambda heading: rough[heading])
    return {
        smooth: Proposal("x_position_m", "runs smoother than the effort", "m"),
        other: Proposal("x_torque_nm", "runs rougher than the position", "Nm"),
    }


def _pairs(
    positions: Sequence[_Read], efforts: Sequence[_Read]
) -> tuple[list[tuple[_Read, _Read]], list[str]]:
    """A position and an effort for each axis; measured before commanded."""
    pairs, asked = [], []
    for key in dict.fromkeys(position.role.axis for position in positions):
        here = [p for p in positions if p.role.axis == key]
        of_key = sorted((e for e in efforts if e.role.axis == key), key=lambda e: e.role.commanded)
        if not of_key and len(positions) == len(efforts) == 1:
            of_key = list(efforts)
            asked.append(
                f"do {here[0].column.heading} and {of_key[0].column.heading} belong to one axis?"
            )
        for what, found in (("position", here), ("effort", of_key)):
            if len(found) > 1:
                headings = " or ".join(r.column.heading for r in found)
                asked.append(f"which column is the {what}: {headings}?")
        if of_key:
            pairs.append((here[0], of_key[0]))
    if not pairs:
        pairs = [(positions[0], efforts[0])]
        asked.append("no position and effort are named for the same axis")
    return pairs, asked


def _of_position(read: _Read, axis: str, options: ReadOptions) -> tuple[Proposal, list[str]]:
    heading = read.column.heading
    if read.unit is None:
        text = "mm" if np.ptp(read.column.values) > _LONG_M else "m"
        reason = f"a position, from {np.min(read.column.values):.4g} to "
        reason += f"{np.max(read.column.values):.4g}"
        return (
            Proposal(f"{axis}_position_m", reason, text),
            [f"{heading} states no unit: {text}, or deg or rad of a rotary axis?"],
        )
    unit, lacks = told(read.unit, options)
    reason = f"a position in {read.column.unit}"
    if lacks:
        return _open(f"{axis}_position_rad", reason, lacks), [_asks(read, lacks)]
    if unit.base not in _LENGTHS:
        return (
            Proposal(f"{axis}_position_m", f"named a position, but in {read.column.unit}", "mm"),
            [f"{heading} is named a position and has the unit {read.column.unit}"],
        )
    return Proposal(f"{axis}_position_{end_of(unit.base)}", reason), []


def _of_effort(read: _Read, axis: str, options: ReadOptions) -> tuple[Proposal, list[str]]:
    heading, named = read.column.heading, read.role.quantity
    if read.unit is None:
        text = _GUESSED.get(named, "Nm")
        unit, _ = told(stated_unit(text) or Unit("N*m"), options)
        return (
            Proposal(_effort_name(axis, unit.base), f"named {named}", text),
            [f"{heading} states no unit: {text}?"],
        )
    unit, lacks = told(read.unit, options)
    reason = f"{'an' if named == 'effort' else 'a'} {named or 'column'} in {read.column.unit}"
    if lacks:
        return _open(f"{axis}_torque_nm", reason, lacks), [_asks(read, lacks)]
    if unit.base not in _EFFORT_OF:
        text = _GUESSED[named]
        return (
            Proposal(_effort_name(axis, (stated_unit(text) or Unit("N*m")).base), reason, text),
            [f"{heading} is named {named} and has the unit {read.column.unit}"],
        )
    fits = named in ("", "effort") or read.unit.base == "%" or _EFFORT_OF[read.unit.base] == named
    asked = [] if fits else [f"{heading} is named {named} and has the unit {read.column.unit}"]
    return Proposal(_effort_name(axis, unit.base), reason), asked


def _optional(
    read: Sequence[_Read], position: _Read, proposal: Proposal, axis: str
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
            and r.unit is not None
            and end_of(r.unit.base) == end
        ]
        if len(fits) == 1:
            heading, unit = fits[0].column.heading, fits[0].column.unit
            found[heading] = Proposal(f"{axis}_{quantity}_{end}", f"a {quantity} in {unit}")
    return found


def _unit(column: Column) -> Unit | None:
    return None if column.unit is None else stated_unit(column.unit)


def _effort_name(axis: str, base: str) -> str:
    return f"{axis}_{_EFFORT_OF[base]}_{end_of(base)}"


def _open(target: str, reason: str, option: str) -> Proposal:
    return Proposal(target, reason, open=(option, _PLACEHOLDERS[option]))


def _asks(read: _Read, option: str) -> str:
    return f"{read.column.heading} is in {read.column.unit}: say what that is with {option}"

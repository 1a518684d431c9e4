"""A column with what its heading and its unit say, and what may be proposed for it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from edge_ident.files.headings import split_unknown
from edge_ident.files.table import Column
from edge_ident.files.units import Unit, stated_unit
from edge_ident.signals.column_roles import Role, is_time, role_of

LENGTHS: Final = ("m", "rad")
_UNIT: Final = "UNIT"
PLACEHOLDERS: Final = {
    "--resolution": ("COUNTS/turn", "the encoder's counts per turn or length, as 8192/turn"),
    "--rated-effort": ("VALUE_Nm", "the effort at 100 %, as 2.4Nm or 8A"),
    "--unit": (_UNIT, "a unit such as mm, deg, Nm, A or rpm"),
    "--period": ("SECONDS", "the sampling period, as 0.001"),
    "--column": ("POSITION, EFFORT", "the heading of that column"),
}
"""What stands in a proposed command line where only a person knows the value, by its option."""
_SPEEDS: Final = ("m/s", "rad/s")


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
class ReadColumn:
    """A column with what its heading and its unit say.

    Attributes
    ----------
    column : Column
    role : Role
    unit : Unit or None
    unknown : str or None
        What the heading states in a unit's place, where that is no unit that is known.
    """

    column: Column
    role: Role
    unit: Unit | None
    unknown: str | None

    @property
    def heading(self) -> str:
        """The heading as it stands in the file."""
        return self.column.heading

    @property
    def is_length(self) -> bool:
        """Whether its unit is one of a position."""
        return self.unit is not None and self.unit.base in (*LENGTHS, "count")


def read_columns(
    columns: Sequence[Column], names: Mapping[str, str] | None = None
) -> list[ReadColumn]:
    """Read headings and units of columns; the user may have stated a unit.

    Parameters
    ----------
    columns : sequence of Column
    names : mapping of str to str, optional
        Names of axes that headings have the index of.
    """
    split = [split_unknown(column.heading) for column in columns]
    labels = {text for _, text in split if text is not None and _is_label(text, split)}
    read = []
    for column, (name, text) in zip(columns, split, strict=True):
        unit = None if column.unit is None else stated_unit(column.unit)
        if text is None or text in labels:
            role, unknown = role_of(column.name), None
        else:
            role, unknown = role_of(name), text if column.unit is None else None
        if unit is not None and is_time(column.name, unit.base):
            role = Role("time", False, ())
        axis = tuple((names or {}).get(token, token) for token in role.axis)
        read.append(ReadColumn(column, replace(role, axis=axis), unit, unknown))
    return read


def _is_label(text: str, split: Sequence[tuple[str, str | None]]) -> bool:
    """Whether text in a unit's place is none: known words, or the same for several quantities.

    As in `Position (actual)`, or in `Position (left)` beside `Torque (left)`.
    """
    quantities = {role_of(name).quantity for name, other in split if other == text}
    return not role_of(text).axis or len(quantities) > 1


def open_values(options: Sequence[str]) -> dict[str, str]:
    """What options of a proposal leave to a person: what stands there, and what it is.

    Parameters
    ----------
    options : sequence of str
        Options and their values by turns.
    """
    found = {}
    for option, value in zip(options[::2], options[1::2], strict=True):
        names, what = PLACEHOLDERS.get(option, ("", ""))
        for name in filter(None, names.split(", ")):
            if value == name or value.startswith(f"{name}=") or value.endswith(f"={name}"):
                found[name] = what
    return found


def is_speed(unit: Unit | None) -> bool:
    """Whether a unit is one of a speed."""
    return unit is not None and unit.base in _SPEEDS


def without_unit(read: ReadColumn, target: str, reason: str) -> tuple[Proposal, str]:
    """A proposal for a column that states a unit which cannot be its own, and the question.

    No other unit is proposed: that would be a guess against what the file says.
    """
    stated = read.unknown or read.column.unit
    asked = (
        f"{read.heading} states {stated}, which is no unit that edge-ident knows"
        if read.unknown
        else f"{read.heading} is {reason} and has the unit {stated}"
    )
    return Proposal(target, reason, open=("--unit", f"{read.heading}={_UNIT}")), asked

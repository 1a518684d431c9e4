"""Which column of a file is which column of the contract, and why.

Names of the contract and what the user says count first. The rest is proposed from headings and
units. A proposal is certain where both agree and nothing else fits as well; otherwise it is a
question.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from edge_ident.errors import DataError
from edge_ident.files.table import Column, Table, repetition, split_heading
from edge_ident.files.units import Unit, known_unit, stated_unit
from edge_ident.signals.column_proposals import propose_axes, propose_time
from edge_ident.signals.contract_columns import EFFORTS, QUANTITIES, TIME, contract_name, parse_name
from edge_ident.signals.read_columns import (
    PLACEHOLDERS,
    Proposal,
    ReadColumn,
    ReadOptions,
    check_options,
    conversion,
    read_columns,
    resolved_unit,
    role_of,
    unit_may_be_name,
)

# Stands in a proposed command line where no heading says which columns these are.
_UNNAMED: Final = ("POSITION=x_position_rad", "EFFORT=x_torque_nm")


@dataclass(frozen=True)
class ColumnUse:
    """What a column of a file is taken for.

    Attributes
    ----------
    heading : str
        As it stands in the file.
    target : str or None
        Name in the contract; None where the column is not used.
    unit_text : str or None
        Unit of the numbers in the file, as the file or the user states it.
    unit : Unit
        From there to the contract's unit.
    reason : str
    """

    heading: str
    target: str | None
    unit_text: str | None
    unit: Unit
    reason: str


@dataclass(frozen=True)
class ColumnMapping:
    """All columns of a file, the sampling period where no column holds the time, and questions.

    Attributes
    ----------
    uses : tuple of ColumnUse
    period_s : float or None
    period_reason : str
    questions : tuple of str
        What is not certain; the mapping is a proposal then.
    options : tuple of str
        Of the command line, which accept the proposal.
    """

    uses: tuple[ColumnUse, ...]
    period_s: float | None
    period_reason: str
    questions: tuple[str, ...]
    options: tuple[str, ...]


def map_columns(table: Table, options: ReadOptions) -> ColumnMapping:
    """Find the contract's columns in a table.

    Raises
    ------
    DataError
        A column that the user names does not exist, a name is not the contract's, a unit cannot
        be converted, or the size of a count is given and no column is in counts.
    """
    check_options(options)
    said, units = _said(table, options)
    targets = {heading: Proposal(target, "as given") for heading, target in said.items()}
    named = _contract(table, said, options)
    targets |= named
    free = [column for column in table.columns if column.heading not in targets]
    free = [replace(c, unit=units.get(c.heading, c.unit)) for c in free]
    native = any(proposal.target != TIME for proposal in targets.values())
    questions = [
        f"{heading} is {each.reason}: say what that is with {each.open[0]}"
        for heading, each in named.items()
        if each.open
    ]
    if not native and free:
        proposed, asked = propose_axes(free, options, table.labels)
        targets, questions = targets | proposed, questions + asked
    period_s, why = options.period_s, "as given"
    if period_s is None and all(p.target != TIME for p in targets.values()):
        found, asked = propose_time([c for c in free if c.heading not in targets], table.period_s)
        targets |= found
        if not found and table.period_s is not None:
            period_s, why = table.period_s, "the file's header states it"
        elif not native or found:
            questions += asked
    uses = tuple(
        _use(read, targets.get(read.heading, Proposal(None, "")), units, options, period_s)
        for read in read_columns(table.columns)
    )
    _check_counts(uses, options)
    repeated = _repeated(uses, said)
    questions += [f"several columns are named {heading}" for heading in repeated]
    return ColumnMapping(
        uses, period_s, why if period_s is not None else "", tuple(questions),
        _accepting(uses, table, targets, repeated, options),
    )  # fmt: skip


def _check_counts(uses: tuple[ColumnUse, ...], options: ReadOptions) -> None:
    """A user who says what a count is means a column: one that states no unit, if none is counts.

    Raises
    ------
    DataError
    """
    texts = [use.unit_text for use in uses if use.unit_text is not None]
    units = [unit.base for text in texts if (unit := stated_unit(text)) is not None]
    bare = [u for u in uses if u.unit_text is None and "_position_" in (u.target or "")]
    if options.resolution is not None and bare and "count" not in units:
        raise DataError(
            f"--resolution {options.resolution}: no column is in counts, and {bare[0].heading} "
            "states no unit",
            f"if it is in counts, say so: --unit '{bare[0].heading}=counts'; else leave "
            "--resolution out",
        )


def _repeated(uses: tuple[ColumnUse, ...], said: Mapping[str, str]) -> tuple[str, ...]:
    """Headings of columns of an axis that stand in the file again, unless the user named the
    column. A time may stand there for each channel."""
    headings = {use.heading for use in uses}
    used = [use.heading for use in uses if use.target not in (None, TIME, *said.values())]
    return tuple(heading for heading in used if repetition(heading, 2) in headings)


def _said(table: Table, options: ReadOptions) -> tuple[dict[str, str], dict[str, str]]:
    """The user's names and units, by the headings of the file."""
    units = {_column(table, name).heading: unit for name, unit in options.units.items()}
    said: dict[str, str] = {}
    for name, target in options.columns.items():
        column = _column(table, name)
        if parse_name(target) is None:
            raise DataError(
                f"--column {name}={target}: {target} is no name of the contract",
                "write time_s, <axis>_position_rad or _m, <axis>_torque_nm, _force_n, _current_a "
                "or _voltage_v, <axis>_reference_rad or _m",
            )
        if target in said.values():
            raise DataError(f"two columns are to be {target}", "give --column once for each name")
        said[column.heading] = target
        _, unit = split_heading(name)
        if unit is not None and name not in (column.heading, column.name):
            units.setdefault(column.heading, unit)
    return said, units


def _contract(table: Table, said: Mapping[str, str], options: ReadOptions) -> dict[str, Proposal]:
    """Headings that are names of the contract, also in another unit, such as `x_position_deg`;
    unless it is by chance: no time, no whole axis."""
    targets = {
        column.heading: target
        for column in table.columns
        if column.heading not in (*said, *said.values())
        and (target := _contract_name(column))
        and target not in said.values()
    }
    parsed = {target: parse_name(target) or ("", "", "") for target in targets.values()}
    moved = ("position", "velocity")
    positions = {axis for axis, quantity, _ in parsed.values() if quantity in moved}
    efforts = {axis for axis, quantity, _ in parsed.values() if quantity in EFFORTS}
    meant = TIME in parsed or positions & efforts or any(t != TIME for t in said.values())
    if not meant:
        return {}
    if len(parsed) < len(targets):  # two headings for one column: that of the contract counts
        targets = {heading: heading for heading in targets if parse_name(heading)}
    return {
        column.heading: _named(column, targets[column.heading], options)
        for column in table.columns
        if column.heading in targets
    }


def _named(column: Column, target: str, options: ReadOptions) -> Proposal:
    """A column whose heading tells what it is; a current is a torque where the user says which."""
    axis, quantity, _ = parse_name(target) or ("", "", "")
    heading = column.heading
    unit = None if column.unit is None else stated_unit(column.unit)
    if unit is not None and unit.base in ("%", "count"):
        found, missing = resolved_unit(unit, options)
        if missing:
            return Proposal(target, f"in {column.unit}", open=(missing, PLACEHOLDERS[missing][0]))
        return Proposal(contract_name(f"{axis}_{quantity}", found.base) or target, "its name")
    if quantity == "current" and options.torque_constant is not None:
        return Proposal(f"{axis}_torque_nm", "its current, by the torque constant")
    return Proposal(
        target, "the contract's name" if heading == target else "its name, in another unit"
    )


def _contract_name(column: Column) -> str | None:
    """A column's name in the contract, where its heading is that but for the unit."""
    if parse_name(column.heading) is not None:
        return column.heading
    unit = None if column.unit is None else known_unit(column.unit)
    if unit is None:
        return None
    if unit.base in ("%", "count"):  # of whatever unit the quantity is in the contract
        quantity = column.name.rpartition("_")[2]
        ends = QUANTITIES.get(quantity, ("",))
        fits = quantity in EFFORTS if unit.base == "%" else quantity in ("position", "reference")
        whole = f"{column.name}_{ends[0]}"
        return whole if fits and parse_name(whole) else None  # a mere `torque` names no axis
    return contract_name(column.name, unit.base)


def _column(table: Table, name: str) -> Column:
    """The column that a user means: by its heading, by its name, by its name and another unit."""
    name = name.strip()
    for wanted in (name, split_heading(name)[0]):
        for known in ("heading", "name"):
            found = [column for column in table.columns if getattr(column, known) == wanted]
            if found:
                return found[0]
    headings = ", ".join(column.heading for column in table.columns)
    raise DataError(
        f"{table.source}: there is no column {name} to rename", f"its columns are {headings}"
    )


def _use(
    read: ReadColumn,
    proposal: Proposal,
    units: Mapping[str, str],
    options: ReadOptions,
    period_s: float | None,
) -> ColumnUse:
    column, target, reason = read.column, proposal.target, proposal.reason
    if target == TIME and period_s is not None:
        target, reason = None, "the sampling period is given"
    text = units.get(column.heading) or proposal.unit or column.unit
    if target is None:
        return ColumnUse(column.heading, None, text, Unit(""), reason or _unused(column))
    if proposal.open:
        return ColumnUse(column.heading, target, text, Unit(""), reason)
    try:
        unit = conversion(column, target, text, options)
    except DataError:
        if column.heading in units or not unit_may_be_name(column):
            raise
        text, unit = None, conversion(column, target, None, options)
    if text is None and read.unknown is not None:
        raise DataError(
            f"column {read.heading} states {read.unknown}, which is no unit that edge-ident knows",
            f"say which it is: --unit '{read.heading}=UNIT'",
        )
    if text is None:
        reason += ", unit not stated: taken as the contract's"
    return ColumnUse(column.heading, target, text, unit, reason)


def _unused(column: Column) -> str:
    quantity = role_of(column.name).quantity
    return f"named {quantity}, not used" if quantity not in ("", "other") else "not used"


def _accepting(
    uses: tuple[ColumnUse, ...],
    table: Table,
    targets: Mapping[str, Proposal],
    repeated: tuple[str, ...],
    options: ReadOptions,
) -> tuple[str, ...]:
    """Options of the command line that say what a proposal guesses."""
    said: list[tuple[str, ...]] = []
    for use, column in zip(uses, table.columns, strict=True):
        if use.target is None:
            continue
        heading, proposal = use.heading, targets[use.heading]
        if use.target != heading or heading in repeated:
            said.append(("--column", f"{heading}={use.target}"))
        if use.unit_text is not None and use.unit_text != column.unit:
            said.append(("--unit", f"{heading}={use.unit_text}"))
        said.append(proposal.open)
    if options.period_s is not None:
        said.append(("--period", f"{options.period_s:g}"))
    elif table.period_s is None and not any(use.target == TIME for use in uses):
        said.append(("--period", "SECONDS"))
    if all(use.target in (None, TIME) for use in uses):
        said += [("--column", named) for named in _UNNAMED]
    for option, value in (
        ("--resolution", options.resolution),
        ("--rated-effort", options.rated_effort),
        ("--torque-constant", options.torque_constant),
        ("--delimiter", options.delimiter),
        ("--decimal", options.decimal),
    ):
        said += [] if value is None else [(option, str(value))]
    return tuple(word for words in dict.fromkeys(said) for word in words)

"""From the unit of a column in a file to that of the contract."""

import math
from typing import Final

from edge_ident.errors import DataError
from edge_ident.files.headings import split_heading
from edge_ident.files.table import Column
from edge_ident.files.units import Unit, count_unit, stated_unit
from edge_ident.signals.contract_columns import UNITS, parse_name
from edge_ident.signals.read_options import ReadOptions

_ENDS: Final = {base: end for end, base in UNITS.items()}
_PERCENT: Final = 0.01


def check_options(options: ReadOptions) -> None:
    """Check units, resolution, torque constant and rated effort that a user gives.

    Raises
    ------
    DataError
    """
    for name, text in options.units.items():
        if stated_unit(text) is None:
            raise DataError(
                f"--unit {name}={text}: {text!r} is no unit that edge-ident knows",
                "write one such as s, ms, mm, m, in, deg, gon, rad, turn, N, lbf, Nm, oz-in, A, V, "
                "or a number of it: 1/8192 turn",
            )
    if options.resolution is not None and count_unit(options.resolution) is None:
        raise DataError(
            f"--resolution {options.resolution}: not counts per turn or length",
            "write it as 8192/turn or 1000/mm",
        )
    constant = options.torque_constant
    if constant is not None and not 0.0 < constant < math.inf:
        raise DataError(
            f"--torque-constant {constant:g}: not a torque constant",
            "give a number above 0, in N*m/A",
        )
    rated = None if options.rated_effort is None else stated_unit(options.rated_effort)
    if options.rated_effort is not None and (rated is None or rated.base not in ("N*m", "N", "A")):
        raise DataError(
            f"--rated-effort {options.rated_effort}: not an effort with its unit",
            "write it as 2.4Nm, 150N or 8A",
        )


def resolved_unit(unit: Unit, options: ReadOptions) -> tuple[Unit, str]:
    """A unit as a multiple of one of the contract's, and the option that is missing for that.

    Counts need a resolution, percents a rated effort; a torque constant turns amperes into N·m.
    """
    if unit.base == "count":
        count = count_unit(options.resolution) if options.resolution else None
        return (unit, "--resolution") if count is None else (count, "")
    if unit.base == "%":
        rated = stated_unit(options.rated_effort) if options.rated_effort else None
        if rated is None:
            return unit, "--rated-effort"
        unit = Unit(rated.base, rated.factor * _PERCENT * unit.factor)
    if unit.base == "A" and options.torque_constant is not None:
        return Unit("N*m", unit.factor * options.torque_constant), ""
    return unit, ""


def conversion(column: Column, target: str, text: str | None, options: ReadOptions) -> Unit:
    """The unit that converts the numbers of a column to those of a column of the contract.

    Parameters
    ----------
    column : Column
    target : str
        Name in the contract.
    text : str or None
        Unit of the column; None stands for that of the contract.
    options : ReadOptions

    Raises
    ------
    DataError
        The unit is of another kind, or an option is missing.
    """
    parsed = parse_name(target)
    assert parsed is not None, target
    wanted = UNITS[parsed[2]]
    unit = None if text is None else stated_unit(text)
    if unit is None:
        return Unit(wanted)
    if unit.base == wanted:
        return unit
    found, missing = resolved_unit(unit, options)
    if found.base == wanted:
        return found
    if missing or (unit.base == "A" and wanted == "N*m"):
        raise DataError(
            f"column {column.heading} is in {text}, and {target} needs {wanted}",
            f"give its meaning with {missing or '--torque-constant'}",
        )
    raise DataError(
        f"column {column.heading} is in {text}, which is no {wanted}, as {target} needs",
        "name the column for its own unit, or correct the unit with --unit NAME=UNIT",
    )


def name_ending(base: str) -> str | None:
    """Ending of a column's name for a unit, such as nm for N*m; None for other units."""
    return _ENDS.get(base)


def unit_may_be_name(column: Column) -> bool:
    """Whether what looks like a unit may belong to the name: it stands after an underscore."""
    _, underscore, last = column.heading.rpartition("_")
    after_underscore = bool(underscore) and last.isascii() and last.isalpha()
    return after_underscore and split_heading(column.heading)[1] == column.unit

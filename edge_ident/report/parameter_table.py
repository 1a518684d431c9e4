"""Every parameter of a model with its 95 % interval, in one table."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Final

from rich.markup import escape

from edge_ident.model.model import PARAMETERS, AxisModel, Estimate, Model
from edge_ident.model.model_files import values_document
from edge_ident.report.intervals import interval_texts
from edge_ident.support.console import FittingTable
from edge_ident.support.words import spoken

EFFECTIVE: Final = "effective: the line through the friction curve, over the speeds visited"
"""What people are told of it, once."""


def parameter_table(
    model: Model, lines: Mapping[str, Estimate | None] = MappingProxyType({})
) -> FittingTable:
    """Rows of every axis: the base model's parameters, then those of each effect.

    Parameters
    ----------
    model : Model
    lines : mapping of axis name to Estimate or None
        With friction as the line through the friction curve, where that bends.
    """
    bent = any(line is not None for line in lines.values())
    title = f"parameters ({EFFECTIVE})" if bent else "parameters"
    table = FittingTable(title=title, title_justify="left")
    table.add_column("axis")
    table.add_column("parameter")
    table.add_column("value", justify="right")
    table.add_column("95 % interval", justify="right")
    table.add_column("unit")
    for name, axis in model.axes.items():
        for cells in (*_line_rows(lines.get(name), axis), *_rows(axis)):
            table.add_row(escape(name), *cells)
    return table


def _line_rows(line: Estimate | None, axis: AxisModel) -> Iterator[tuple[str, str, str, str]]:
    """The line through the friction, and above it nothing else: it is what is best known."""
    if line is None:
        return
    units = [entry["unit"] for entry in values_document(axis.terms[0], axis).values()]
    for i, name in enumerate(PARAMETERS[1:], 1):
        value, std = float(line.parameters[i]), float(line.std[i])
        yield f"effective {spoken(name)}", *_cells(value, std), units[i]


def _rows(axis: AxisModel) -> Iterator[tuple[str, str, str, str]]:
    """Parameter, value, interval and unit; of an effect only what its form has."""
    for n, term in enumerate(axis.terms):
        effect = f"{spoken(term.effect)}: " if n else ""
        for name, entry in values_document(term, axis).items():
            value, std, unit = entry["value"], entry["std"], entry["unit"]
            if std is not None or n == 0:
                unit = "" if unit == "1" else unit
                yield f"{effect}{spoken(name)}", *_cells(value, std), unit


def _cells(value: float, std: float | None) -> tuple[str, str]:
    texts = interval_texts(value, std)
    if texts is None:
        return f"{value:.4g}", ""
    shown, low, high = texts
    return shown, f"{low} to {high}"

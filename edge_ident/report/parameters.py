"""Parameters in words: 95 % intervals, to the digits that the standard deviation leaves."""

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Final

from edge_ident.model.model import NORMAL_95, PARAMETERS, AxisModel, Estimate, Model
from edge_ident.model.model_files import values_document
from edge_ident.report.view import Grid
from edge_ident.support.words import spoken

EFFECTIVE: Final = "effective: the line through the friction curve, over the speeds visited"
"""What people are told of an effective parameter, once."""
_MOST_DECIMALS: Final = 9


def decimals(std: float) -> int:
    """Decimals that show two digits of a standard deviation."""
    return max(0, 1 - int(f"{std:.1e}".partition("e")[2]))


def interval_texts(value: float, std: float | None) -> tuple[str, str, str] | None:
    """A value and the ends of its 95 % interval; None where no interval is known or can be shown.

    Parameters
    ----------
    value : float
    std : float or None
    """
    if not std or not math.isfinite(std) or decimals(std) > _MOST_DECIMALS:
        return None
    low, high = value - NORMAL_95 * std, value + NORMAL_95 * std
    shown, lowest, highest = (f"{end:.{decimals(std)}f}" for end in (value, low, high))
    return shown, lowest, highest


# Every parameter of a model with its 95 % interval, in one table.


def parameter_grid(
    model: Model, lines: Mapping[str, Estimate | None] = MappingProxyType({})
) -> Grid:
    """Rows of every axis: the base model's parameters, then those of each effect.

    Parameters
    ----------
    model : Model
    lines : mapping of axis name to Estimate or None
        With friction as the line through the friction curve, where that bends.
    """
    bent = any(line is not None for line in lines.values())
    caption = f"parameters ({EFFECTIVE})" if bent else "parameters"
    rows = [
        (name, *cells)
        for name, axis in model.axes.items()
        for cells in (*_line_rows(lines.get(name), axis), *_rows(axis))
    ]
    return Grid(caption, ("axis", "parameter", "value", "95 % interval", "unit"), rows)


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

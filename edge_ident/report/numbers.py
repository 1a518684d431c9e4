"""Numbers and units in words, and the parameters of a model with their 95 % intervals."""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Final

from edge_ident.model.effects import named
from edge_ident.model.model import NORMAL_95, PARAMETERS, AxisModel, Estimate, Model, Term
from edge_ident.model.model_files import unit_of, values_document
from edge_ident.report.view import Grid, ResultView, Row, grid_of
from edge_ident.support.rows import Cell, Table, table_of
from edge_ident.support.words import spoken

_EFFORT_WORDS: Final = {"N": "force", "N*m": "torque", "A": "current", "V": "voltage"}
# A unit with a product or a square, as in N*m or kg*m^2.
_UNIT: Final = re.compile(r"\b[A-Za-z]+(?:\*[A-Za-z]+|\^2)[A-Za-z*^2/]*")


def digits(value: float, significant: int) -> str:
    """A value to so many significant digits, without an exponent where that can be read."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    scientific = f"{value:.{significant - 1}e}"
    exponent = int(scientific.partition("e")[2])  # of the rounded value: 0.00999 may be 0.0100
    if not -4 <= exponent < 6:
        return minus(scientific)
    return minus(f"{value:.{max(0, significant - 1 - exponent)}f}")


def minus(text: str) -> str:
    """Text with a true minus sign."""
    return text.replace("-", "−")


def unit_text(unit: str) -> str:
    """A unit as people write it."""
    if unit == "1":
        return ""
    return unit.replace("*", "·").replace("^2", "²")


def effort_word(unit: str) -> str:
    """What people call an effort of this unit."""
    return _EFFORT_WORDS.get(unit, "effort")


def sentence(text: str) -> str:
    """A part of a sentence as a whole one, units as people write them."""
    text = _UNIT.sub(lambda unit: unit_text(unit[0]), text)
    return f"{text[0].upper()}{text[1:]}" + ("" if text.endswith(".") else ".")


# Values with what is known of them.

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


def to_its_std(value: float, std: float) -> tuple[str, str]:
    """A value and its standard deviation, both to two digits of the deviation."""
    shown = decimals(std)
    return minus(f"{value:.{shown}f}"), f"{std:.{shown}f}"


def with_interval(value: float, std: float | None) -> str:
    """A value with its 95 % interval, to the digits that the deviation leaves."""
    texts = interval_texts(value, std)
    if texts is None:
        return digits(value, 4)
    return "{} ({}\u00a0to\u00a0{})".format(*map(minus, texts))


# Parameters of several estimates, and of a model.


def estimate_rows(
    estimates: Sequence[Estimate | None], units: Sequence[str], shown: Callable[[float, float], str]
) -> list[Row]:
    """A row for each parameter: its name, each estimate, and the unit; – where one has none."""
    return [
        (
            spoken(name),
            *(
                "–" if e is None else shown(float(e.parameters[i]), float(e.std[i]))
                for e in estimates
            ),
            units[i],
        )
        for i, name in enumerate(PARAMETERS)
    ]


def effective_rows(
    lines: Sequence[Estimate | None], units: Sequence[str], shown: Callable[[float, float], str]
) -> list[Row]:
    """The same of friction as the line through the friction curve."""
    return [(f"effective {name}", *rest) for name, *rest in estimate_rows(lines, units, shown)[1:]]


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


TERM_ROW = ("effect", "parameter", "value", "std", "unit")


def term_rows(term: Term, units: tuple[str, str]) -> Iterator[tuple[Cell, ...]]:
    """Cells of `TERM_ROW` for each parameter of a term; a deviation that is not known is None."""
    for parameter in named(term.effect).parameters:
        if parameter.name in term.values:
            std = term.std.get(parameter.name)
            yield (
                term.effect,
                parameter.name,
                float(term.values[parameter.name]),
                None if std is None else float(std),
                unit_of(parameter, *units),
            )


def model_table(model: Model) -> Table:
    """A row for each parameter of each term of each axis."""
    rows = (
        (name, *row)
        for name, axis in model.axes.items()
        for term in axis.terms
        for row in term_rows(term, axis.units)
    )
    return table_of(("axis", *TERM_ROW), rows)


VIEW: Final = ResultView(model_table, lambda model: [grid_of(model_table(model), "model")])

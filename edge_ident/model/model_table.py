"""A model as one table: a row for each parameter of each term."""

from collections.abc import Iterator

from edge_ident.model.effects import named
from edge_ident.model.model import Model, Term
from edge_ident.model.model_reading import unit_of
from edge_ident.support.rows import Cell, Table, table_of

NAMES = ("axis", "effect", "parameter", "value", "std", "unit")


def model_table(model: Model) -> Table:
    """Columns of `NAMES`; a deviation that is not known is None."""
    rows = (
        (name, *row)
        for name, axis in model.axes.items()
        for term in axis.terms
        for row in term_rows(term, axis.units)
    )
    return table_of(NAMES, rows)


def term_rows(term: Term, units: tuple[str, str]) -> Iterator[tuple[Cell, ...]]:
    """Effect, parameter, value, deviation and unit of each parameter of a term."""
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

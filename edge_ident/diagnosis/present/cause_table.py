"""A diagnosis as one table that a data frame takes: a row for each parameter of each cause."""

from collections.abc import Iterator

from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.model.model_files import term_rows
from edge_ident.support.rows import Cell, Table, table_of

NAMES = (
    "axis", "verdict", "kind", "effect", "parameter", "value", "std", "unit", "share",
    "held_out_gain", "evidence",
)  # fmt: skip


def cause_table(diagnosis: Diagnosis) -> Table:
    """Columns of `NAMES`; `kind` is supported, suspected or minor. An axis without a cause has one
    row with its verdict alone."""
    return table_of(
        NAMES, (row for name, axis in diagnosis.axes.items() for row in _rows(name, axis))
    )


def _rows(name: str, axis: AxisDiagnosis) -> Iterator[tuple[Cell, ...]]:
    kinds = {"supported": axis.causes, "suspected": axis.suspected, "minor": axis.minor}
    if not any(kinds.values()):
        yield name, axis.verdict.value, *(None,) * (len(NAMES) - 2)
    for kind, causes in kinds.items():
        for cause in causes:
            for row in term_rows(cause.term, axis.model.units):
                size = cause.share, cause.held_out_gain, cause.evidence
                yield name, axis.verdict.value, kind, *row, *size

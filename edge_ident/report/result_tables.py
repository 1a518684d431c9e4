"""Results as tables that a data frame takes: one row for each number that was found."""

from collections.abc import Iterator
from dataclasses import astuple, fields
from typing import TYPE_CHECKING, Final

from edge_ident.model.model import PARAMETERS
from edge_ident.model.model_files import NAMES as OF_MODELS
from edge_ident.model.model_files import term_rows
from edge_ident.report.gain_rows import gain_label
from edge_ident.support.rows import Cell, Table, table_of

if TYPE_CHECKING:
    from edge_ident.baselines.comparison import Comparison
    from edge_ident.control.drive_gains import GainDesigns
    from edge_ident.experiment.result import MotionPlan
    from edge_ident.identification.result import Identification

_COMPARED: Final = (
    "axis", "method", "parameter", "value", "std", "unit", "relative_residual", "time_ms", "reason",
)  # fmt: skip


def identification_table(found: "Identification") -> Table:
    """A row for each parameter of each axis: those of the base model, then those of each effect."""

    def rows() -> Iterator[tuple[Cell, ...]]:
        for name, axis in found.axes.items():
            for index, term in enumerate(axis.model.terms):
                known = axis.known if index == 0 else (None,) * len(term.values)
                for row, certain in zip(term_rows(term, axis.model.units), known, strict=False):
                    yield name, *row, certain, axis.trusted

    return table_of((*OF_MODELS, "known", "trusted"), rows())


def designs_table(designs: "GainDesigns") -> Table:
    """A row for each number of each axis's design: bandwidth, margins and gains."""

    def rows() -> Iterator[tuple[Cell, ...]]:
        for name, design in designs.axes.items():
            yield name, "bandwidth", 0, design.bandwidth_rad_s, "rad/s"
            yield name, "phase_margin", 0, design.phase_margin_rad, "rad"
            yield name, "gain_margin", 0, design.gain_margin, "1"
            for of in fields(design.gains):
                value = getattr(design.gains, of.name)
                numbers = value if isinstance(value, tuple) else (value,)
                for place, entry in enumerate(numbers):
                    yield name, of.name, place, float(entry), _unit(of.name)

    return table_of(("axis", "quantity", "place", "value", "unit"), rows())


def _unit(gain: str) -> str | None:
    """The unit that a gain's name holds."""
    label = gain_label(gain)
    return label.rpartition("(")[2].rstrip(")") if label.endswith(")") else None


def comparison_table(comparison: "Comparison") -> Table:
    """A row for each parameter of each method; one with a reason where a method has no answer."""

    def rows() -> Iterator[tuple[Cell, ...]]:
        for name, axis in comparison.axes.items():
            for row in axis.rows:
                residual = None if row.metric is None else float(row.metric.relative_residual)
                rest = residual, row.time_ms, row.reason or None
                if row.estimate is None:
                    yield name, row.method, None, None, None, None, *rest
                    continue
                for i, parameter in enumerate(PARAMETERS):
                    value, std = float(row.estimate.parameters[i]), float(row.estimate.std[i])
                    yield name, row.method, parameter, value, std, axis.units[i], *rest

    return table_of(_COMPARED, rows())


def plan_table(plan: "MotionPlan") -> Table:
    """A row for each pair of explanations: how far apart they are before and on the motion."""
    from edge_ident.experiment.result import PlannedPair

    names = (*(of.name for of in fields(PlannedPair)), "separated")
    rows = ((*map(_cell, astuple(pair)), pair.separated) for pair in plan.pairs)
    return table_of(names, rows)


def _cell(value: object) -> Cell:
    return value if value is None or isinstance(value, bool | float) else str(value)

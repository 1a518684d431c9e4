"""Recordings, and what holds models, as tables that a data frame takes."""

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from edge_ident.model.effects import named
from edge_ident.model.model import Model, Term
from edge_ident.model.model_files import unit_of
from edge_ident.report.view import ResultView, grid_of
from edge_ident.signals.recording import Recording
from edge_ident.support.rows import Cell, Table, table_of

if TYPE_CHECKING:
    from edge_ident.identification.result import Identification


# A recording: a row for each axis.

_OF_RECORDINGS = (
    "axis", "lowest_position", "highest_position", "position_unit", "rms_effort", "peak_effort",
    "effort_unit", "also",
)  # fmt: skip
_ALSO = ("reference", "velocity", "temperature_c")


def recording_table(recording: Recording) -> Table:
    """Columns of `_OF_RECORDINGS`; an axis without a drive has no effort."""
    rows: list[tuple[Cell, ...]] = []
    for name, axis in recording.axes.items():
        also = ", ".join(what for what in _ALSO if getattr(axis, what) is not None)
        effort = np.asarray(axis.effort, dtype=np.float64)
        rms, peak = float(np.sqrt(np.mean(effort**2))), float(np.max(np.abs(effort)))
        rows.append(
            (name, *_range(axis.position), axis.position_unit, rms, peak, axis.effort_unit, also)
        )
    for name, passive in recording.passive.items():
        ends = _range(passive.position)
        rows.append((name, *ends, passive.position_unit, None, None, None, "no drive"))
    return table_of(_OF_RECORDINGS, rows)


def length_in_words(recording: Recording) -> str:
    """Source, samples, duration and rate, in one line."""
    time_s = recording.time_s
    duration_s = float(time_s[-1] - time_s[0]) if len(time_s) > 1 else 0.0
    said = f"{recording.source}: {len(time_s)} samples, {duration_s:.4g} s"
    return said + (f", {(len(time_s) - 1) / duration_s:.4g} Hz" if duration_s > 0.0 else "")


def _range(position: np.ndarray) -> tuple[float, float]:
    return float(np.min(position)), float(np.max(position))


def recording_view(recording: Recording) -> ResultView:
    """What a recording holds."""
    table = partial(recording_table, recording)
    return ResultView(table, lambda: [grid_of(table(), length_in_words(recording))])


# Models and what holds some: a row for each parameter of each term.

_OF_TERMS = ("effect", "parameter", "value", "std", "unit")


def term_rows(term: Term, units: tuple[str, str]) -> Iterator[tuple[Cell, ...]]:
    """Cells of `_OF_TERMS` for each parameter of a term; a deviation that is not known is None."""
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
    return table_of(("axis", *_OF_TERMS), rows)


def model_view(model: Model) -> ResultView:
    """The parameters of a model."""
    table = partial(model_table, model)
    return ResultView(table, lambda: [grid_of(table(), "model")])


def identification_table(found: "Identification") -> Table:
    """A row for each parameter of each axis: those of the base model, then those of each effect."""

    def rows() -> Iterator[tuple[Cell, ...]]:
        for name, axis in found.axes.items():
            for index, term in enumerate(axis.model.terms):
                known = axis.known if index == 0 else (None,) * len(term.values)
                for row, certain in zip(term_rows(term, axis.model.units), known, strict=False):
                    yield name, *row, certain, axis.trusted

    return table_of(("axis", *_OF_TERMS, "known", "trusted"), rows())

"""The gains of a board as a document and as tables: active, new, predicted, measured."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from edge_ident.commissioning.promise import Expected, Forecast, Forecasts, Promise
from edge_ident.commissioning.verification import GainChange
from edge_ident.report.gain_rows import gain_rows
from edge_ident.report.output import labelled, next_lines
from edge_ident.report.promise_report import commit_document, promise_document, promise_rows, tried
from edge_ident.support.console import FittingTable
from edge_ident.support.documents import finite
from firmware_interface.gains import Bank


@dataclass(frozen=True)
class GainReport:
    """What a command read of a board's gains, and what it changed.

    Attributes
    ----------
    serial_number : int
        Of the board.
    active : mapping of axis name to AxisGains
        The gains that the board used when the command began.
    new : mapping of axis name to AxisGains, or None
        The gains that are staged, compared, or were committed.
    forecasts : sequence of mapping of axis name to Forecast
        Of `active` and `new`; empty where neither model nor recording is given.
    backup : Path or None
        The file that keeps the active gains, where one was written.
    change : GainChange or None
        What a commit did.
    unconfirmed_s : float or None
        Time left to confirm the active gains.
    """

    serial_number: int
    active: Bank
    new: Bank | None = None
    forecasts: Forecasts = ()
    backup: Path | None = None
    change: GainChange | None = None
    unconfirmed_s: float | None = None


def gain_report_document(report: GainReport) -> dict[str, Any]:
    """Schema edge-ident/board-gains/1."""
    change = report.change
    return {
        "schema": "edge-ident/board-gains/1",
        "serial_number": report.serial_number,
        "axes": {axis: _axis_document(report, axis) for axis in report.active},
        "unconfirmed_s": report.unconfirmed_s,
        "confirmed": None if change is None else change.confirmed,
        "unchanged": None if change is None else change.unchanged,
        "promise": None if change is None else promise_document(change.promise),
        "contradicted": {} if change is None else dict(change.contradicted),
        "commit": commit_document(change),
        "backup": None if report.backup is None else str(report.backup),
    }


def _axis_document(report: GainReport, axis: str) -> dict[str, Any]:
    change, forecasts = report.change, [_forecast(f[axis]) for f in report.forecasts]
    measured = _measured(change, axis)
    tracking = None if measured is None else dict(zip(("before", "after"), measured, strict=True))
    return {
        "active": dataclasses.asdict(report.active[axis]),
        "new": None if report.new is None else dataclasses.asdict(report.new[axis]),
        "forecast": dict(zip(("active", "new"), forecasts, strict=False)) or None,
        "tracking_rms_rad": tracking,
    }


def _measured(change: GainChange | None, axis: str) -> tuple[float | None, float] | None:
    """Tracking error with the previous gains, where a motion measured it, and with the new ones."""
    if change is None or change.tracking_after_rad is None:
        return None
    verified = change.verification
    before = None if verified is None else verified.axes[axis].before_rad
    return before, change.tracking_after_rad[axis]


def _forecast(forecast: Forecast) -> dict[str, Any]:
    rms, peak = forecast.tracking_rms, forecast.tracking_peak
    return {
        "stable": forecast.stable,
        "phase_margin_deg": forecast.phase_margin_deg,
        "gain_margin": finite(forecast.gain_margin),
        "tracking_rms_rad": None if rms is None else finite(rms.middle_rad),
        "tracking_rms_interval_rad": _ends(rms),
        "tracking_peak_rad": None if peak is None else finite(peak.middle_rad),
        "tracking_peak_interval_rad": _ends(peak),
    }


def _ends(expected: Expected | None) -> list[float | None] | None:
    return None if expected is None else [finite(expected.low_rad), finite(expected.high_rad)]


def gain_report_view(report: GainReport) -> Group:
    """What became of the gains, and what to do next; then a table per axis."""
    change = report.change
    parts: list[RenderableType] = []
    if change is not None:
        parts.append(labelled("gains", change.conclusion))
        parts += next_lines([change.next_step] if change.next_step else [])
    if report.unconfirmed_s is not None:
        parts.append(Text(f"not confirmed: the board rolls back in {report.unconfirmed_s:.0f} s"))
    if report.backup:
        parts.append(Text(f"backup of the previous gains: {report.backup}"))
    parts += [_table(report, axis) for axis in report.active]
    if change is not None and change.promise:
        parts.append(promise_view(change.promise))
    return Group(*parts)


def promise_view(promise: Promise) -> FittingTable:
    """A row for every axis and motion; nothing is measured where no gains were tried."""
    title = "tracking error promised, mrad" + ("" if tried(promise) else "; not tried")
    table = FittingTable(title=title, title_justify="left")
    headings = ("motion", "axis", "", "now", "after (90 %)", "kept up to", "measured", "kept")
    shown = len(headings) if tried(promise) else -3
    for heading in headings[:shown]:
        table.add_column(heading, justify="right")
    for *cells, kept in promise_rows(promise):
        row: tuple[str | Text, ...] = (
            *map(escape, cells),
            Text(kept, style="bold red" if kept == "no" else ""),
        )
        table.add_row(*row[:shown])
    return table


def _table(report: GainReport, axis: str) -> FittingTable:
    title = f"board {report.serial_number}, axis {escape(axis)}: gains, in N·m, rad and s"
    table = FittingTable(title=title, title_justify="left")
    table.add_column("")
    for heading in ("active", "new", "change")[: 1 if report.new is None else 3]:
        table.add_column(heading, justify="right")
    banks = [report.active[axis]] + ([] if report.new is None else [report.new[axis]])
    for row in gain_rows(banks):
        change = [] if report.new is None else [row.change]
        table.add_row(row.label, *row.cells(4), *change)
    for label, shown in _predictions(report, axis):
        table.add_row(label, *shown)
    return table


def _predictions(report: GainReport, axis: str) -> list[tuple[str, list[str]]]:
    """Rows below the gains: predicted margins, simulated and measured tracking error."""
    rows: list[tuple[str, list[str]]] = []
    forecasts = [forecast[axis] for forecast in report.forecasts]
    if forecasts:
        rows.append(("phase margin (°)", [f"{f.phase_margin_deg:.0f}" for f in forecasts]))
        rows.append(("gain margin", [f"{f.gain_margin:.3g}" for f in forecasts]))
    for quantity in ("rms", "peak"):
        found = [getattr(forecast, f"tracking_{quantity}") for forecast in forecasts]
        if found and None not in found:
            cells = [
                f"{1e3 * of.middle_rad:.3g} ({1e3 * of.low_rad:.3g} to {1e3 * of.high_rad:.3g})"
                for of in found
            ]
            rows.append((f"tracking error, {quantity}, forecast (mrad)", cells))
    measured = _measured(report.change, axis)
    if measured is not None:
        shown = ["" if rms is None else f"{1e3 * rms:.3g}" for rms in measured]
        rows.append(("tracking error, rms, measured (mrad)", shown))
    return rows

"""The gains of a board as a document and as tables: active, new, promised, measured."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from edge_ident.commissioning.promise import (
    Expected,
    ExpectedErrors,
    Forecast,
    Forecasts,
    Promise,
    Promised,
)
from edge_ident.commissioning.verification import GainChange
from edge_ident.report.gain_rows import gain_rows
from edge_ident.report.view import Answer, Grid, Line, Part, Row, next_lines
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
        "tracking_rms_interval_rad": rms and _ends(rms),
        "tracking_peak_rad": None if peak is None else finite(peak.middle_rad),
        "tracking_peak_interval_rad": peak and _ends(peak),
    }


def _ends(expected: Expected) -> list[float | None]:
    return [finite(expected.low_rad), finite(expected.high_rad)]


def gain_report_view(report: GainReport) -> Answer:
    """What became of the gains, and what to do next; then a table per axis."""
    change = report.change
    parts: list[Part] = []
    if change is not None:
        parts.append(Line(change.conclusion, "gains", "strong"))
        parts += next_lines([change.next_step] if change.next_step else [])
    if report.unconfirmed_s is not None:
        parts.append(Line(f"not confirmed: the board rolls back in {report.unconfirmed_s:.0f} s"))
    if report.backup:
        parts.append(Line(f"backup of the previous gains: {report.backup}"))
    parts += [_table(report, axis) for axis in report.active]
    if change is not None and change.promise:
        parts.append(promise_grid(change.promise))
    return Answer(tuple(parts))


def _table(report: GainReport, axis: str) -> Grid:
    banks, headings = [report.active[axis]], ["active"]
    if report.new is not None:
        banks, headings = [*banks, report.new[axis]], ["active", "new", "change"]
    rows = [(row.label, *row.cells(4), row.change)[: 1 + len(headings)] for row in gain_rows(banks)]
    for label, shown in _predictions(report, axis):
        rows.append((label, *shown, *[""] * (len(headings) - len(shown))))
    caption = f"board {report.serial_number}, axis {axis}: gains, in N·m, rad and s"
    return Grid(caption, ("", *headings), rows)


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


# What new gains promised, what was measured, and how they came into force.


def promise_document(promise: Promise | None) -> dict[str, Any] | None:
    """By axis and motion: measured now, forecast of both, measured afterwards, kept or not."""
    if promise is None:
        return None
    found: dict[str, Any] = {}
    for motion, axis, of_axis in promise.every:
        found.setdefault(axis, {})[motion] = _promised(of_axis, promise.judged)
    return found


def _promised(of_axis: Promised, judged: int) -> dict[str, Any]:
    then, measured = of_axis.after, of_axis.measured
    return {
        "now": {"rms_rad": of_axis.now.rms_rad, "peak_rad": of_axis.now.peak_rad},
        "now_forecast": _errors(of_axis.now_forecast),
        "bias": finite(of_axis.bias),
        "after": {
            "rms_rad": finite(then.rms.middle_rad),
            "peak_rad": finite(then.peak.middle_rad),
        },
        "interval": {"rms_rad": _ends(then.rms), "peak_rad": _ends(then.peak)},
        "limit": {
            "rms_rad": finite(of_axis.rms_limit_rad(judged)),
            "peak_rad": finite(of_axis.peak_limit_rad(judged)),
        },
        "improvement": finite(of_axis.improvement),
        "tried": measured is not None,
        "measured": None
        if measured is None
        else {"rms_rad": measured.rms_rad, "peak_rad": measured.peak_rad},
        "kept": of_axis.kept(judged),
    }


def _errors(of: ExpectedErrors) -> dict[str, Any]:
    return {
        "rms_rad": finite(of.rms.middle_rad),
        "rms_interval_rad": _ends(of.rms),
        "peak_rad": finite(of.peak.middle_rad),
        "peak_interval_rad": _ends(of.peak),
    }


def commit_document(change: GainChange | None) -> dict[str, Any] | None:
    """How new gains came into force; None where none were written."""
    if change is None or change.unchanged or change.dry_run:
        return None
    running = change.running
    return {
        "running": running is not None and running.taken,
        "jump_nm": None if running is None else dict(running.jumps_nm),
        "refused": None if running is None or running.taken else running.result.name,
    }


def tried(promise: Promise) -> bool:
    """Whether a motion was made with the new gains."""
    return any(of_axis.measured is not None for *_, of_axis in promise.every)


def promise_grid(promise: Promise) -> Grid:
    """Rms and peak of every axis and motion; nothing is measured where no gains were tried."""
    headings = ("motion", "axis", "", "now", "after (90 %)", "kept up to", "measured", "kept")
    rows: list[Row] = [
        (*cells, Line(kept, tone="bad" if kept == "no" else ""))
        for *cells, kept in promise_rows(promise)
    ]
    caption = "tracking error promised, mrad"
    if tried(promise):
        return Grid(caption, headings, rows)
    return Grid(f"{caption}; not tried", headings[:-3], [row[:-3] for row in rows])


def promise_rows(promise: Promise) -> Iterator[tuple[str, ...]]:
    """Motion, axis, quantity; now, promised, limit, measured (mrad); and whether it was kept."""
    for motion, axis, of_axis in promise.every:
        limits_rad = {
            "rms": of_axis.rms_limit_rad(promise.judged),
            "peak": of_axis.peak_limit_rad(promise.judged),
        }
        for quantity, limit_rad in limits_rad.items():
            name, tracked = f"{quantity}_rad", of_axis.measured
            measured_rad = None if tracked is None else getattr(tracked, name)
            yield (
                motion,
                axis,
                quantity,
                _mrad(getattr(of_axis.now, name)),
                _span(getattr(of_axis.after, quantity)),
                _mrad(limit_rad),
                "" if measured_rad is None else _mrad(measured_rad),
                "" if measured_rad is None else "yes" if measured_rad <= limit_rad else "no",
            )


def _span(of: Expected) -> str:
    return f"{_mrad(of.middle_rad)} ({_mrad(of.low_rad)} to {_mrad(of.high_rad)})"


def _mrad(value_rad: float) -> str:
    return f"{1e3 * value_rad:.3g}"

"""What a person and a script are told of a board's gains: in force, new, promised, measured."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from edge_ident.commissioning.gain_change import GainChange
from edge_ident.commissioning.gain_forecast import Forecast, Forecasts
from edge_ident.commissioning.gain_transfer import change_factor
from edge_ident.support.json_text import finite
from firmware_interface.gains import AxisGains, Bank

_console = Console(highlight=False)


@dataclass(frozen=True)
class GainReport:
    """One look at a board's gains, or one step of their life.

    Attributes
    ----------
    active : mapping of axis name to AxisGains
        In force when the command began.
    new : mapping of axis name to AxisGains, or None
        Those that are staged, compared, or were committed.
    forecasts : sequence of mapping of axis name to Forecast
        Of `active` and `new`; empty where neither model nor recording is given.
    backup : Path or None
        Where the gains in force were kept before anything was written.
    change : GainChange or None
        What a commit did.
    unconfirmed_s : float or None
        Time left to confirm what is in force.
    """

    serial_number: int
    active: Bank
    new: Bank | None = None
    forecasts: Forecasts = ()
    backup: Path | None = None
    change: GainChange | None = None
    unconfirmed_s: float | None = None


def report_document(report: GainReport) -> dict[str, Any]:
    """Schema edge-ident/board-gains/1."""
    change = report.change
    return {
        "schema": "edge-ident/board-gains/1",
        "serial_number": report.serial_number,
        "axes": {axis: _axis_document(report, axis) for axis in report.active},
        "unconfirmed_s": report.unconfirmed_s,
        "confirmed": None if change is None else change.confirmed,
        "unchanged": None if change is None else change.unchanged,
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
    """Tracking error with the gains of before, where they were tried, and with the new ones."""
    if change is None or change.tracking_after_rad is None:
        return None
    verified = change.verification
    before = None if verified is None else verified.axes[axis].before_rad
    return before, change.tracking_after_rad[axis]


def _forecast(forecast: Forecast) -> dict[str, Any]:
    tracking = forecast.tracking_rms_rad
    return {
        "stable": forecast.stable,
        "phase_margin_deg": forecast.phase_margin_deg,
        "gain_margin": finite(forecast.gain_margin),
        "tracking_rms_rad": None if tracking is None else finite(tracking),
    }


def print_report(report: GainReport) -> None:
    """A table per axis."""
    for axis in report.active:
        _console.print(_table(report, axis))
    if report.unconfirmed_s is not None:
        _console.print(f"not confirmed: the board rolls back in {report.unconfirmed_s:.0f} s")
    if report.backup:
        _console.print(f"gains of before: {report.backup}")
    if report.change:
        _console.print(report.change.conclusion)


def _table(report: GainReport, axis: str) -> Table:
    table = Table(title=f"board {report.serial_number}, axis {axis}", title_justify="left")
    table.add_column("", no_wrap=True)
    for heading in ("in force", "new", "change")[: 1 if report.new is None else 3]:
        table.add_column(heading, justify="right", no_wrap=True)
    banks = [report.active[axis]] + ([] if report.new is None else [report.new[axis]])
    for name in banks[0].numbers():
        values = [bank.numbers()[name] for bank in banks]
        if not name.startswith("ripple") or any(map(_ripples, banks)):
            table.add_row(name.replace("_", " "), *(f"{v:.4g}" for v in values), _times(values))
    for label, shown in _promises(report, axis):
        table.add_row(label, *shown)
    return table


def _ripples(bank: AxisGains) -> bool:
    return any((*bank.ripple_cosine, *bank.ripple_sine))


def _times(values: list[float]) -> str:
    """By how much a gain changes; nothing where it stays or has no factor."""
    if len(values) < 2 or np.float32(values[0]) == np.float32(values[1]):
        return ""
    factor = change_factor(*values)
    if math.isinf(factor):
        return f"{values[1] - values[0]:+.3g}"
    return f"× {factor:.3g}" if values[1] > values[0] else f"/ {factor:.3g}"


def _promises(report: GainReport, axis: str) -> list[tuple[str, list[str]]]:
    """Rows below the gains: margins, simulated and measured tracking."""
    rows: list[tuple[str, list[str]]] = []
    forecasts = [forecast[axis] for forecast in report.forecasts]
    if forecasts:
        rows.append(("phase margin °", [f"{f.phase_margin_deg:.0f}" for f in forecasts]))
        rows.append(("gain margin", [f"{f.gain_margin:.3g}" for f in forecasts]))
    simulated = [f.tracking_rms_rad for f in forecasts if f.tracking_rms_rad is not None]
    if simulated:
        rows.append(("tracking, simulated mrad", [f"{1e3 * rms:.3g}" for rms in simulated]))
    measured = _measured(report.change, axis)
    if measured is not None:
        rows.append(
            (
                "tracking, measured mrad",
                ["" if rms is None else f"{1e3 * rms:.3g}" for rms in measured],
            )
        )
    return rows

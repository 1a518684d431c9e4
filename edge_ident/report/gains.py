"""Gains as people read them: of a design, and of a board, with what was promised and measured."""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

import numpy as np

from edge_ident.commissioning.gain_transfer import change_factor
from edge_ident.commissioning.promise import (
    Expected,
    ExpectedErrors,
    Forecast,
    Forecasts,
    Promise,
    Promised,
)
from edge_ident.commissioning.verification import GainChange
from edge_ident.control.gain_design import GainDesign, GainDesigns
from edge_ident.report.chart import Array, Chart, Layer, across, around, of_axes
from edge_ident.report.view import Grid, Line, Part, Parts, ResultView, Row, next_lines
from edge_ident.support.documents import finite
from edge_ident.support.rows import Cell, Table, table_of
from edge_ident.support.words import spoken
from firmware_interface.gains import AxisGains, Bank, numbers_in_use

_RIPPLE: Final = "ripple_"


@dataclass(frozen=True)
class GainRow:
    """A gain, a table or a ripple of one or more banks.

    Attributes
    ----------
    name : str
        Field of `AxisGains`; `ripple 1` and so on for a ripple.
    entries : int
        Of a table; 0 for anything else.
    values : tuple of tuple of float
        Of each bank: one number, the entries of a table, or cosine, sine (N*m), period (rad) and
        fade speed (rad/s) of a ripple.
    """

    name: str
    entries: int
    values: tuple[tuple[float, ...], ...]

    @property
    def label(self) -> str:
        """The name in words, with the number of entries of a table."""
        words = gain_label(self.name)
        return f"{words} ({self.entries})" if self.entries else words

    def cells(self, digits: int) -> list[str]:
        """What each bank holds.

        Parameters
        ----------
        digits : int
            Of a number that stands alone; the ends of a table have two.
        """
        return [self._cell(numbers, digits) for numbers in self.values]

    def _cell(self, numbers: tuple[float, ...], digits: int) -> str:
        if self.entries:
            ends = dict.fromkeys((f"{min(numbers):.2g}", f"{max(numbers):.2g}"))
            return " to ".join(ends)
        if len(numbers) == 1:
            return f"{numbers[0]:.{digits}g}"
        amplitude = math.hypot(*numbers[:2])
        return f"{amplitude:.3g} N·m every {numbers[2]:.4g} rad" if amplitude else ""

    @property
    def change(self) -> str:
        """What the second bank changes: a factor, or the difference from zero; empty if nothing.

        Of a table the largest difference of an entry.
        """
        if len(self.values) < 2:
            return ""
        old, new = (np.array(numbers, np.float32) for numbers in self.values[:2])
        if np.array_equal(old, new):
            return ""
        if self.entries:
            return f"by up to {np.max(np.abs(new - old)):.2g}"
        return "changed" if len(old) > 1 else _factor(float(old[0]), float(new[0]))


def gain_label(name: str) -> str:
    """A gain's name in words, its unit in brackets where the name holds it."""
    for ending, unit in (("_rad_s", "rad/s"), ("_rad", "rad"), ("_s", "s")):
        if name.endswith(ending):
            return f"{name.removesuffix(ending).replace('_', ' ')} ({unit})"
    return name.replace("_", " ")


def _factor(old: float, new: float) -> str:
    factor = change_factor(old, new)
    if math.isinf(factor):
        return f"{new - old:+.3g}"
    return f"× {factor:.3g}" if new > old else f"/ {factor:.3g}"


def gain_rows(banks: Sequence[AxisGains]) -> list[GainRow]:
    """Rows of all that the banks use.

    Parameters
    ----------
    banks : sequence of AxisGains
        Of several axes, or of one axis at several times.
    """
    used = {name.partition("[")[0] for name in numbers_in_use(banks)}
    names = [of.name for of in fields(AxisGains) if of.name in used]
    rows = [_row(name, banks) for name in names if not name.startswith(_RIPPLE)]
    ripples = sorted({k for bank in banks for k in bank.ripples})
    return rows + [GainRow(f"ripple {k + 1}", 0, _ripples(banks, k)) for k in ripples]


def _row(name: str, banks: Sequence[AxisGains]) -> GainRow:
    values = [getattr(bank, name) for bank in banks]
    if isinstance(values[0], tuple):
        return GainRow(name, len(values[0]), tuple(values))
    return GainRow(name, 0, tuple((value,) for value in values))


def _ripples(banks: Sequence[AxisGains], k: int) -> tuple[tuple[float, ...], ...]:
    return tuple(
        (
            bank.ripple_cosine[k],
            bank.ripple_sine[k],
            bank.ripple_period_rad[k],
            bank.ripple_fade_speed_rad_s[k],
        )
        for bank in banks
    )


# Designs of all axes of a drive.


def designs_parts(designs: Mapping[str, GainDesign]) -> Iterator[Part]:
    """Bandwidth, margins and gains, a column per axis; below, what became of each effect."""
    rows = _design_rows(list(designs.values()))
    headings = ("", *(f"axis {name}" for name in designs))
    yield Grid("gains, in N·m, rad and s", headings, list(rows))
    yield from (Line(f"  {said}") for said in effects_said(designs))


def effects_said(designs: Mapping[str, GainDesign]) -> Iterator[str]:
    """What became of each effect of the model."""
    for name, design in designs.items():
        for used in design.used:
            yield f"axis {name}, {spoken(used.effect)}: {used.sentence}"
        for unused in design.unused:
            yield f"axis {name}, {spoken(unused.effect)} is not used: {unused.reason}"


def _design_rows(designs: Sequence[GainDesign]) -> Iterator[tuple[str, ...]]:
    yield "bandwidth (rad/s)", *(f"{d.bandwidth_rad_s:.4g}" for d in designs)
    yield "phase margin (°)", *(f"{d.phase_margin_deg:.4g}" for d in designs)
    yield "gain margin", *(f"{d.gain_margin:.4g}" for d in designs)
    for row in gain_rows([d.gains for d in designs]):
        yield row.label, *row.cells(4)


def designs_table(designs: GainDesigns) -> Table:
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


# The designed loops in the frequency domain.


def _charts(designs: GainDesigns) -> list[list[Chart]]:
    """The open loop of every axis: magnitude above, phase below."""
    return of_axes({name: _loop_charts(name, designs) for name in designs.axes})


def _loop_charts(name: str, designs: GainDesigns) -> tuple[Chart, Chart]:
    design, loop = designs.axes[name], designs.loops[name]
    omega, magnitude = loop.omega_rad_s, np.abs(loop.response)
    phase = np.degrees(np.unwrap(np.angle(loop.response)))
    margins = f"phase margin {design.phase_margin_deg:.0f}°, gain margin {design.gain_margin:.3g}"
    x, frequency = across(omega, "log"), ("frequency", "rad/s")

    def layers(curve: Array, level: float) -> tuple[Layer, ...]:
        ends = np.array([x.low, x.high])
        return (
            Layer("line", "edge", ends, np.full(2, level)),
            Layer("line", "extended", omega, curve),
        )

    return (
        Chart("", margins, "", frequency, ("open loop, magnitude", ""), x,
              across(magnitude, "log"), layers(magnitude, 1.0)),
        Chart("", "", "", frequency, ("phase", "°"), x,
              around(np.append(phase, -180.0)), layers(phase, -180.0)),
    )  # fmt: skip


# The gains of a board as a document and as tables: active, new, promised, measured.


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


def gain_report_view(report: GainReport) -> Parts:
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
    return tuple(parts)


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
            rows.append((f"tracking error, {quantity}, forecast (mrad)", list(map(_span, found))))
    measured = _measured(report.change, axis)
    if measured is not None:
        shown = ["" if rms is None else _mrad(rms) for rms in measured]
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
        "after": {"rms_rad": finite(then.rms.middle_rad), "peak_rad": finite(then.peak.middle_rad)},
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


VIEW: Final = ResultView(designs_table, lambda designs: designs_parts(designs.axes), _charts)

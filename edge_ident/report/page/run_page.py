"""A run as one HTML page."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from edge_ident.commissioning.gain_transfer import BACKUP_FILE
from edge_ident.commissioning.identification_motions import CAPTURE_FILE
from edge_ident.commissioning.run import Outcome
from edge_ident.identification.result import AxisIdentification, ParameterSource
from edge_ident.model.model import PARAMETERS, Estimate
from edge_ident.report.chart import Chart
from edge_ident.report.gain_report import promise_grid
from edge_ident.report.gain_rows import gain_rows
from edge_ident.report.identification import identified_charts
from edge_ident.report.numbers import digits, minus, sentence, unit_text, with_interval
from edge_ident.report.page.rendering import Provenance, write_html
from edge_ident.report.page.run_card import (
    effects_said,
    notices,
    peaks_table,
    promise_picture,
    run_card,
)
from edge_ident.report.run_charts import tracking_chart
from edge_ident.report.run_motions import motions_grid
from edge_ident.report.run_tables import old_and_new, tracking_grid
from edge_ident.report.view import Grid, Row
from edge_ident.signals.recording_files import load_recording

if TYPE_CHECKING:
    from edge_ident.report.page.axis_details import AxisDetails


@dataclass(frozen=True)
class RunDetails:
    """What the page says of an axis below the first screen.

    Attributes
    ----------
    key, name : str
        Unique in the page; the axis.
    warnings : list of str
    parameters, conditions : Grid
    charts : list of Chart
    diagnosis : AxisDetails or None
    """

    key: str
    name: str
    warnings: list[str]
    parameters: Grid
    conditions: Grid
    charts: list[Chart]
    diagnosis: "AxisDetails | None"


def write_run_page(
    outcome: Outcome,
    document: dict[str, Any],
    folder: Path,
    device: str | None = None,
    machine: str = "",
) -> Path:
    """Write the page of a run beside its captures.

    Parameters
    ----------
    outcome : Outcome
    document : JSON object
        Of schema edge-ident/run/1.
    folder : Path
        Of the run.
    device : str, optional
        The board's, as --device names it.
    machine : str
        What the machine is called.

    Returns
    -------
    Path
        The page.
    """
    before = load_recording(folder / CAPTURE_FILE)
    verified = outcome.change is not None and outcome.change.verification is not None
    after = load_recording(folder / outcome.file_after) if verified else None
    axes = outcome.identification.axes
    details = [_details(f"a{n}", name, outcome) for n, name in enumerate(axes)]
    cards = []
    for n, name in enumerate(axes):
        chart = tracking_chart(f"c{n}", name, before, after) or details[n].charts[0]
        cards.append(run_card(name, outcome, replace(chart, key=f"c{n}"), device))
    recordings = outcome.captures(folder)
    recordings += [folder / outcome.file_after] if verified else []
    promise = outcome.change.promise if outcome.change else None
    content = {
        "title": "What the run found and did",
        "notices": notices(outcome),
        "conclusion": sentence(outcome.conclusion),
        "cards": cards,
        "details": details,
        "motions": motions_grid(outcome.separation),
        "ended": sentence(outcome.separation.ended) if outcome.separation.ended else "",
        "peaks": peaks_table(outcome.separation),
        "became": _became(outcome),
        "gains": _gains(outcome),
        "effects": effects_said(outcome),
        "promised": promise and promise_grid(promise),
        "promise_picture": promise and promise_picture(promise),
        "worth": tracking_grid(outcome) if verified else None,
        "times": _times(outcome),
        "provenance": Provenance.of(recordings, machine=machine),
        "origin": _origin(document),
    }
    return write_html("run.html.jinja", content, document, folder)


def _origin(document: dict[str, Any]) -> list[tuple[str, str]]:
    """Board, network and backup that a run belongs to."""
    board = ", ".join(f"{k.replace('_', ' ')} {v}" for k, v in document["board"].items())
    network = f"sha256 {document['network_sha256']}"
    return [("board", board), ("network", network), ("old gains", BACKUP_FILE)]


def _besides(name: str, outcome: Outcome) -> Iterator[Row]:
    """How much of the motion was needed, and what the board identified of an axis by itself."""
    early, answer = outcome.early, outcome.board
    if early is not None:
        yield "The motion", sentence(early.sentence)
    if answer is not None:
        said = answer.axes[name].sentence if answer.axes else answer.sentences[0]
        yield "The board itself", sentence(said)


def _details(key: str, name: str, outcome: Outcome) -> RunDetails:
    axis, answer = outcome.identification.axes[name], outcome.answer.axes[name]
    return RunDetails(
        key,
        name,
        [
            f"{sentence(f.message)} Next: {f.next_step}. ({f.code})"
            for f in axis.findings
            if not answer.settles(f)
        ],
        _parameters(axis, answer.model.estimate),
        Grid("How it was identified", ("", ""), [*_conditions(axis), *_besides(name, outcome)]),
        identified_charts(key, axis),
        _diagnosis(key, name, axis),
    )


def _diagnosis(key: str, name: str, axis: AxisIdentification) -> "AxisDetails | None":
    """Where the base model was not enough; scipy, which a plain run lacks, loads here."""
    if axis.diagnosis is None:
        return None
    from edge_ident.diagnosis.result import Diagnosis
    from edge_ident.report.page.axis_details import axis_details

    return axis_details(f"{key}-d", name, Diagnosis({name: axis.diagnosis}, (), {}))


def _parameters(axis: AxisIdentification, best: Estimate) -> Grid:
    """Those of the answer; where further motions made them, beside those of the first."""
    columns = {f"{axis.source.spoken} (used)": best}
    if not np.array_equal(best.parameters, axis.estimate.parameters):
        columns = {"all motions (used)": best, f"first motion, {axis.source.spoken}": axis.estimate}
    if axis.source is not ParameterSource.LEAST_SQUARES:
        columns["least squares"] = axis.least_squares
    if axis.network is not None and axis.source is not ParameterSource.NETWORK:
        columns["network"] = axis.network
    rows: list[Row] = [
        (
            parameter.replace("_", " "),
            *(with_interval(float(e.parameters[i]), float(e.std[i])) for e in columns.values()),
            unit_text(axis.units[i]),
        )
        for i, parameter in enumerate(PARAMETERS)
    ]
    return Grid("Parameters, with 95 % intervals", ("", *columns, "unit"), rows)


def _conditions(axis: AxisIdentification) -> list[Row]:
    timing, metric = axis.timing, axis.metric
    way = "late" if timing.shift_samples >= 0.0 else "early"
    return [
        ("Answer", f"{axis.source.spoken}: {axis.reason}"),
        ("Simple model", axis.adequacy.reason),
        ("Fit, time-spectral metric", f"{metric.fit:.4f}, {metric.time_spectral:.4f}"),
        ("Filtered at", f"{digits(axis.cutoff_hz, 3)} Hz"),
        (
            "Timing",
            f"effort is {abs(timing.shift_samples):.2f} ± {timing.std_samples:.2f} samples {way} "
            f"({digits(1e3 * abs(timing.shift_s), 3)} ms), which is taken into account",
        ),
        ("Network", axis.network_reason or "agrees"),
    ]


def _became(outcome: Outcome) -> str:
    """What became of the gains, as the heading of their part."""
    if outcome.confirmed:
        return "What was written"
    tried = outcome.change is not None and outcome.change.verification is not None
    return "What was written, and taken back" if tried else "What was designed, and not written"


def _gains(outcome: Outcome) -> Grid | None:
    """Every number of every axis, old and new."""
    if not outcome.designs:
        return None
    headings, banks = old_and_new(outcome)
    rows: list[Row] = [(row.label, *map(minus, row.cells(5))) for row in gain_rows(banks)]
    margins = [
        ("bandwidth (rad/s)", "bandwidth_rad_s"),
        ("phase margin (°)", "phase_margin_deg"),
        ("gain margin", "gain_margin"),
    ]
    designs = [design for design in outcome.designs.values() for _ in range(2)]
    for label, attribute in margins:
        cells = [f"{getattr(d, attribute):.3g}" if n % 2 else "" for n, d in enumerate(designs)]
        rows.append((label, *cells))
    return Grid("All gains (rad, N·m, s)", ("", *headings), rows)


def _times(outcome: Outcome) -> Grid:
    rows: list[Row] = [
        (stage.replace("_", " "), f"{ms:.0f} ms") for stage, ms in outcome.timing_ms.items()
    ]
    return Grid("How long it took", ("", ""), rows)

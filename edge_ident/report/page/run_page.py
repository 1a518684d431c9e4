"""A run as one HTML page: first what was written and how much better the axes follow."""

import math
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from markupsafe import Markup, escape

from edge_ident.commissioning import gain_transfer, identification_motions, verification
from edge_ident.commissioning.promise import SHARE, WORTH, Promise, Promised
from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.separation import Separation
from edge_ident.diagnosis.wording import in_words, parts_of, timing_sentence
from edge_ident.experiment.result import QUANTITIES
from edge_ident.identification.result import AxisIdentification, ParameterSource
from edge_ident.model.model import PARAMETERS, Estimate
from edge_ident.report import identification, numbers, run, run_documents
from edge_ident.report.chart import Chart, Scale
from edge_ident.report.gains import effects_said, gain_label, gain_rows, promise_grid, tried
from edge_ident.report.page import rendering as page
from edge_ident.report.view import Grid, Row
from edge_ident.signals.recording_files import load_recording
from edge_ident.support.words import listed, spoken
from firmware_interface.gains import GAIN_FIELDS, OFF

if TYPE_CHECKING:
    from edge_ident.report.page.axis_details import AxisDetails


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
    before = load_recording(folder / identification_motions.CAPTURE_FILE)
    verified = outcome.tried
    after = load_recording(folder / outcome.file_after) if verified else None
    axes = outcome.identification.axes
    details = [_details(f"a{n}", name, outcome) for n, name in enumerate(axes)]
    cards = []
    for n, name in enumerate(axes):
        chart = run.tracking_chart(f"c{n}", name, before, after) or details[n]["charts"][0]
        cards.append(run_card(name, outcome, replace(chart, key=f"c{n}"), device))
    recordings = outcome.captures(folder)
    recordings += [folder / outcome.file_after] if verified else []
    promise = outcome.change.promise if outcome.change else None
    content = {
        "title": "What the run found and did",
        "notices": notices(outcome),
        "conclusion": numbers.sentence(outcome.conclusion),
        "cards": cards,
        "details": details,
        "motions": run.motions_grid(outcome.separation),
        "ended": numbers.sentence(outcome.separation.ended) if outcome.separation.ended else "",
        "peaks": peaks_table(outcome.separation),
        "became": _became(outcome),
        "gains": _gains(outcome),
        "effects": list(map(numbers.sentence, effects_said(outcome.designs))),
        "promised": promise and promise_grid(promise),
        "promise_picture": promise and promise_picture(promise),
        "worth": run.tracking_grid(outcome) if verified else None,
        "times": _times(outcome),
        "provenance": page.Provenance.of(recordings, machine=machine),
        "origin": _origin(document),
    }
    return page.write_html("run.html.jinja", content, document, folder)


def _origin(document: dict[str, Any]) -> list[tuple[str, str]]:
    """Board, network and backup that a run belongs to."""
    board = ", ".join(f"{k.replace('_', ' ')} {v}" for k, v in document["board"].items())
    network = f"sha256 {document['network_sha256']}"
    return [("board", board), ("network", network), ("old gains", gain_transfer.BACKUP_FILE)]


def _besides(name: str, outcome: Outcome) -> Iterator[Row]:
    """How much of the motion was needed, and what the board identified of an axis by itself."""
    early, answer = outcome.early, outcome.board
    if early is not None:
        yield "The motion", numbers.sentence(early.sentence)
    if answer is not None:
        said = answer.axes[name].sentence if answer.axes else answer.sentences[0]
        yield "The board itself", numbers.sentence(said)


def _details(key: str, name: str, outcome: Outcome) -> dict[str, Any]:
    """What the page says of an axis below the first screen."""
    axis, answer = outcome.identification.axes[name], outcome.answer.axes[name]
    warnings = [
        f"{numbers.sentence(f.message)} Next: {f.next_step}. ({f.code})"
        for f in axis.findings
        if not answer.settles(f)
    ]
    conditions = [*_conditions(axis), *_besides(name, outcome)]
    return {
        "key": key,
        "name": name,
        "warnings": warnings,
        "parameters": _parameters(axis, answer.model.estimate),
        "conditions": Grid("How it was identified", ("", ""), conditions),
        "charts": identification.identified_charts(key, axis),
        "diagnosis": _diagnosis(key, name, axis),
    }


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
    units = list(map(numbers.unit_text, axis.units))
    rows = numbers.estimate_rows(list(columns.values()), units, numbers.with_interval)
    return Grid("Parameters, with 95 % intervals", ("", *columns, "unit"), rows)


def _conditions(axis: AxisIdentification) -> list[Row]:
    metric = axis.metric
    return [
        ("Answer", f"{axis.source.spoken}: {axis.reason}"),
        ("Simple model", axis.adequacy.reason),
        ("Fit, time-spectral metric", f"{metric.fit:.4f}, {metric.time_spectral:.4f}"),
        ("Filtered at", f"{numbers.digits(axis.cutoff_hz, 3)} Hz"),
        ("Timing", numbers.sentence(timing_sentence(axis.timing))),
        ("Network", axis.network_reason or "agrees"),
    ]


def _became(outcome: Outcome) -> str:
    """What became of the gains, as the heading of their part."""
    if outcome.confirmed:
        return "What was written"
    said = "written, and taken back" if outcome.tried else "designed, and not written"
    return f"What was {said}"


def _gains(outcome: Outcome) -> Grid | None:
    """Every number of every axis, old and new."""
    if not outcome.designs:
        return None
    headings, banks = run.old_and_new(outcome)
    rows: list[Row] = [(row.label, *map(numbers.minus, row.cells(5))) for row in gain_rows(banks)]
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


# The first screen: what was written, how much better the axis follows, what to do.

# Single numbers that every board has; ripples and tables belong to an effect, which is named.
_FIRST_TERMS: Final = tuple(gain for gain in GAIN_FIELDS[3] if gain in OFF)


def run_card(name: str, outcome: Outcome, chart: Chart, device: str | None = None) -> page.Card:
    """What the first screen says of an axis.

    Parameters
    ----------
    name : str
        Of the axis.
    outcome : Outcome
    chart : Chart
    device : str, optional
        The board's, as --device names it.
    """
    axis = outcome.identification.axes[name]
    found = axis.diagnosis
    causes = () if found is None else found.causes or found.minor
    ending = outcome.answer.ending
    verdict = _verdict(name, axis, outcome)
    contradicted = outcome.change is not None and name in outcome.change.contradicted
    if causes:
        said = "The motion does not confirm" if contradicted else "The diagnosis found"
        words = page.all_of(in_words(causes[:2]))
        verdict += Markup(" {}: {}.").format(said, words)
    return page.Card(
        axis=name,
        status="good" if ending.good else "open",
        label=ending.spoken,
        verdict=verdict,
        terms=f"{axis.source.spoken} used; {axis.reason}",
        sure=[*_model_sure(name, axis, outcome), *_tracking_sure(name, outcome)],
        part=[escape(numbers.sentence(part)) for part in parts_of(causes)[:3]]
        or [Markup("No part stands out.")],
        action=[
            escape(numbers.sentence(step))
            for step in run_documents.axis_steps(axis, outcome, device)
        ],
        chart=replace(chart, height=page.PICTURE_HEIGHT),
        written=_written(name, outcome),
        table=_changes(name, outcome),
    )


def tracking_of(name: str, outcome: Outcome) -> verification.Tracking | None:
    """What the verification motion measured on an axis, if there was one."""
    return outcome.answer.axes[name].tracking


def _verdict(name: str, axis: AxisIdentification, outcome: Outcome) -> Markup:
    change, tracking = outcome.change, tracking_of(name, outcome)
    if change is None and not axis.consistent:
        said = "The data of this axis contradict themselves. Nothing was written to the board."
    elif change is None:
        said = (
            "This axis is fine. The data of another contradict themselves, so nothing was written "
            "to the board."
        )
    elif change.dry_run:
        return _forecast(name, change)
    elif change.unchanged:
        said = f"{not_worth(change)} Nothing was written to the board."
    elif not change.confirmed:
        said = f"{taken_back(change)} The old gains are in force again."
    elif tracking is None or tracking.verdict == "equal":
        said = "New gains are in force. The axis follows its path as well as before."
    else:
        return Markup("New gains are in force. The error from the path fell {}.").format(
            _fall(name, tracking)
        )
    return Markup(said)


def _fall(name: str, tracking: verification.Tracking) -> Markup:
    """The same sentence as in the terminal, its figures bound to the document."""

    def shown(field: str, value: float) -> str:
        at = ("verification", name, field)
        return str(
            page.number(value, numbers.digits(value, 3), *at)
            if field == "ratio"
            else page.angle(value, *at)
        )

    errors = tracking.before_rad, tracking.after_rad, tracking.count_rad
    return Markup(verification.error_fall(*errors, shown))


def _forecast(name: str, change: verification.GainChange | None) -> Markup:
    """What new gains would be worth to an axis, which were not tried."""
    said = Markup(
        "A trial run: new gains were designed and checked. Nothing was written to the board."
    )
    if change is None or change.promise is None:
        return said
    if not change.promise.worth_a_write:
        return said + f" {not_worth(change)}"
    ((motion, axes),) = change.promise.motions.items()
    at, of_axis = ("promise", name, motion), axes[name]
    if not math.isfinite(of_axis.after.rms.middle_rad):
        return said
    return said + Markup(
        " By the forecast, new gains take the error from the path from {} to {} (rms)."
    ).format(
        page.angle(of_axis.now.rms_rad, *at, "now", "rms_rad"),
        page.angle(of_axis.after.rms.middle_rad, *at, "after", "rms_rad"),
    )


def _written(name: str, outcome: Outcome) -> list[Markup]:
    if outcome.change is None or outcome.change.unchanged or outcome.change.dry_run:
        return [Markup("Nothing.")]
    if not outcome.confirmed:
        return [Markup("Nothing that stays: the new gains were taken back.")]
    by = "two motions" if outcome.change.others else "a motion"
    kept = "They outlast a power cycle." if outcome.stored else "They are lost without power."
    said = [Markup("The new gains below, read back and confirmed by {}. {}").format(by, kept)]
    used = [spoken(of.effect) for of in outcome.designs[name].used]
    if used:
        said.append(Markup("They make up for: {}.").format(page.all_of(used)))
    return said


def _model_sure(name: str, axis: AxisIdentification, outcome: Outcome) -> list[Markup]:
    at = ("identification", "axes", name)
    best = outcome.answer.axes[name].model.estimate
    inertia, std = float(best.parameters[0]), float(best.std[0])
    place = ("answer", "axes", name, "parameters", PARAMETERS[0])
    value_text, std_text = numbers.to_its_std(inertia, std)
    short = f"{outcome.answer.axes[name].sentence}."
    short = short[0].upper() + short[1:]
    return [
        Markup("<b>{}</b>").format(short),
        Markup("The model misses {} of the {}.").format(
            page.percent(axis.metric.relative_residual, *at, "metric", "relative_residual"),
            numbers.effort_word(axis.units[3]),
        ),
        Markup("The inertia is {} ± {} {} (one standard deviation).").format(
            page.number(inertia, value_text, *place, "value"),
            page.number(std, std_text, *place, "std"),
            numbers.unit_text(axis.units[0]),
        ),
    ]


def _tracking_sure(name: str, outcome: Outcome) -> list[Markup]:
    tracking = tracking_of(name, outcome)
    if tracking is None:
        return []
    least = page.angle(tracking.repeatability_rad, "verification", name, "repeatability_rad")
    if not tracking.limited_by_floor:
        return [
            Markup("The motion repeats within {}: a smaller change means nothing.").format(least)
        ]
    of_error = tracking.resolved_rad <= SHARE * tracking.before_rad * (1.0 + 1e-9)
    what = f"{100 * SHARE:.0f} % of the error before" if of_error else "what the encoder resolves"
    return [
        Markup(
            "A change below {}, {}, counts as none; the motion repeats more closely than that."
        ).format(least, what)
    ]


def _changes(name: str, outcome: Outcome) -> Grid | None:
    """Tracking error and the gains of every board, old and new; gains that stay are left out."""
    cells: dict[str, tuple[Markup, Markup]] = {}
    tracking, design = tracking_of(name, outcome), outcome.designs.get(name)
    if tracking is not None:
        at = ("verification", name)
        cells["tracking error, rms"] = (
            page.angle(tracking.before_rad, *at, "tracking_rms_before_rad"),
            page.angle(tracking.after_rad, *at, "tracking_rms_after_rad"),
        )
    if design is not None:
        old, new = asdict(outcome.gains_before[name]), asdict(design.gains)
        cells |= {
            gain_label(gain): (
                page.number(old[gain], numbers.digits(old[gain], 3), "gains_before", name, gain),
                page.number(
                    new[gain], numbers.digits(new[gain], 3), "designs", name, "gains", gain
                ),
            )
            for gain in _FIRST_TERMS
            if new[gain] != old[gain]
        }
    if not cells:
        return None
    before, after = zip(*cells.values(), strict=True)
    last = "new" if outcome.confirmed else "designed"
    rows: list[Row] = [("old", *before), (last, *after)]
    return Grid(f"Old and {last} gains (N·m, rad, s), and how the axis follows", ("", *cells), rows)


# What new gains promised and what was measured, for the page of a run.

_ROOM = 1.3  # factor by which the scale goes beyond the smallest and the largest error
_TRIED = "Cross: measured with the new ones. ◀ marks an rms error above what was promised. "


def notices(outcome: Outcome) -> list[str]:
    """What the reader must not miss, at the top of the page."""
    change = outcome.change
    if change is None:
        return []
    if change.unchanged:
        return [f"{not_worth(change)} Nothing was written; the board has the gains that it had."]
    found = [
        f"The motion does not confirm what was found on axis {axis}: "
        f"{listed(map(spoken, effects))}. Do not adjust the machine on its word."
        for axis, effects in change.contradicted.items()
    ]
    if change.verification is not None and not change.confirmed:
        return [f"{taken_back(change)} The old gains are in force again.", *found]
    return found


def not_worth(change: verification.GainChange) -> str:
    """Why nothing was worth a write, in everyday words."""
    promise = change.promise
    if promise is not None and promise.worse:
        return "New gains would follow worse."
    if promise is not None and promise.best >= WORTH:
        return "New gains promise no more than the forecast itself may be off."
    return "The axes are tuned already: new gains would hardly follow closer."


def taken_back(change: verification.GainChange) -> str:
    """Why new gains were rolled back, in everyday words."""
    if change.in_doubt:
        return "Whether the new gains follow better could not be told."
    verdicts = [of.verdict for of in (change.verification, *change.others.values()) if of]
    if "too lively" in verdicts and "worse" not in verdicts:
        return "The new gains made an axis too lively."
    return "The new gains followed worse."


def promise_picture(promise: Promise) -> page.IntervalPicture | None:
    """Rms errors of every axis and motion; None where a forecast has no end."""
    shown = [1e3 * value for *_, of in promise.every for value in _errors(of)]
    if not all(map(math.isfinite, shown)) or min(shown) <= 0.0:
        return None
    scale = Scale(min(shown) / _ROOM, max(shown) * _ROOM, "log")
    return page.IntervalPicture(
        "promise",
        "Tracking error, rms (mrad)",
        [_line(f"axis {a}, {m}", of, promise.judged, scale) for m, a, of in promise.every],
        (numbers.digits(scale.low, 2), numbers.digits(scale.high, 2)),
        "Dot: measured with the old gains. Bar: promised for the new ones, with its 90 % interval. "
        + (_TRIED if tried(promise) else "The new gains were not tried. ")
        + "The same distance is the same factor everywhere.",
    )


def _errors(of: Promised) -> list[float]:
    measured = [] if of.measured is None else [of.measured.rms_rad]
    return [of.now.rms_rad, of.after.rms.low_rad, of.after.rms.high_rad, *measured]


def _line(name: str, of: Promised, judged: int, scale: Scale) -> page.IntervalRow:
    values = [1e3 * value for value in _errors(of)]
    at = [100.0 * float(scale.fraction(np.array(value))) for value in values]
    now, low, high, *measured = (numbers.digits(value, 3) for value in values)
    said = f"{name}: {now} mrad with the old gains, promised {low} to {high}"
    value = now
    if measured:
        said, value = f"{said}, measured {measured[0]}", f"{now} → {measured[0]}"
    return page.IntervalRow(
        name, value, page.picture("promise", said, *at), of.rms_kept(judged) is False
    )


def peaks_table(separation: Separation) -> Grid:
    """What each motion asked of each axis: as commanded, and the effort as recorded."""
    headings = ("motion, axis", *(f"{name} ({unit})" for name, _, unit in QUANTITIES))
    rows: list[Row] = [
        (f"{made.file}, {axis}", *(f"{of[field]:.3g}" for _, field, _ in QUANTITIES))
        for made in separation.motions
        for axis, of in run_documents.peaks(made).items()
    ]
    return Grid("Peaks: motion as commanded, effort as recorded", headings, rows)

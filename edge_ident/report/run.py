"""What is shown of a run: the answer, parameters and gains, how it was found out, and charts."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

import numpy as np

from edge_ident.commissioning import identification_motions, rounds
from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.separation import Separation
from edge_ident.commissioning.verification import Verification
from edge_ident.errors import DataError
from edge_ident.identification.identify import identify
from edge_ident.identification.result import AxisIdentification
from edge_ident.model.model import Model
from edge_ident.report import chart, findings, gains, numbers, run_documents
from edge_ident.report.identification import identification_parts, identified_charts, model_lines
from edge_ident.report.view import Grid, Line, Part, Parts, next_lines
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording
from edge_ident.support.words import listed, spoken
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Staircase


def outcome_view(outcome: Outcome, device: str | None = None, *, details: bool = False) -> Parts:
    """Trust, gains, model and next step in a few lines; a table of parameters and one of gains.

    Parameters
    ----------
    outcome : Outcome
    device : str, optional
        The board's, as --device names it.
    details : bool
        Every estimator, motion, gain, forecast and measured error below, and all findings.
    """
    rest = (_details if details else _remarks)(outcome)
    return (*_answer(outcome, device), *rest)


def _answer(outcome: Outcome, device: str | None) -> Iterator[Part]:
    ending = outcome.answer.ending
    yield Line(outcome.conclusion, ending.spoken, "good" if ending.good else "bad")
    yield from _known_lines(outcome)
    yield from model_lines(outcome.identification)
    if outcome.early is not None:
        yield Line(outcome.early.sentence, "motion", "strong")
    yield from next_lines(run_documents.run_steps(outcome, device))
    yield numbers.parameter_grid(Model({n: axis.model for n, axis in outcome.answer.axes.items()}))
    if outcome.designs:
        yield _changes(outcome)


def _known_lines(outcome: Outcome) -> Iterator[Line]:
    """Whether the parameters are known, which is another question than whether gains are better."""
    if outcome.answer.known_everywhere:
        yield Line(f"every parameter of {listed(outcome.answer.axes)}", "known", "strong")
        return
    for name, axis in outcome.answer.axes.items():
        yield Line(f"axis {name}, {axis.sentence}", "parameters", "strong")


def old_and_new(outcome: Outcome) -> tuple[list[str], list[AxisGains]]:
    """Gains of every axis, old and new, with their headings."""
    headings = [f"{name}, {when}" for name in outcome.designs for when in ("old", "new")]
    banks = [
        bank
        for name, design in outcome.designs.items()
        for bank in (outcome.gains_before[name], design.gains)
    ]
    return headings, banks


def _changes(outcome: Outcome) -> Grid:
    """Tracking error and gains, old and new, of every axis; what no axis changes is left out."""
    headings, banks = old_and_new(outcome)
    rows = list(_tracking_rows(outcome))
    for row in gains.gain_rows(banks):
        if row.values[::2] != row.values[1::2]:
            rows.append((row.label, *row.cells(4)))
    return Grid(f"gains, in N·m, rad and s; {_in_force(outcome)}", ("", *headings), rows)


def _in_force(outcome: Outcome) -> str:
    if outcome.confirmed:
        return "the new ones are in force"
    return f"the new ones were {'rolled back' if outcome.tried else 'not written'}"


def _tracking_rows(outcome: Outcome) -> Iterator[tuple[str, ...]]:
    """Rms on the motion of the identification: measured, or forecast where none was measured."""
    change = outcome.change
    if change is None:
        return
    if change.verification is not None:
        axes = change.verification.axes
        errors_rad = [(axes[name].before_rad, axes[name].after_rad) for name in outcome.designs]
        label = "tracking error, rms (mrad)"
    elif change.promise is not None:
        first = next(iter(change.promise.motions.values()))
        errors_rad = [
            (first[name].now.rms_rad, first[name].after.rms.middle_rad) for name in outcome.designs
        ]
        label = "tracking error, rms, forecast (mrad)"
    else:
        return
    yield label, *(f"{1e3 * error:.4g}" for pair in errors_rad for error in pair)


def _remarks(outcome: Outcome) -> Iterator[Part]:
    first = outcome.identification.axes
    yield from findings.remarks(
        {
            name: [finding for finding in first[name].findings if not axis.settles(finding)]
            for name, axis in outcome.answer.axes.items()
        }
    )


def _details(outcome: Outcome) -> Iterator[Part]:
    yield from identification_parts(outcome.identification, outcome.timing_ms.get("diagnosis"))
    if outcome.board is not None:
        yield from map(Line, outcome.board.sentences)
    if outcome.separation.ended:
        yield motions_grid(outcome.separation)
    if outcome.designs:
        yield from gains.designs_parts(outcome.designs)
    if outcome.change and outcome.change.verification:
        yield tracking_grid(outcome)
    if outcome.change and outcome.change.promise:
        yield gains.promise_grid(outcome.change.promise)


def tracking_grid(outcome: Outcome) -> Grid:
    """How far each axis is from its path on every motion, with the old gains and the new ones."""
    change = outcome.change
    verifications: Mapping[str, Verification] = {}
    if change is not None and change.verification is not None:
        promise = change.promise
        first = f", {next(iter(promise.motions))}" if promise and promise.motions else ""
        others = {f", {motion}": of for motion, of in change.others.items()}
        verifications = {first: change.verification, **others}
    rows = [
        (
            f"{name}{motion}",
            f"{1e3 * of.before_rad:.3g} mrad",
            f"{1e3 * of.after_rad:.3g} mrad",
            f"{of.ratio:.1f}" if of.after_rad >= of.count_rad else "below a count",
            f"{1e3 * of.repeatability_rad:.2g} mrad",
            of.verdict,
        )
        for motion, verification in verifications.items()
        for name, of in verification.axes.items()
    ]
    headings = "axis, motion", "old gains", "new gains", "smaller by", "no change below", "verdict"
    return Grid("tracking error, rms", headings, rows)


# How it was found out: each identification motion, and what it ruled out.


def kind(made: identification_motions.IdentificationMotion) -> str:
    """What a motion is, in a few words."""
    stairs = any(isinstance(motion, Staircase) for motion in made.trajectory.axes.values())
    shape = "staircase" if stairs else "sum of sines"
    return f"{'designed ' if made.plan else ''}{shape}, {made.duration_s:.0f} s"


def what_for(made: identification_motions.IdentificationMotion) -> str:
    """What a motion was for, in words."""
    asked = _by_axis(run_documents.purpose(made))
    return asked or "the first look"


def what_it_showed(made: identification_motions.IdentificationMotion) -> str:
    """What is known once a motion is recorded, in words."""
    return "; ".join(f"{name}: {_shown(axis)}" for name, axis in made.found.axes.items())


def what_it_ruled_out(made: identification_motions.IdentificationMotion) -> str:
    """Possible causes of before that are none any more, in words."""
    gone = {name: list(map(spoken, effects)) for name, effects in (made.ruled_out or {}).items()}
    return _by_axis(gone)


def motions_grid(separation: Separation) -> Grid:
    """How it was found out: a row for each identification motion."""
    rows = [
        (
            f"{made.file}\n{kind(made)}",
            what_for(made),
            what_it_showed(made),
            what_it_ruled_out(made),
        )
        for made in separation.motions
    ]
    headings = ("motion", "what it was for", "what is known then", "ruled out")
    return Grid("how it was found out", headings, rows, note=separation.ended)


def _by_axis(said: Mapping[str, list[str]]) -> str:
    return "; ".join(f"{name}: {listed(parts)}" for name, parts in said.items() if parts)


def _shown(axis: AxisIdentification) -> str:
    diagnosis = axis.diagnosis
    if diagnosis is None:
        return "the base model is enough"
    parts = []
    for cause in diagnosis.causes:
        rivals = [spoken(other.effect) for other in cause.inseparable]
        parts.append(" or ".join([spoken(cause.term.effect), *rivals]))
    suspected = findings.distinct(spoken(cause.term.effect) for cause in diagnosis.suspected)
    said = [f"{diagnosis.verdict.value}, {listed(findings.distinct(parts)) or 'no cause'}"]
    return ", ".join(said + [f"{name} suspected" for name in suspected])


# Charts of a run: effort and model over time, and tracking error with old and new gains.


_INTERVALS: Final = 150  # the tracking error is drawn as its maximum in each of so many intervals


def tracking_chart(
    key: str, name: str, before: Recording, after: Recording | None
) -> chart.Chart | None:
    """Largest tracking error over time; None where the recording has no reference."""
    layers = [
        layer
        for style, label, recording in (
            ("base", "old gains", before),
            ("extended", "new gains", after),
        )
        if recording is not None and (layer := _largest(style, label, name, recording))
    ]
    if not layers:
        return None
    every = np.concatenate([layer.y for layer in layers])
    peaks = ", ".join(
        f"{layer.label} up to {numbers.digits(1e3 * float(np.max(layer.y)), 3)} mrad"
        for layer in layers
    )
    return chart.Chart(
        key,
        "How far the axis is from its path",
        f"Largest tracking error in {_INTERVALS} intervals of time: {peaks}.",
        ("time", "s"),
        ("tracking error", before.axes[name].position_unit),
        chart.across(np.concatenate([layer.x for layer in layers])),
        chart.Scale(0.6 * float(np.min(every)), 1.3 * float(np.max(every)), "log"),
        tuple(layers),
        caption="Logarithmic scale: from one number to the next, the error is ten times larger.",
    )


def _largest(style: str, label: str, name: str, recording: Recording) -> chart.Layer | None:
    axis = recording.axes.get(name)
    if axis is None or axis.reference is None:
        return None
    error = np.abs(axis.reference - axis.position)
    largest = np.array([np.max(part) for part in np.array_split(error, _INTERVALS)])
    time_s = np.linspace(0.0, recording.time_s[-1] - recording.time_s[0], _INTERVALS)
    seen = largest > 0.0
    return chart.Layer("line", style, time_s[seen], largest[seen], label) if np.any(seen) else None


def run_charts(folder: Path) -> list[list[chart.Chart]]:
    """Effort against model, the residual, and tracking error before and after; a column an axis.

    Parameters
    ----------
    folder : Path
        Holds a capture and, where gains were written, a verification.

    Raises
    ------
    DataError
        There is no capture.
    """
    if not (folder / identification_motions.CAPTURE_FILE).is_file():
        raise DataError(
            f"{folder} has no {identification_motions.CAPTURE_FILE}",
            "give the folder of a run or a capture that came to its end; edge-ident identify reads "
            "a part of a capture",
        )
    before = load_recording(folder / identification_motions.CAPTURE_FILE)
    verification = folder / rounds.VERIFICATION_FILE
    after = load_recording(verification) if verification.is_file() else None
    charts = {}
    for name, axis in identify(before).axes.items():
        tracking = tracking_chart("", name, before, after)
        charts[name] = [*identified_charts("", axis), *([tracking] if tracking else [])]
    return chart.of_axes(charts)

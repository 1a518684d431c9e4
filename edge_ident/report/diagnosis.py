"""What is shown of a diagnosis: the verdict and what to do next, or all that was found."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

from edge_ident.diagnosis import measures, result, wording
from edge_ident.estimation.trust import off_reference
from edge_ident.model.model import PARAMETERS, AxisModel, base_axis
from edge_ident.model.model_files import values_document
from edge_ident.report import error_budget, findings, numbers, view
from edge_ident.report.chart import Chart, of_axes
from edge_ident.report.page import diagnosis_charts
from edge_ident.support import next_step, words
from edge_ident.support.documents import finite
from edge_ident.support.rows import Cell, Table, table_of

TONES: Final[dict[measures.Verdict, view.Tone]] = {
    measures.Verdict.ADEQUATE: "good",
    measures.Verdict.EXPLAINED: "good",
    measures.Verdict.PARTLY_EXPLAINED: "doubt",
    measures.Verdict.UNEXPLAINED: "bad",
}


# The answer: what the model misses, and what to do next; then the parameters.

_NOTHING: Final = "nothing to repair; keep this recording, to compare with later ones"
_ELSEWHERE: Final = (
    "diagnose both recordings together to see in what they differ: edge-ident diagnose FIRST SECOND"
)
_UNKNOWN: Final = (
    f"see where the error is largest: {next_step.PAGE}; check units and sign, and record "
    "several speeds, both ways, over the whole stroke"
)


def diagnosis_answer(
    found: result.Diagnosis, done: next_step.Done = next_step.NOTHING_DONE, *, details: bool = False
) -> view.Parts:
    """Verdict of each axis and next steps in a few lines, a table of parameters, then remarks.

    Parameters
    ----------
    found : Diagnosis
    done : Done, optional
        By the command; next steps are whole then.
    details : bool
        Evidence, alternatives, both models and what could not be tested, below.
    """
    every = (step for name in found.axes for step in _steps(name, found))
    steps = findings.distinct(next_step.whole_step(step, done) for step in every)
    parts: list[view.Part] = []
    for name, axis in found.axes.items():
        off = off_reference(axis.findings)
        parts += [] if off is None else [view.Line(off.message, f"axis {name}", "doubt")]
        parts.append(_verdict(name, axis))
        if not details:  # they say the same, and more
            parts += map(view.below, (*wording.facts(axis), *wording.doubts(axis)))
            parts += error_budget.budget_parts(axis.budget, "  ")
    for name, axis in found.axes.items():
        parts += findings.blocking_lines(name, axis.findings, "no cause is named")
    parts += _validated(found)
    lines = {name: axis.extended.effective for name, axis in found.axes.items()}
    parts += [*view.next_lines(steps or [_NOTHING]), numbers.parameter_grid(found.model, lines)]
    return (*parts, *(diagnosis_parts(found) if details else _remarks(found)))


def _verdict(name: str, axis: result.AxisDiagnosis) -> view.Line:
    return view.Line(wording.verdict_sentence(axis), f"axis {name}", TONES[axis.verdict], " ")


def _validated(found: result.Diagnosis) -> Iterator[view.Line]:
    for name, of_axis in found.validation.items():
        base, extended = wording.percent(of_axis.base), wording.percent(of_axis.extended)
        said = f"axis {name}, the base model leaves {base} and the extended one {extended}"
        yield view.Line(said, "on the recording for validation", "strong")


def _steps(name: str, found: result.Diagnosis) -> Iterator[str]:
    axis = found.axes[name]
    mends = findings.blocking_steps(axis.findings)
    yield from mends
    if (off := off_reference(axis.findings)) is not None:
        yield off.next_step
    yield findings.look_at(name, axis.causes)
    for cause in axis.causes[:1]:
        for other in cause.inseparable[:1]:
            pair = f"{words.spoken(cause.term.effect)} from {words.spoken(other.effect)}"
            yield f"to tell {pair}, record {other.experiment}"
    if not axis.verdict.complete and not mends:
        yield _ELSEWHERE if wording.only_elsewhere(name, found) else _UNKNOWN


def _remarks(found: result.Diagnosis) -> Iterator[view.Line]:
    for finding in found.data_quality:
        yield view.Line(f"axis {finding.axis}: {finding.message}", finding.code, "doubt")
    others = {
        name: tuple(f for f in axis.findings if f is not off_reference(axis.findings))
        for name, axis in found.axes.items()
    }
    yield from findings.remarks(others)


# All of it: evidence, alternatives, both models, and what could not be tested.


def _charts(diagnosis: result.Diagnosis) -> list[list[Chart]]:
    """All of the time, and beside it the part that the causes change most; axis below axis."""
    rows = []
    for name, axis in diagnosis.axes.items():
        parts = (slice(None), diagnosis_charts.busiest(axis))
        for chart in (diagnosis_charts.effort_chart, diagnosis_charts.residual_chart):
            whole, detail = (chart("", axis, part) for part in parts)
            rows += [[*of_axes({name: [whole]})[0], replace(detail, title="detail")]]
    return rows


def diagnosis_parts(diagnosis: result.Diagnosis) -> Iterator[view.Part]:
    """Defects of the data, then each axis: verdict, causes, alternatives, and both models."""
    for finding in diagnosis.data_quality:
        yield view.Line(f"axis {finding.axis}: {finding.message}", finding.code, "doubt", ", ")
    for name in diagnosis.axes:
        yield from axis_parts(name, diagnosis)


def axis_parts(name: str, diagnosis: result.Diagnosis) -> Iterator[view.Part]:
    """All that was found of an axis."""
    axis = diagnosis.axes[name]
    yield _verdict(name, axis)
    yield from map(view.below, wording.facts(axis))
    yield from error_budget.budget_parts(axis.budget, "  ")
    yield from findings.finding_lines(axis.findings)
    if axis.causes:
        yield causes_grid(axis)
    for cause in axis.causes:
        yield from _why(cause, axis)
    yield from map(view.below, wording.not_accepted(axis))
    yield from map(view.below, map(wording.refused_sentence, axis.refused))
    yield models_grid(name, diagnosis)
    beside = " beside the causes" if axis.causes else ""
    for experiment, effects in wording.not_testable(axis).items():
        yield view.Line(f"  not testable{beside}: {', '.join(effects)}; record {experiment}")
    if wording.can_be_planned(axis, len(diagnosis.axes)):
        yield view.Line("  edge-ident plan designs a motion that shows them, from this recording")


def causes_grid(axis: result.AxisDiagnosis) -> view.Grid:
    """A row for each cause."""
    headings = "cause", "reduction of\nheld-out residual", "share of\nthe effort", "parameters"
    rows = [
        (
            words.spoken(cause.term.effect),
            "\n".join(wording.gain(cause)),
            wording.percent(cause.share),
            "\n".join(wording.values(cause.term, axis.model)),
        )
        for cause in axis.causes
    ]
    return view.Grid("", headings, rows, plain=True)


def _why(cause: result.Cause, axis: result.AxisDiagnosis) -> Iterator[view.Line]:
    yield view.Line(f"  {words.spoken(cause.term.effect)}: {cause.evidence}")
    if shown_in := wording.recordings_of(cause, axis):
        yield view.Line(f"    it shows in {shown_in}")
    yield view.Line(f"    accepted: {cause.decision}")
    for alternative in cause.alternatives:
        yield view.Line(f"    {wording.alternative_sentence(alternative)}")


def models_grid(name: str, diagnosis: result.Diagnosis) -> view.Grid:
    """Both models side by side."""
    axis = diagnosis.axes[name]
    models = ("base", "extended") if axis.extends_base else ("base",)
    rows = wording.before_and_after(axis, diagnosis.validation.get(name))
    return view.Grid("", ("", *models), [row[: 1 + len(models)] for row in rows], plain=True)


# A row for each parameter of each cause, as a data frame takes them.

NAMES = (
    "axis", "verdict", "kind", "effect", "parameter", "value", "std", "unit", "share",
    "held_out_gain", "evidence",
)  # fmt: skip


def cause_table(diagnosis: result.Diagnosis) -> Table:
    """Columns of `NAMES`; `kind` is supported, suspected or minor.

    An axis without a cause has one row with its verdict alone.
    """
    return table_of(
        NAMES, (row for name, axis in diagnosis.axes.items() for row in _cause_rows(name, axis))
    )


def _cause_rows(name: str, axis: result.AxisDiagnosis) -> Iterator[tuple[Cell, ...]]:
    if not any(axis.by_kind.values()):
        yield name, axis.verdict.value, *(None,) * (len(NAMES) - 2)
    for kind, causes in axis.by_kind.items():
        for cause in causes:
            for row in numbers.term_rows(cause.term, axis.model.units):
                size = cause.share, cause.held_out_gain, cause.evidence
                yield name, axis.verdict.value, kind, *row, *size


# A JSON document for scripts.


def diagnosis_document(diagnosis: result.Diagnosis, model_file: Path | None) -> dict[str, Any]:
    """The document of schema edge-ident/diagnosis/2; equal diagnoses give equal documents.

    Parameters
    ----------
    diagnosis : Diagnosis
    model_file : Path or None
        Path of the extended model's file, if there is one.
    """
    return {
        "schema": "edge-ident/diagnosis/2",
        "axes": {name: _axis_document(name, diagnosis.axes) for name in diagnosis.axes},
        "data_quality": [asdict(finding) for finding in diagnosis.data_quality],
        "validation": {
            name: _validation_document(validation)
            for name, validation in diagnosis.validation.items()
        }
        or None,
        "model": None if model_file is None else str(model_file),
    }


def _axis_document(name: str, axes: Mapping[str, result.AxisDiagnosis]) -> dict[str, Any]:
    axis = axes[name]
    base, extended = (fit.estimate.parameters for fit in (axis.base, axis.extended))
    return {
        "verdict": axis.verdict.value,
        "explained_share": axis.explained_share,
        "converged": axis.converged,
        "causes": [_cause_document(cause, axis.model) for cause in axis.causes],
        "curves": [curve.document() for curve in axis.curves],
        "suspected": [_cause_document(cause, axis.model) for cause in axis.suspected],
        "minor": [_cause_document(cause, axis.model) for cause in axis.minor],
        "findings": [asdict(found) for found in axis.findings],
        "timing": asdict(axis.timing),
        "band": {"cutoff_hz": axis.cutoff_hz, "share_of_effort_variance": axis.share_in_band},
        "lines": [asdict(line) for line in axis.lines],
        "refused": [{"effect": r.effect, "reason": r.reason} for r in axis.refused],
        "outside_vibrations": [asdict(vibration) for vibration in axis.external_vibrations],
        "not_testable": [asdict(effect) for effect in axis.not_testable],
        "budget": axis.budget.document(),
        "base": _fit_document(axis.base, axis.model),
        "extended": _fit_document(axis.extended, axis.model),
        "noise_floor": axis.noise_floor,
        "noise_floor_source": axis.noise_floor_source,
        "parameters_shift": {
            parameter: {"base": float(base[i]), "extended": float(extended[i])}
            for i, parameter in enumerate(PARAMETERS)
        },
        "residual_whereabouts": diagnosis_charts.explained_variance(name, axes),
        "cutoff_hz": axis.cutoff_hz,
        "knee_hz": axis.knee_hz,
    }


def _cause_document(cause: result.Cause, axis: AxisModel) -> dict[str, Any]:
    source = {} if cause.term.source_axis is None else {"source_axis": cause.term.source_axis}
    return {
        "effect": cause.term.effect,
        **source,
        "parameters": values_document(cause.term, axis),
        "held_out_gain": finite(cause.held_out_gain),
        "held_out_gain_interval": [finite(end) for end in cause.held_out_gain_interval],
        "share": cause.share,
        "rivals": [_alternative_document(alternative, axis) for alternative in cause.alternatives],
        "evidence": cause.evidence,
        "decision": cause.decision,
        "shown_in": list(cause.shown_in),
    }


def _alternative_document(alternative: result.Alternative, axis: AxisModel) -> dict[str, Any]:
    found = alternative.term
    return {
        "effect": alternative.effect,
        "separable": alternative.separable,
        "evidence": alternative.evidence,
        "experiment": alternative.experiment,
        "parameters": None if found is None else values_document(found, axis),
    }


def _fit_document(fit: measures.ModelFit, axis: AxisModel) -> dict[str, Any]:
    base, line = (base_axis(e, *axis.units) for e in (fit.estimate, fit.effective or fit.estimate))
    effective = values_document(line.terms[0], line)
    return {
        "parameters": values_document(base.terms[0], base),
        "effective": {name: effective[name] for name in PARAMETERS[1:]},
        "relative_residual": {"fitted": fit.fitted, "held_out": finite(fit.held_out)},
        "metric": asdict(fit.metric),
        "motion_error": {"rms": fit.motion_error, "unit": axis.position_unit},
    }


def _seen_there(residual: float, friction_anew: float) -> dict[str, float]:
    return {"relative_residual": residual, "relative_residual_with_friction_anew": friction_anew}


def _validation_document(validation: measures.Validation) -> dict[str, Any]:
    return {
        "base": _seen_there(validation.base, validation.friction_anew[0]),
        "extended": _seen_there(validation.extended, validation.friction_anew[1]),
        "as_found": {"relative_residual": validation.as_found},
        "causes": [
            {
                "effect": cause.effect,
                "relative_residual_without": cause.without,
                "gain": cause.gain,
                "gain_interval": cause.interval and [finite(end) for end in cause.interval],
                "carries_over": cause.carries_over,
                "reason": cause.reason,
            }
            for cause in validation.causes
        ],
    }


VIEW: Final = view.ResultView(cause_table, diagnosis_parts, _charts)

"""What is shown of a diagnosis: the verdict and what to do next, or all that was found."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Final

from edge_ident.diagnosis import wording
from edge_ident.diagnosis.error_budget import ErrorBudget
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis, Cause, Diagnosis
from edge_ident.estimation.trust import off_reference
from edge_ident.report.chart import Chart, of_axes
from edge_ident.report.findings import blocking_steps, distinct, finding_lines, look_at, remarks
from edge_ident.report.numbers import parameter_grid, term_rows
from edge_ident.report.page.diagnosis_charts import busiest, effort_chart, residual_chart
from edge_ident.report.view import Answer, Grid, Line, Part, ResultView, Tone, next_lines
from edge_ident.support.next_step import NOTHING_DONE, PAGE, Done, whole_step
from edge_ident.support.rows import Cell, Table, table_of
from edge_ident.support.words import spoken

TONES: Final[dict[Verdict, Tone]] = {
    Verdict.ADEQUATE: "good",
    Verdict.EXPLAINED: "good",
    Verdict.PARTLY_EXPLAINED: "doubt",
    Verdict.UNEXPLAINED: "bad",
}


def diagnosis_view(diagnosis: Diagnosis) -> ResultView:
    """What is shown of a diagnosis."""
    return ResultView(
        partial(cause_table, diagnosis),
        partial(diagnosis_parts, diagnosis),
        partial(_charts, diagnosis),
    )


# The answer: what the model misses, and what to do next; then the parameters.

_NOTHING: Final = "nothing to repair; keep this recording, to compare with later ones"
_ELSEWHERE: Final = (
    "diagnose both recordings together to see in what they differ: edge-ident diagnose FIRST SECOND"
)
_UNKNOWN: Final = (
    f"see where the error is largest: {PAGE}; check units and sign, and record "
    "several speeds, both ways, over the whole stroke"
)


def diagnosis_answer(
    found: Diagnosis, done: Done = NOTHING_DONE, *, details: bool = False
) -> Answer:
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
    steps = distinct(whole_step(step, done) for step in every)
    parts: list[Part] = []
    for name, axis in found.axes.items():
        off = off_reference(axis.findings)
        parts += [] if off is None else [Line(off.message, f"axis {name}", "doubt")]
        said = wording.diagnosed_sentence(axis)
        parts.append(Line(said, f"axis {name}", TONES[axis.verdict], " "))
        parts += [] if details else budget_parts(axis.budget, "  ")
    parts += [*_forbidden(found), *_validated(found)]
    lines = {name: axis.extended.effective for name, axis in found.axes.items()}
    parts += [*next_lines(steps or [_NOTHING]), parameter_grid(found.model, lines)]
    return Answer((*parts, *(diagnosis_parts(found) if details else _remarks(found))))


def _forbidden(found: Diagnosis) -> Iterator[Line]:
    for name, axis in found.axes.items():
        for finding in axis.findings:
            if finding.blocks:
                said = f"axis {name}, {finding.code}: {finding.message}"
                yield Line(said, "no cause is named", "bad")


def _validated(found: Diagnosis) -> Iterator[Line]:
    for name, of_axis in found.validation.items():
        base, extended = wording.percent(of_axis.base), wording.percent(of_axis.extended)
        said = f"axis {name}, the base model leaves {base} and the extended one {extended}"
        yield Line(said, "on the recording for validation", "strong")


def _steps(name: str, found: Diagnosis) -> Iterator[str]:
    axis = found.axes[name]
    mends = blocking_steps(axis.findings)
    yield from mends
    if (off := off_reference(axis.findings)) is not None:
        yield off.next_step
    yield look_at(name, axis.causes)
    for cause in axis.causes[:1]:
        for other in cause.inseparable[:1]:
            pair = f"{spoken(cause.term.effect)} from {spoken(other.effect)}"
            yield f"to tell {pair}, record {other.experiment}"
    if not axis.verdict.complete and not mends:
        yield _ELSEWHERE if wording.only_elsewhere(name, found) else _UNKNOWN


def _remarks(found: Diagnosis) -> Iterator[Line]:
    for finding in found.data_quality:
        yield Line(f"axis {finding.axis}: {finding.message}", finding.code, "doubt")
    others = {
        name: tuple(f for f in axis.findings if f is not off_reference(axis.findings))
        for name, axis in found.axes.items()
    }
    yield from remarks(others)


# All of it: evidence, alternatives, both models, and what could not be tested.


def _charts(diagnosis: Diagnosis) -> list[list[Chart]]:
    """All of the time, and beside it the part that the causes change most; axis below axis."""
    rows = []
    for name, axis in diagnosis.axes.items():
        parts = (slice(None), busiest(axis))
        for chart in (effort_chart, residual_chart):
            whole, detail = (chart("", axis, part) for part in parts)
            rows += [[*of_axes({name: [whole]})[0], replace(detail, title="detail")]]
    return rows


def diagnosis_parts(diagnosis: Diagnosis) -> Iterator[Part]:
    """Defects of the data, then each axis: verdict, causes, alternatives, and both models."""
    for finding in diagnosis.data_quality:
        yield Line(f"axis {finding.axis}: {finding.message}", finding.code, "doubt", ", ")
    for name in diagnosis.axes:
        yield from axis_parts(name, diagnosis)


def axis_parts(name: str, diagnosis: Diagnosis) -> Iterator[Part]:
    """All that was found of an axis."""
    axis = diagnosis.axes[name]
    yield Line(wording.verdict_sentence(axis), f"axis {name}", TONES[axis.verdict], " ")
    yield from budget_parts(axis.budget, "  ")
    yield from finding_lines(axis.findings)
    if axis.causes:
        yield causes_grid(axis)
    for cause in axis.causes:
        yield from _why(cause, axis)
    yield from (Line(f"  {sentence}") for sentence in wording.not_accepted(axis))
    yield from (Line(f"  {wording.refused_sentence(refused)}") for refused in axis.refused)
    yield models_grid(name, diagnosis)
    beside = " beside the causes" if axis.causes else ""
    for experiment, effects in wording.not_testable(axis).items():
        yield Line(f"  not testable{beside}: {', '.join(effects)}; record {experiment}")
    if wording.can_be_planned(axis, len(diagnosis.axes)):
        yield Line("  edge-ident plan designs a motion that shows them, from this recording")


def causes_grid(axis: AxisDiagnosis) -> Grid:
    """A row for each cause."""
    headings = "cause", "reduction of\nheld-out residual", "share of\nthe effort", "parameters"
    rows = [
        (
            spoken(cause.term.effect),
            "\n".join(wording.gain(cause)),
            wording.percent(cause.share),
            "\n".join(wording.values(cause.term, axis.model)),
        )
        for cause in axis.causes
    ]
    return Grid("", headings, rows, plain=True)


def _why(cause: Cause, axis: AxisDiagnosis) -> Iterator[Line]:
    yield Line(f"  {spoken(cause.term.effect)}: {cause.evidence}")
    if shown_in := wording.recordings_of(cause, axis):
        yield Line(f"    it shows in {shown_in}")
    yield Line(f"    accepted: {cause.decision}")
    for alternative in cause.alternatives:
        yield Line(f"    {wording.alternative_sentence(alternative)}")


def models_grid(name: str, diagnosis: Diagnosis) -> Grid:
    """Both models side by side."""
    axis = diagnosis.axes[name]
    models = ("base", "extended") if axis.extends_base else ("base",)
    rows = wording.before_and_after(axis, diagnosis.validation.get(name))
    return Grid("", ("", *models), [row[: 1 + len(models)] for row in rows], plain=True)


def budget_parts(budget: ErrorBudget, title: str = "") -> Iterator[Part]:
    """A budget: one sentence, and its table."""
    yield Line(title + budget.sentence)
    headings = "of this, along", "share", "effort rms", "curve beyond the base model"
    yield Grid("", headings, budget.rows, plain=True)


# A row for each parameter of each cause, as a data frame takes them.

NAMES = (
    "axis", "verdict", "kind", "effect", "parameter", "value", "std", "unit", "share",
    "held_out_gain", "evidence",
)  # fmt: skip


def cause_table(diagnosis: Diagnosis) -> Table:
    """Columns of `NAMES`; `kind` is supported, suspected or minor.

    An axis without a cause has one row with its verdict alone.
    """
    return table_of(
        NAMES, (row for name, axis in diagnosis.axes.items() for row in _cause_rows(name, axis))
    )


def _cause_rows(name: str, axis: AxisDiagnosis) -> Iterator[tuple[Cell, ...]]:
    kinds = {"supported": axis.causes, "suspected": axis.suspected, "minor": axis.minor}
    if not any(kinds.values()):
        yield name, axis.verdict.value, *(None,) * (len(NAMES) - 2)
    for kind, causes in kinds.items():
        for cause in causes:
            for row in term_rows(cause.term, axis.model.units):
                size = cause.share, cause.held_out_gain, cause.evidence
                yield name, axis.verdict.value, kind, *row, *size

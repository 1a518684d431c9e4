"""A diagnosis as tables for a person, by rich."""

from collections.abc import Iterable, Iterator
from functools import partial
from typing import Final

from rich.console import RenderableType
from rich.markup import escape
from rich.text import Text

from edge_ident.diagnosis import wording
from edge_ident.diagnosis.error_budget import budget_lines
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis, Cause, Diagnosis
from edge_ident.estimation.trust import Finding
from edge_ident.report.diagnosis_figure import diagnosis_figure
from edge_ident.report.result_tables import term_rows
from edge_ident.report.view import ResultView
from edge_ident.support.console import FittingTable, plain_table
from edge_ident.support.rows import Cell, Table, table_of
from edge_ident.support.words import spoken

VERDICT_COLOUR: Final = {
    Verdict.ADEQUATE: "green",
    Verdict.EXPLAINED: "green",
    Verdict.PARTLY_EXPLAINED: "yellow",
    Verdict.UNEXPLAINED: "red",
}


def diagnosis_view(diagnosis: Diagnosis) -> ResultView:
    """What is shown of a diagnosis."""
    return ResultView(
        partial(cause_table, diagnosis),
        partial(diagnosis_parts, diagnosis),
        partial(diagnosis_figure, diagnosis),
    )


def diagnosis_parts(diagnosis: Diagnosis) -> Iterator[RenderableType]:
    """Defects of the data, then each axis: verdict, causes, alternatives, and both models."""
    findings = (
        _line(f"[yellow]{finding.code}[/], {escape(f'axis {finding.axis}: {finding.message}')}")
        for finding in diagnosis.data_quality
    )
    yield from findings
    for name in diagnosis.axes:
        yield from _axis(name, diagnosis)


def _axis(name: str, diagnosis: Diagnosis) -> Iterator[RenderableType]:
    axis = diagnosis.axes[name]
    sentence = escape(wording.verdict_sentence(axis))
    yield _line(f"[bold]axis {escape(name)}[/] [{VERDICT_COLOUR[axis.verdict]}]{sentence}[/]")
    yield from budget_lines(axis.budget, "  ")
    yield from finding_lines(axis.findings)
    if axis.causes:
        yield _causes_table(axis)
    for cause in axis.causes:
        yield from _why(cause, axis)
    for sentence in wording.not_accepted(axis):
        yield Text(f"  {sentence}")
    for refused in axis.refused:
        yield Text(f"  {wording.refused_sentence(refused)}")
    yield _comparison_table(name, diagnosis)
    beside = " beside the causes" if axis.causes else ""
    for experiment, effects in wording.not_testable(axis).items():
        yield Text(f"  not testable{beside}: {', '.join(effects)}; record {experiment}")
    if wording.can_be_planned(axis, len(diagnosis.axes)):
        yield Text("  edge-ident plan designs a motion that shows them, from this recording")


def _causes_table(axis: AxisDiagnosis) -> FittingTable:
    table = plain_table()
    table.add_column("cause")
    table.add_column("reduction of\nheld-out residual", justify="right")
    table.add_column("share of\nthe effort", justify="right")
    table.add_column("parameters")
    for cause in axis.causes:
        table.add_row(
            spoken(cause.term.effect),
            "\n".join(wording.gain(cause)),
            wording.percent(cause.share),
            "\n".join(wording.values(cause.term, axis.model)),
        )
    return table


def _why(cause: Cause, axis: AxisDiagnosis) -> Iterator[Text]:
    yield Text(f"  {spoken(cause.term.effect)}: {cause.evidence}")
    if shown_in := wording.recordings_of(cause, axis):
        yield Text(f"    it shows in {shown_in}")
    yield Text(f"    accepted: {cause.decision}")
    for alternative in cause.alternatives:
        yield Text(f"    {wording.alternative_sentence(alternative)}")


def _comparison_table(name: str, diagnosis: Diagnosis) -> FittingTable:
    axis = diagnosis.axes[name]
    models = ("base", "extended") if axis.extends_base else ("base",)
    table = plain_table()
    table.add_column("")
    for model in models:
        table.add_column(model, justify="right")
    for label, *cells in wording.before_and_after(axis, diagnosis.validation.get(name)):
        table.add_row(label, *cells[: len(models)])
    return table


def _line(markup: str) -> Text:
    return Text.from_markup(markup)


# Findings for a person, by rich.


def finding_lines(findings: Iterable[Finding]) -> Iterator[Text]:
    """Each finding with its next step; red where it blocks."""
    for finding in findings:
        colour = "red" if finding.blocks else "yellow"
        yield Text.from_markup(f"  [{colour}]{finding.code}[/]: {escape(finding.message)}")
        yield Text(f"    next: {finding.next_step}")


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

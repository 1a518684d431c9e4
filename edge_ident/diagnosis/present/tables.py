"""A diagnosis as tables for a person, by rich."""

from typing import Final

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from edge_ident.diagnosis.present import wording
from edge_ident.diagnosis.result import AxisDiagnosis, Cause, Diagnosis, Verdict

_console = Console(highlight=False)
_COLOUR: Final = {
    Verdict.ADEQUATE: "green",
    Verdict.EXPLAINED: "green",
    Verdict.UNEXPLAINED: "red",
}


def print_diagnosis(diagnosis: Diagnosis) -> None:
    """Print defects of the data, then each axis: verdict, causes, alternatives, and both models."""
    for finding in diagnosis.data_quality:
        _say(f"[yellow]{finding.code}[/], axis {finding.axis}: {escape(finding.message)}")
    for name, axis in diagnosis.axes.items():
        sentence = escape(wording.verdict_sentence(axis))
        _say(f"[bold]axis {name}[/] [{_COLOUR[axis.verdict]}]{sentence}[/]")
        if axis.causes:
            _console.print(_causes_table(axis))
        for cause in axis.causes:
            _say_why(cause)
        for refused in axis.refused:
            _say(f"  {escape(wording.refused_sentence(refused))}")
        _console.print(_comparison_table(name, diagnosis))
        for experiment, effects in wording.not_testable(axis).items():
            _say(f"  not testable: {', '.join(effects)}; record {escape(experiment)}")


def _causes_table(axis: AxisDiagnosis) -> Table:
    table = _table()
    table.add_column("cause")
    table.add_column("reduction of\nheld-out residual", justify="right", no_wrap=True)
    table.add_column("share of\nthe effort", justify="right")
    table.add_column("parameters", no_wrap=True)
    for cause in axis.causes:
        table.add_row(
            wording.spoken(cause.term.effect),
            "\n".join(wording.gain(cause)),
            wording.percent(cause.share),
            "\n".join(wording.values(cause.term, axis.model)),
        )
    return table


def _say_why(cause: Cause) -> None:
    _say(f"  {wording.spoken(cause.term.effect)}: {escape(cause.evidence)}")
    _say(f"    accepted: {escape(cause.decision)}")
    for alternative in cause.alternatives:
        _say(f"    {escape(wording.alternative_sentence(alternative))}")


def _comparison_table(name: str, diagnosis: Diagnosis) -> Table:
    axis = diagnosis.axes[name]
    models = ("base", "extended") if axis.causes else ("base",)
    table = _table()
    table.add_column("", no_wrap=True)
    for model in models:
        table.add_column(model, justify="right", no_wrap=True)
    for label, *cells in wording.before_and_after(axis, diagnosis.validation.get(name)):
        table.add_row(label, *cells[: len(models)])
    return table


def _say(text: str) -> None:
    """Print one sentence; only the terminal breaks it."""
    _console.print(text, soft_wrap=True)


def _table() -> Table:
    return Table(box=SIMPLE_HEAD, padding=(0, 2, 0, 0), pad_edge=False)

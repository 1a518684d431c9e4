"""A run for a person, by rich: the answer, the parameters, the gains; the rest on request."""

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.separation import Separation
from edge_ident.commissioning.verification import GainChange, Verification
from edge_ident.model.model import Model
from edge_ident.report.answer import (
    designs_parts,
    identification_parts,
    model_lines,
    parameter_table,
    remarks,
)
from edge_ident.report.gain_report import promise_view
from edge_ident.report.gain_rows import gain_rows
from edge_ident.report.output import labelled, next_lines
from edge_ident.report.run_documents import run_steps
from edge_ident.report.run_motions import kind, what_for, what_it_ruled_out, what_it_showed
from edge_ident.support.console import FittingTable
from edge_ident.support.words import listed


def outcome_view(outcome: Outcome, device: str | None = None, *, details: bool = False) -> Group:
    """Trust, gains, model and next step in a few lines; a table of parameters and one of gains.

    Parameters
    ----------
    outcome : Outcome
    device : str, optional
        The board's, as --device names it.
    details : bool
        Every estimator, motion, gain, forecast and measured error below, and all findings.
    """
    return Group(*_answer(outcome, device), *(_details if details else _remarks)(outcome))


def _answer(outcome: Outcome, device: str | None) -> Iterator[RenderableType]:
    ending = outcome.answer.ending
    yield labelled(ending.spoken, outcome.conclusion, "bold green" if ending.good else "bold red")
    yield from _known_lines(outcome)
    yield from model_lines(outcome.identification)
    if outcome.early is not None:
        yield labelled("motion", outcome.early.sentence)
    yield from next_lines(run_steps(outcome, device))
    yield parameter_table(Model({n: axis.model for n, axis in outcome.answer.axes.items()}))
    if outcome.designs:
        yield _old_and_new(outcome)


def _known_lines(outcome: Outcome) -> Iterator[Text]:
    """Whether the parameters are known, which is another question than whether gains are better."""
    if outcome.answer.known_everywhere:
        yield labelled("known", f"every parameter of {listed(outcome.answer.axes)}")
        return
    for name, axis in outcome.answer.axes.items():
        yield labelled("parameters", f"axis {name}, {axis.sentence}")


def _old_and_new(outcome: Outcome) -> FittingTable:
    """Tracking error and gains, old and new, of every axis; what no axis changes is left out."""
    table = FittingTable(title=f"gains, in N·m, rad and s; {_in_force(outcome)}")
    table.title_justify = "left"
    table.add_column("")
    for name in outcome.designs:
        for when in ("old", "new"):
            table.add_column(escape(f"{name}, {when}"), justify="right")
    for label, cells in _tracking_rows(outcome):
        table.add_row(label, *cells)
    banks = [
        bank
        for name, design in outcome.designs.items()
        for bank in (outcome.gains_before[name], design.gains)
    ]
    for row in gain_rows(banks):
        if row.values[::2] != row.values[1::2]:
            table.add_row(row.label, *row.cells(4))
    return table


def _in_force(outcome: Outcome) -> str:
    if outcome.confirmed:
        return "the new ones are in force"
    tried = outcome.change is not None and outcome.change.verification is not None
    return f"the new ones were {'rolled back' if tried else 'not written'}"


def _tracking_rows(outcome: Outcome) -> Iterator[tuple[str, list[str]]]:
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
    yield label, [f"{1e3 * error:.4g}" for pair in errors_rad for error in pair]


def _remarks(outcome: Outcome) -> Iterator[RenderableType]:
    first = outcome.identification.axes
    yield from remarks(
        {
            name: [finding for finding in first[name].findings if not axis.settles(finding)]
            for name, axis in outcome.answer.axes.items()
        }
    )


def _details(outcome: Outcome) -> Iterator[RenderableType]:
    yield from identification_parts(outcome.identification, outcome.timing_ms.get("diagnosis"))
    if outcome.board is not None:
        yield from map(Text, outcome.board.sentences)
    if outcome.separation.ended:
        yield _motions_table(outcome.separation)
    if outcome.designs:
        yield from designs_parts(outcome.designs)
    change: GainChange | None = outcome.change
    if change and change.verification:
        yield _tracking_table(change.verification)
    if change and change.promise:
        yield promise_view(change.promise)


def _motions_table(separation: Separation) -> FittingTable:
    """How it was found out."""
    table = FittingTable(title="how it was found out", title_justify="left")
    for heading in ("motion", "what it was for", "what is known then", "ruled out"):
        table.add_column(heading)
    for made in separation.motions:
        cells = (what_for(made), what_it_showed(made), what_it_ruled_out(made))
        table.add_row(*map(escape, (f"{made.file}\n{kind(made)}", *cells)))
    table.caption, table.caption_justify = separation.ended, "left"
    return table


def _tracking_table(verification: Verification) -> FittingTable:
    table = FittingTable(title="tracking error, rms", title_justify="left")
    for heading in ("axis", "before", "after", "smaller by", "no change below"):
        table.add_column(heading, justify="right")
    for axis, tracking in verification.axes.items():
        table.add_row(
            escape(axis),
            f"{1e3 * tracking.before_rad:.2f} mrad",
            f"{1e3 * tracking.after_rad:.2f} mrad",
            f"{tracking.ratio:.1f}"
            if tracking.after_rad >= tracking.count_rad
            else "below a count",
            f"{1e3 * tracking.repeatability_rad:.2f} mrad",
        )
    return table

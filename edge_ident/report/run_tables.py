"""A run for a person: the answer, the parameters, the gains; the rest on request."""

from collections.abc import Iterator, Mapping

from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.verification import Verification
from edge_ident.model.model import Model
from edge_ident.report.findings import remarks
from edge_ident.report.gain_report import promise_grid
from edge_ident.report.gain_rows import designs_parts, gain_rows
from edge_ident.report.identification import identification_parts, model_lines
from edge_ident.report.numbers import parameter_grid
from edge_ident.report.run_documents import run_steps
from edge_ident.report.run_motions import motions_grid
from edge_ident.report.view import Answer, Grid, Line, Part, next_lines
from edge_ident.support.words import listed
from firmware_interface.gains import AxisGains


def outcome_view(outcome: Outcome, device: str | None = None, *, details: bool = False) -> Answer:
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
    return Answer((*_answer(outcome, device), *rest))


def _answer(outcome: Outcome, device: str | None) -> Iterator[Part]:
    ending = outcome.answer.ending
    yield Line(outcome.conclusion, ending.spoken, "good" if ending.good else "bad")
    yield from _known_lines(outcome)
    yield from model_lines(outcome.identification)
    if outcome.early is not None:
        yield Line(outcome.early.sentence, "motion", "strong")
    yield from next_lines(run_steps(outcome, device))
    yield parameter_grid(Model({n: axis.model for n, axis in outcome.answer.axes.items()}))
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
    for row in gain_rows(banks):
        if row.values[::2] != row.values[1::2]:
            rows.append((row.label, *row.cells(4)))
    return Grid(f"gains, in N·m, rad and s; {_in_force(outcome)}", ("", *headings), rows)


def _in_force(outcome: Outcome) -> str:
    if outcome.confirmed:
        return "the new ones are in force"
    tried = outcome.change is not None and outcome.change.verification is not None
    return f"the new ones were {'rolled back' if tried else 'not written'}"


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
    yield from remarks(
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
        yield from designs_parts(outcome.designs)
    if outcome.change and outcome.change.verification:
        yield tracking_grid(outcome)
    if outcome.change and outcome.change.promise:
        yield promise_grid(outcome.change.promise)


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

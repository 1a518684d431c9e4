"""The answer of an identification or a diagnosis, by rich: may it be trusted, what does the model
miss, what to do next; then tables of its parameters.
"""

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from edge_ident.diagnosis.error_budget import budget_lines
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.diagnosis.wording import (
    only_elsewhere,
    percent,
    timing_sentence,
    values,
    verdict_sentence,
)
from edge_ident.estimation.trust import Finding, off_reference
from edge_ident.identification.result import (
    AxisIdentification,
    Identification,
    ParameterSource,
    known_sentence,
)
from edge_ident.model.model import PARAMETERS, AxisModel, Estimate, Model
from edge_ident.model.model_files import values_document
from edge_ident.report.diagnosis_tables import VERDICT_COLOUR, diagnosis_parts, finding_lines
from edge_ident.report.effort_figure import effort_figure
from edge_ident.report.gain_rows import designs_table, gain_rows, loop_figure
from edge_ident.report.intervals import EFFECTIVE, interval_texts
from edge_ident.report.next_steps import (
    DESIGN_GAINS,
    OF_MODEL,
    blocking_steps,
    distinct,
    identification_steps,
    look_at,
)
from edge_ident.report.output import labelled, next_lines
from edge_ident.report.result_tables import identification_table
from edge_ident.report.view import ResultView
from edge_ident.support.console import FittingTable
from edge_ident.support.next_step import NOTHING_DONE, PAGE, Done, whole_step
from edge_ident.support.words import listed, spoken, with_deviation

if TYPE_CHECKING:
    from edge_ident.control.drive_gains import GainDesigns
    from edge_ident.control.gain_design import GainDesign


# The answer of an identification: may it be trusted, what the model misses, what to do next.
#
# These few lines come first; one table of parameters and the remarks follow.


def identification_answer(
    found: Identification,
    done: Done = NOTHING_DONE,
    *,
    details: bool = False,
    without_findings: str = DESIGN_GAINS,
) -> Group:
    """Trust, model and next step in a few lines, then one table of parameters, then remarks.

    Parameters
    ----------
    found : Identification
    done : Done, optional
        By the command; next steps are whole then.
    details : bool
        Every estimator beside the others, with measures, timing and all findings, below.
    without_findings : str
        What to do next where no finding asks for anything.
    """
    steps = identification_steps(found) or [without_findings]
    parts: list[RenderableType] = [
        *trust_lines(found),
        *model_lines(found),
        *_budgets(found),
        *next_lines(whole_step(step, done) for step in steps),
        parameter_table(found.model, {name: axis.line for name, axis in found.axes.items()}),
    ]
    rest = identification_parts(found) if details else identification_remarks(found)
    return Group(*parts, *rest)


def _budgets(found: Identification) -> Iterator["RenderableType"]:
    """Where the effort lies that the base model misses, of axes that were diagnosed."""
    for name, axis in found.axes.items():
        if axis.budget is not None:
            yield from budget_lines(axis.budget, f"axis {name}: ")


def identification_remarks(found: Identification) -> Iterator[Text]:
    """What else there is to know of a recording."""
    return remarks({name: axis.findings for name, axis in found.axes.items()})


def trusted_line(names: Iterable[str]) -> Text:
    """Axes whose parameters may be used."""
    return labelled("trusted", f"the parameters of {listed(names)}", "bold green")


def distrusted_line(said: str) -> Text:
    """What may not be used, and why."""
    return labelled("not trusted", said, "bold red")


def trust_lines(found: Identification) -> Iterator[Text]:
    """What speaks against an axis, a line for each, and what of it is known nevertheless; then the
    axes that are trusted."""
    for name, axis in found.axes.items():
        for finding in axis.findings:
            if finding.blocks:
                yield distrusted_line(f"axis {name}, {finding.code}: {finding.message}")
        known = dict(zip(PARAMETERS, axis.effective_known, strict=True))
        if not axis.trusted and any(known.values()):
            unknown = [parameter for parameter, sure in known.items() if not sure]
            sentence = known_sentence([one for one in known if known[one]], unknown)
            yield labelled("axis " + name, sentence)
    if trusted := [name for name, axis in found.axes.items() if axis.trusted]:
        yield trusted_line(trusted)


def model_lines(found: Identification) -> Iterator[Text]:
    """What the model misses, a line for each axis; where it is enough, one line for all."""
    enough: dict[str, list[str]] = {}
    for name, axis in found.axes.items():
        if axis.diagnosis is None and axis.adequacy.adequate:
            enough.setdefault(_enough(axis), []).append(name)
        else:
            yield labelled("model", f"axis {name} {model_sentence(axis)}")
    for said, names in enough.items():
        lowest_hz = min(found.axes[name].adequacy.cutoff_hz for name in names)
        axes = "axis" if len(names) == 1 else "axes"
        where = f"on {axes} {listed(names)}, compared up to {lowest_hz:.3g} Hz"
        yield labelled("model", f"{said} {where}")


def _enough(axis: AxisIdentification) -> str:
    model = ["rigid body", "friction", *map(spoken, axis.compensated_effects)]
    return f"{listed(model)} are enough"


def model_sentence(axis: AxisIdentification) -> str:
    """What the model of an axis misses; the axis is named before."""
    if axis.diagnosis is not None:
        return diagnosed_sentence(axis.diagnosis)
    if axis.adequacy.adequate:
        return ""
    return f"is not diagnosed: {axis.adequacy.reason}"


def diagnosed_sentence(axis: "AxisDiagnosis") -> str:
    """The verdict, what the recordings do not tell from its causes, and what is suspected."""
    said = [verdict_sentence(axis)]
    for cause in axis.causes:
        if others := [spoken(other.effect) for other in cause.inseparable]:
            this = spoken(cause.term.effect)
            said.append(f"the recordings do not tell {this} from {listed(others)}")
    if suspected := [spoken(cause.term.effect) for cause in axis.suspected]:
        said.append(f"suspected only: {listed(dict.fromkeys(suspected))}")
    return "; ".join(dict.fromkeys(said))  # two orders of ripple may have the same rivals


def remarks(findings: Mapping[str, Iterable[Finding]]) -> Iterator[Text]:
    """Findings by axis that block nothing and were not said yet, each code once.

    Parameters
    ----------
    findings : mapping of axis name to iterable of Finding
    """
    seen: dict[str, tuple[Finding, list[str]]] = {}
    for name, of_axis in findings.items():
        for finding in of_axis:
            if not finding.blocks and finding.code not in OF_MODEL:
                seen.setdefault(finding.code, (finding, []))[1].append(name)
    for code, (finding, (first, *others)) in seen.items():
        alike = f"; likewise on {listed(others)}" if others else ""
        said = f"axis {first}: {finding.message}{alike}. Next: {finding.next_step}"
        yield labelled(code, said, "yellow")


# The answer of a diagnosis: what the model misses, and what to do next; then the parameters.

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
) -> Group:
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
    parts: list[RenderableType] = []
    for name, axis in found.axes.items():
        off = off_reference(axis.findings)
        parts += [] if off is None else [labelled(f"axis {name}", off.message, "bold yellow")]
        parts += [_verdict(name, axis), *([] if details else budget_lines(axis.budget, "  "))]
    parts += [*_forbidden(found), *_validated(found)]
    lines = {name: axis.extended.effective for name, axis in found.axes.items()}
    parts += [*next_lines(steps or [_NOTHING]), parameter_table(found.model, lines)]
    return Group(*parts, *(diagnosis_parts(found) if details else _remarks(found)))


def _verdict(name: str, axis: AxisDiagnosis) -> Text:
    colour = VERDICT_COLOUR[axis.verdict]
    return Text.assemble((f"axis {name}", "bold"), " ", (diagnosed_sentence(axis), colour))


def _forbidden(found: Diagnosis) -> Iterator[Text]:
    for name, axis in found.axes.items():
        for finding in axis.findings:
            if finding.blocks:
                said = f"axis {name}, {finding.code}: {finding.message}"
                yield labelled("no cause is named", said, "bold red")


def _validated(found: Diagnosis) -> Iterator[Text]:
    for name, of_axis in found.validation.items():
        base, extended = percent(of_axis.base), percent(of_axis.extended)
        said = f"axis {name}, the base model leaves {base} and the extended one {extended}"
        yield labelled("on the recording for validation", said)


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
        yield _ELSEWHERE if only_elsewhere(name, found) else _UNKNOWN


def _remarks(found: Diagnosis) -> Iterator[Text]:
    for finding in found.data_quality:
        yield labelled(finding.code, f"axis {finding.axis}: {finding.message}", "yellow")
    others = {
        name: tuple(f for f in axis.findings if f is not off_reference(axis.findings))
        for name, axis in found.axes.items()
    }
    yield from remarks(others)


# An identification and designed gains as tables, by rich.


def identification_view(found: Identification) -> ResultView:
    """What is shown of an identification."""
    return ResultView(
        partial(identification_table, found),
        partial(identification_parts, found),
        partial(effort_figure, found),
    )


def identification_parts(
    identification: Identification, diagnosis_ms: float | None = None
) -> Iterator[RenderableType]:
    """One table per axis, whether it is trusted, and the warnings with their next steps.

    Parameters
    ----------
    identification : Identification
    diagnosis_ms : float, optional
        Of all diagnoses behind it, in ms; by default the time of its own.
    """
    for name, axis in identification.axes.items():
        yield from _axis(name, axis)
    own_ms = identification.timing_ms.get("diagnosis", 0.0)
    said = f"identified in {identification.timing_ms['total'] - own_ms:.0f} ms"
    if spent_ms := own_ms if diagnosis_ms is None else diagnosis_ms:
        said += f", diagnosed in {1e-3 * spent_ms:.1f} s"
    yield Text(said)


def _axis(name: str, axis: AxisIdentification) -> Iterator[RenderableType]:
    yield _parameter_table(name, axis)
    blocking = ", ".join(finding.code for finding in axis.findings if finding.blocks)
    verdict = "[green]trusted[/]" if axis.trusted else f"[red]not trusted: {blocking}[/]"
    yield Text.from_markup(f"  {verdict}; {axis.source.spoken} used: {escape(axis.reason)}")
    yield Text(
        f"  relative residual {axis.metric.relative_residual:.2%} of all samples, "
        f"fit {axis.metric.fit:.3f}, time-spectral {axis.metric.time_spectral:.4f}"
    )
    if not any(finding.message.startswith(axis.adequacy.reason) for finding in axis.findings):
        yield Text(f"  {axis.adequacy.reason}")
    yield Text(f"  {timing_sentence(axis.timing)}")
    if axis.compensated_effects:
        yield Text(f"  compensated effects: {', '.join(axis.compensated_effects)}")
    for term in axis.model.terms[1:]:
        yield Text(f"    {term.effect}: {', '.join(values(term, axis.model))}")
    if axis.network is None:
        yield Text(f"  network: {axis.network_reason}")
    yield from finding_lines(axis.findings)


def _parameter_table(name: str, axis: AxisIdentification) -> FittingTable:
    """One column for each estimate, the one that is used first."""
    columns: dict[ParameterSource, Estimate | None] = {
        axis.source: axis.estimate,
        ParameterSource.LEAST_SQUARES: axis.least_squares,
        ParameterSource.NETWORK: axis.network,
    }
    columns[axis.source] = axis.estimate
    table = FittingTable(title=escape(f"axis {name}"), title_justify="left")
    table.add_column("parameter")
    for source in columns:
        heading = source.spoken + (" (used)" if source is axis.source else "")
        table.add_column(heading, justify="right")
    table.add_column("unit")
    for i, parameter in enumerate(PARAMETERS):
        cells = ("–" if estimate is None else _value(estimate, i) for estimate in columns.values())
        table.add_row(parameter.replace("_", " "), *cells, axis.units[i])
    if axis.line is not None:
        for i, parameter in enumerate(PARAMETERS[1:], 1):
            rest = ["–"] * (len(columns) - 1)
            label = f"effective {spoken(parameter)}"
            table.add_row(label, _value(axis.line, i), *rest, axis.units[i])
    return table


def _value(estimate: Estimate, index: int) -> str:
    return with_deviation(float(estimate.parameters[index]), float(estimate.std[index]))


def designs_view(designs: "GainDesigns") -> ResultView:
    """What is shown of designed gains."""
    return ResultView(
        partial(designs_table, designs),
        partial(designs_parts, designs.axes),
        partial(loop_figure, designs),
    )


def designs_parts(designs: Mapping[str, "GainDesign"]) -> Iterator[RenderableType]:
    """Bandwidth, margins and gains, a column per axis; below, what became of each effect."""
    table = FittingTable(title="gains, in N·m, rad and s", title_justify="left")
    table.add_column("")
    for name in designs:
        table.add_column(escape(f"axis {name}"), justify="right")
    for label, cells in _gain_rows(list(designs.values())):
        table.add_row(label, *cells)
    yield table
    for name, design in designs.items():
        yield from (Text(f"  axis {name}: {of.effect}: {of.sentence}") for of in design.used)
    for name, design in designs.items():
        for unused in design.unused:
            yield Text(f"  axis {name}: {unused.effect} is not used: {unused.reason}")


def _gain_rows(designs: list["GainDesign"]) -> Iterator[tuple[str, list[str]]]:
    """Label and one cell per axis."""
    yield "bandwidth (rad/s)", [f"{d.bandwidth_rad_s:.4g}" for d in designs]
    yield "phase margin (°)", [f"{d.phase_margin_deg:.4g}" for d in designs]
    yield "gain margin", [f"{d.gain_margin:.4g}" for d in designs]
    for row in gain_rows([d.gains for d in designs]):
        yield row.label, row.cells(4)


# Every parameter of a model with its 95 % interval, in one table.


def parameter_table(
    model: Model, lines: Mapping[str, Estimate | None] = MappingProxyType({})
) -> FittingTable:
    """Rows of every axis: the base model's parameters, then those of each effect.

    Parameters
    ----------
    model : Model
    lines : mapping of axis name to Estimate or None
        With friction as the line through the friction curve, where that bends.
    """
    bent = any(line is not None for line in lines.values())
    title = f"parameters ({EFFECTIVE})" if bent else "parameters"
    table = FittingTable(title=title, title_justify="left")
    table.add_column("axis")
    table.add_column("parameter")
    table.add_column("value", justify="right")
    table.add_column("95 % interval", justify="right")
    table.add_column("unit")
    for name, axis in model.axes.items():
        for cells in (*_line_rows(lines.get(name), axis), *_rows(axis)):
            table.add_row(escape(name), *cells)
    return table


def _line_rows(line: Estimate | None, axis: AxisModel) -> Iterator[tuple[str, str, str, str]]:
    """The line through the friction, and above it nothing else: it is what is best known."""
    if line is None:
        return
    units = [entry["unit"] for entry in values_document(axis.terms[0], axis).values()]
    for i, name in enumerate(PARAMETERS[1:], 1):
        value, std = float(line.parameters[i]), float(line.std[i])
        yield f"effective {spoken(name)}", *_cells(value, std), units[i]


def _rows(axis: AxisModel) -> Iterator[tuple[str, str, str, str]]:
    """Parameter, value, interval and unit; of an effect only what its form has."""
    for n, term in enumerate(axis.terms):
        effect = f"{spoken(term.effect)}: " if n else ""
        for name, entry in values_document(term, axis).items():
            value, std, unit = entry["value"], entry["std"], entry["unit"]
            if std is not None or n == 0:
                unit = "" if unit == "1" else unit
                yield f"{effect}{spoken(name)}", *_cells(value, std), unit


def _cells(value: float, std: float | None) -> tuple[str, str]:
    texts = interval_texts(value, std)
    if texts is None:
        return f"{value:.4g}", ""
    shown, low, high = texts
    return shown, f"{low} to {high}"

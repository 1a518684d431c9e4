"""An identification and designed gains as tables, by rich."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from edge_ident.diagnosis.present.tables import finding_lines
from edge_ident.diagnosis.present.wording import timing_sentence, values
from edge_ident.identification.result import AxisIdentification, Identification, ParameterSource
from edge_ident.model.model import PARAMETERS, Estimate
from edge_ident.report.gain_rows import gain_rows
from edge_ident.support.console import FittingTable
from edge_ident.support.words import spoken, with_deviation

if TYPE_CHECKING:
    from edge_ident.control.gain_design import GainDesign


def identification_view(identification: Identification, diagnosis_ms: float | None = None) -> Group:
    """One table per axis, whether it is trusted, and the warnings with their next steps.

    Parameters
    ----------
    identification : Identification
    diagnosis_ms : float, optional
        Of all diagnoses behind it, in ms; by default the time of its own.
    """
    axes = (part for name, axis in identification.axes.items() for part in _axis(name, axis))
    own_ms = identification.timing_ms.get("diagnosis", 0.0)
    said = f"identified in {identification.timing_ms['total'] - own_ms:.0f} ms"
    if spent_ms := own_ms if diagnosis_ms is None else diagnosis_ms:
        said += f", diagnosed in {1e-3 * spent_ms:.1f} s"
    return Group(*axes, Text(said))


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


def designs_view(designs: Mapping[str, "GainDesign"]) -> Group:
    """Bandwidth, margins and gains, a column per axis; below, what became of each effect."""
    table = FittingTable(title="gains, in N·m, rad and s", title_justify="left")
    table.add_column("")
    for name in designs:
        table.add_column(escape(f"axis {name}"), justify="right")
    for label, cells in _gain_rows(list(designs.values())):
        table.add_row(label, *cells)
    used = (
        Text(f"  axis {name}: {used.effect}: {used.sentence}")
        for name, design in designs.items()
        for used in design.used
    )
    unused = (
        Text(f"  axis {name}: {unused.effect} is not used: {unused.reason}")
        for name, design in designs.items()
        for unused in design.unused
    )
    return Group(table, *used, *unused)


def _gain_rows(designs: list["GainDesign"]) -> Iterator[tuple[str, list[str]]]:
    """Label and one cell per axis."""
    yield "bandwidth (rad/s)", [f"{d.bandwidth_rad_s:.4g}" for d in designs]
    yield "phase margin (°)", [f"{d.phase_margin_deg:.4g}" for d in designs]
    yield "gain margin", [f"{d.gain_margin:.4g}" for d in designs]
    for row in gain_rows([d.gains for d in designs]):
        yield row.label, row.cells(4)

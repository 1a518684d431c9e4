"""Results as tables for a person, by rich."""

import math
from collections.abc import Mapping

from rich.console import Console
from rich.table import Table

from edge_ident.commissioning.profiling import TARGET_MS, Profile, spread
from edge_ident.commissioning.run import Outcome
from edge_ident.control.gain_design import GainDesign
from edge_ident.identification.identify import AxisIdentification, Identification
from edge_ident.model.model import PARAMETERS, Estimate
from firmware_interface.gains import RIPPLES, AxisGains

_console = Console(highlight=False)


def print_identification(identification: Identification) -> None:
    """One table per axis, the verdict, and what the user should know."""
    for name, axis in identification.axes.items():
        _console.print(_identification_table(name, axis))
        verdict = "[green]trusted[/]" if axis.trusted else "[red]not trusted[/]"
        _console.print(
            f"  {verdict}; least squares used: {axis.reason}\n"
            f"  relative residual {axis.metric.relative_residual:.2%}, "
            f"fit {axis.metric.fit:.3f}, time-spectral {axis.metric.time_spectral:.4f}"
        )
        if axis.compensated_effects:
            _console.print(f"  compensated: {', '.join(axis.compensated_effects)}")
        if axis.network is None:
            _console.print(f"  network: {axis.network_reason}")
        for finding in axis.findings:
            colour = "red" if finding.blocks else "yellow"
            _console.print(f"  [{colour}]{finding.code}[/]: {finding.message}")
            _console.print(f"    next: {finding.next_step}")
    total = identification.timing_ms["total"]
    _console.print(f"identified in {total:.0f} ms")


def _identification_table(name: str, axis: AxisIdentification) -> Table:
    table = Table(title=f"axis {name}", title_justify="left")
    table.add_column("parameter", no_wrap=True)
    for estimator in ("network", "least squares (used)"):
        table.add_column(estimator, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for i, parameter in enumerate(PARAMETERS):
        table.add_row(
            parameter.replace("_", " "),
            "–" if axis.network is None else _value(axis.network, i),
            _value(axis.least_squares, i),
            axis.units[i],
        )
    return table


def _value(estimate: Estimate, index: int) -> str:
    return f"{estimate.parameters[index]:.4g} ± {estimate.std[index]:.2g}"


def print_designs(designs: Mapping[str, GainDesign]) -> None:
    """Gains, bandwidth and margins, a column per axis."""
    table = Table(title="gains", title_justify="left")
    table.add_column("")
    for name in designs:
        table.add_column(f"axis {name}", justify="right")
    rows = {
        "bandwidth rad/s": [d.bandwidth_rad_s for d in designs.values()],
        "phase margin °": [d.phase_margin_deg for d in designs.values()],
        "gain margin": [d.gain_margin for d in designs.values()],
    }
    numbers = [d.gains.numbers() for d in designs.values()]
    for name in numbers[0]:
        if not name.startswith("ripple"):
            rows[name.replace("_", " ")] = [of_axis[name] for of_axis in numbers]
    for label, values in rows.items():
        table.add_row(label, *(f"{value:.4g}" for value in values))
    for k in range(RIPPLES):
        ripples = [_ripple(d.gains, k) for d in designs.values()]
        if any(ripples):
            table.add_row(f"ripple {k + 1}", *ripples)
    _console.print(table)
    for name, design in designs.items():
        for unused in design.unused:
            _console.print(f"  axis {name}: {unused.effect} is not used: {unused.reason}")


def _ripple(gains: AxisGains, k: int) -> str:
    amplitude = math.hypot(gains.ripple_cosine[k], gains.ripple_sine[k])
    return f"{amplitude:.3g} N·m every {gains.ripple_period_rad[k]:.4g} rad" if amplitude else ""


def print_outcome(outcome: Outcome) -> None:
    """Identification, gains, tracking before and after, and the conclusion."""
    print_identification(outcome.identification)
    if outcome.designs:
        print_designs(outcome.designs)
    if outcome.change and outcome.change.verification:
        table = Table(title="tracking error, rms", title_justify="left")
        for heading in ("axis", "before", "after", "smaller by", "repeats within"):
            table.add_column(heading, justify="right", no_wrap=True)
        for axis, tracking in outcome.change.verification.axes.items():
            table.add_row(
                axis,
                f"{1e3 * tracking.before_rad:.2f} mrad",
                f"{1e3 * tracking.after_rad:.2f} mrad",
                f"{tracking.ratio:.1f}",
                f"{1e3 * tracking.repeatability_rad:.2f} mrad",
            )
        _console.print(table)
    _console.print(outcome.conclusion)


def print_profile(profile: Profile) -> None:
    """Percentiles of every stage, a table for each start and precision, and the verdict."""
    _console.print(f"{profile.device}; {profile.machine}; {profile.repetitions} repetitions")
    for run in profile.runs:
        table = Table(title=f"{run.start}, {run.precision} (ms)", title_justify="left")
        table.add_column("stage")
        for heading in ("p50", "p95", "p99", "max"):
            table.add_column(heading, justify="right", no_wrap=True)
        for stage, times in run.stages_ms.items():
            of_stage = spread(times)
            values = (of_stage.p50, of_stage.p95, of_stage.p99, of_stage.maximum)
            table.add_row(stage.replace("_", " "), *(f"{value:.2f}" for value in values))
        _console.print(table)
    _console.print(f"{profile.verdict} (target {TARGET_MS:.0f} ms)")

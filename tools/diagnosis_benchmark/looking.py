"""One case at length: what was hidden, and what the diagnosis says of it and why."""

import time

import numpy as np
from rich.console import Console

from edge_ident.diagnosis import diagnose as engine
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.model.model import PARAMETERS
from tools.diagnosis_benchmark.bias import mean_parameters
from tools.diagnosis_benchmark.cases import Case
from tools.diagnosis_benchmark.hiding import AXES, fault_values, load_batch, simulate_batch


def print_case(case: Case, console: Console) -> None:
    """Simulate it if need be, diagnose it, and print both axes."""
    simulate_batch(case.batch)
    hidden = load_batch(case.batch)
    began_s = time.perf_counter()
    diagnosis = engine.diagnose([hidden.recording(case.row)])
    wall_s = time.perf_counter() - began_s
    hit = AXES[hidden.axis[case.row]]
    console.print(f"[bold]{case}[/], diagnosed in {wall_s:.2f} s")
    measured = hidden.shows, hidden.share, hidden.detectability
    of_faults = zip(fault_values(case), *(values[case.row] for values in measured), strict=True)
    for line, ratio, share, index in of_faults:
        console.print(
            f"hidden in {hit}: {line}; variance ratio {ratio:.4g}, {share:.2%} of the effort "
            f"beyond the base model, detectability {index:.1f}"
        )
    for finding in diagnosis.data_quality:
        console.print(f"data, axis {finding.axis}: {finding.code}: {finding.message}")
    for name, truth in zip(AXES, hidden.truth[case.row], strict=True):
        console.rule(f"axis {name}")
        axis = diagnosis.axes[name]
        _print_axis(axis, console)
        after = mean_parameters(axis.model, float(hidden.time_s[-1]))
        for index, parameter in enumerate(PARAMETERS):
            before = axis.base.estimate.parameters[index]
            console.print(
                f"  {parameter:<18} truth {truth[index]:9.4f}   base {before:9.4f}   "
                f"extended {after[index]:9.4f} (mean over the record)"
            )


def _print_axis(axis: AxisDiagnosis, console: Console) -> None:
    console.print(
        f"[bold]{axis.verdict}[/]; cut-off {axis.cutoff_hz:.3g} Hz; relative residual "
        f"held out {axis.base.held_out:.3%} → {axis.extended.held_out:.3%}, "
        f"fitted {axis.base.fitted:.3%} → {axis.extended.fitted:.3%}, "
        f"noise floor {axis.noise_floor:.3%} ({axis.noise_floor_source})"
    )
    for cause in axis.causes:
        low, high = cause.held_out_gain_interval
        values = ", ".join(
            f"{name} {np.mean(value):.4g} ± {cause.term.std.get(name, np.nan):.2g}"
            for name, value in cause.term.values.items()
        )
        console.print(
            f"  [bold]{cause.term.effect}[/]: gain {cause.held_out_gain:.1%} "
            f"({low:.1%} to {high:.1%}), share {cause.share:.2%}; {values}\n    {cause.evidence}"
        )
        for alternative in cause.alternatives:
            told = "" if alternative.separable else "NOT SEPARABLE, "
            console.print(f"    alternative {alternative.effect}: {told}{alternative.evidence}")
    for effect in axis.not_testable:
        console.print(f"  not testable: {effect.effect}: {effect.reason}")

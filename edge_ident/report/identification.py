"""What is shown of an identification: may it be trusted, what does the model miss, what to do next;
then tables of its parameters.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.wording import doubts, facts, timing_sentence, values, verdict_sentence
from edge_ident.identification import result
from edge_ident.model.model import PARAMETERS, Estimate
from edge_ident.report import chart, error_budget, findings, numbers, view
from edge_ident.signals.metrics import quantile
from edge_ident.support import next_step, words
from edge_ident.support.rows import Cell, Table, table_of

# The answer of an identification: may it be trusted, what the model misses, what to do next.
#
# These few lines come first; one table of parameters and the remarks follow.


def identification_answer(
    found: result.Identification,
    done: next_step.Done = next_step.NOTHING_DONE,
    *,
    details: bool = False,
    without_findings: str = findings.DESIGN_GAINS,
) -> view.Parts:
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
    steps = findings.identification_steps(found) or [without_findings]
    parts: list[view.Part] = [
        *trust_lines(found),
        *model_lines(found),
        *_budgets(found),
        *view.next_lines(next_step.whole_step(step, done) for step in steps),
        numbers.parameter_grid(found.model, {name: axis.line for name, axis in found.axes.items()}),
    ]
    said = {name: axis.findings for name, axis in found.axes.items()}
    rest = identification_parts(found) if details else findings.remarks(said)
    return (*parts, *rest)


def _budgets(found: result.Identification) -> Iterator[view.Part]:
    """Where the effort lies that the base model misses, of axes that were diagnosed."""
    for name, axis in found.axes.items():
        if axis.budget is not None:
            yield from error_budget.budget_parts(axis.budget, f"axis {name}: ")


def trust_lines(found: result.Identification) -> Iterator[view.Line]:
    """What speaks against an axis, a line for each, and what of it is known nevertheless; then the
    axes that are trusted."""
    for name, axis in found.axes.items():
        yield from findings.blocking_lines(name, axis.findings, "not trusted")
        known = dict(zip(PARAMETERS, axis.effective_known, strict=True))
        if not axis.trusted and any(known.values()):
            unknown = [parameter for parameter, sure in known.items() if not sure]
            sentence = result.known_sentence([one for one in known if known[one]], unknown)
            yield view.Line(sentence, f"axis {name}", "strong")
    if trusted := [name for name, axis in found.axes.items() if axis.trusted]:
        yield view.Line(f"the parameters of {words.listed(trusted)}", "trusted", "good")


def model_lines(found: result.Identification) -> Iterator[view.Line]:
    """What the model of each axis misses; where it is enough, one line for all."""
    enough: dict[str, list[str]] = {}
    for name, axis in found.axes.items():
        diagnosed = axis.diagnosis
        if diagnosed is not None:
            said = f"axis {name} {verdict_sentence(diagnosed)}"
            yield view.Line(said, "model", "strong")
            yield from map(view.below, (*facts(diagnosed), *doubts(diagnosed)))
        elif axis.adequacy.adequate:
            enough.setdefault(_enough(axis), []).append(name)
        else:
            said = f"axis {name} is not diagnosed: {axis.adequacy.reason}"
            yield view.Line(said, "model", "strong")
    for said, names in enough.items():
        lowest_hz = min(found.axes[name].adequacy.cutoff_hz for name in names)
        axes = "axis" if len(names) == 1 else "axes"
        where = f"on {axes} {words.listed(names)}, compared up to {lowest_hz:.3g} Hz"
        yield view.Line(f"{said} {where}", "model", "strong")


def _enough(axis: result.AxisIdentification) -> str:
    model = ["rigid body", "friction", *map(words.spoken, axis.compensated_effects)]
    return f"{words.listed(model)} are enough"


# All of it: every estimate, why this one is used, and the findings.


def identification_parts(
    identification: result.Identification, diagnosis_ms: float | None = None
) -> Iterator[view.Part]:
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
    yield view.Line(said)


def _axis(name: str, axis: result.AxisIdentification) -> Iterator[view.Part]:
    yield _estimates(name, axis)
    blocking = ", ".join(finding.code for finding in axis.findings if finding.blocks)
    verdict = "trusted" if axis.trusted else f"not trusted: {blocking}"
    said = f"{axis.source.spoken} used: {axis.reason}"
    yield view.Line(said, f"  {verdict}", "good" if axis.trusted else "bad", "; ")
    yield view.Line(
        f"  relative residual {axis.metric.relative_residual:.2%} of all samples, "
        f"fit {axis.metric.fit:.3f}, time-spectral {axis.metric.time_spectral:.4f}"
    )
    if not any(finding.message.startswith(axis.adequacy.reason) for finding in axis.findings):
        yield view.Line(f"  {axis.adequacy.reason}")
    yield view.Line(f"  {timing_sentence(axis.timing)}")
    if axis.compensated_effects:
        yield view.Line(f"  compensated effects: {', '.join(axis.compensated_effects)}")
    for term in axis.model.terms[1:]:
        yield view.Line(f"    {term.effect}: {', '.join(values(term, axis.model))}")
    if axis.network is None:
        yield view.Line(f"  network: {axis.network_reason}")
    yield from findings.finding_lines(axis.findings)


def _estimates(name: str, axis: result.AxisIdentification) -> view.Grid:
    """One column for each estimate, the one that is used first."""
    columns: dict[result.ParameterSource, Estimate | None] = {
        axis.source: axis.estimate,
        result.ParameterSource.LEAST_SQUARES: axis.least_squares,
        result.ParameterSource.NETWORK: axis.network,
    }
    columns[axis.source] = axis.estimate
    used = f"{axis.source.spoken} (used)"
    headings = [used, *(source.spoken for source in columns if source is not axis.source)]
    rows = numbers.estimate_rows(list(columns.values()), axis.units, words.with_deviation)
    if axis.line is not None:
        others = [None] * (len(columns) - 1)
        rows += numbers.effective_rows([axis.line, *others], axis.units, words.with_deviation)
    return view.Grid(f"axis {name}", ("parameter", *headings, "unit"), rows)


# The identified model over time.

_GAP: Final = 1.5  # sampling periods from which a line is broken: the axis stood still there


def _charts(found: result.Identification) -> list[list[chart.Chart]]:
    return chart.of_axes({name: identified_charts("", axis) for name, axis in found.axes.items()})


def identified_charts(key: str, axis: result.AxisIdentification) -> list[chart.Chart]:
    """Measured effort with the identified model, and the difference."""
    trace, unit = axis.trace, numbers.unit_text(axis.units[3])
    word, gaps = numbers.effort_word(axis.units[3]), np.append(False, _gaps(trace.time_s))
    measured = np.where(gaps, np.nan, trace.measured)
    residual = measured - trace.modelled
    height = chart.reach(residual)
    missed = (
        f"The model misses {numbers.digits(100 * axis.metric.relative_residual, 2)} % of it (rms)."
    )
    scale = chart.across(trace.time_s)
    effort = (
        chart.Layer("line", "measured", trace.time_s, measured, "measured"),
        chart.Layer(
            "line",
            "extended",
            trace.time_s,
            np.where(gaps, np.nan, trace.modelled),
            "identified model",
        ),
    )
    return [
        chart.Chart(
            f"{key}-effort", f"Measured {word} and what the model says",
            f"The measured {word} goes from {numbers.digits(float(np.min(trace.measured)), 3)} to "
            f"{numbers.digits(float(np.max(trace.measured)), 3)} {unit}. {missed}",
            ("time", "s"), (word, unit), scale, chart.around(trace.measured), effort,
        ),
        chart.Chart(
            f"{key}-residual", "What the model misses", missed,
            ("time", "s"), ("error of the model", unit), scale, chart.Scale(-height, height),
            (chart.Layer("line", "extended thin", trace.time_s, residual, "identified model"),),
            height=170,
        ),
    ]  # fmt: skip


def _gaps(time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    steps = np.diff(time_s)
    return np.asarray(steps > _GAP * quantile(steps, 0.5))


# A row for each parameter of each axis, as a data frame takes them.


def identification_table(found: result.Identification) -> Table:
    """A row for each parameter of each axis: those of the base model, then those of each effect."""

    def rows() -> Iterator[tuple[Cell, ...]]:
        for name, axis in found.axes.items():
            for index, term in enumerate(axis.model.terms):
                known = axis.known if index == 0 else (None,) * len(term.values)
                for row, certain in zip(
                    numbers.term_rows(term, axis.model.units), known, strict=False
                ):
                    yield name, *row, certain, axis.trusted

    return table_of(("axis", *numbers.TERM_ROW, "known", "trusted"), rows())


VIEW: Final = view.ResultView(identification_table, identification_parts, _charts)

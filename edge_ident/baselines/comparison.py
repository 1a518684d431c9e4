"""Run the methods on every axis of a recording, and measure all answers alike."""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from edge_ident.baselines.problem import Problem, pose
from edge_ident.errors import DataError, EdgeIdentError
from edge_ident.estimation.network import Network, given_network
from edge_ident.estimation.trust import Finding, check_estimate
from edge_ident.model.model import NORMAL_95, PARAMETERS, Estimate
from edge_ident.signals.data_checks import check_usable
from edge_ident.signals.metrics import Metric
from edge_ident.signals.metrics import compare as measure
from edge_ident.signals.recording_files import Given, given_recording
from edge_ident.signals.time_stamps import with_mended_stamps
from edge_ident.support.given import number
from edge_ident.support.rows import Readable, new_figure
from edge_ident.support.words import listed

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import RenderableType

    from edge_ident.baselines.methods import Method
    from edge_ident.support.rows import Table


@dataclass(frozen=True)
class Row:
    """What one method made of one axis.

    Attributes
    ----------
    method : str
    estimate : Estimate or None
    metric : Metric or None
        Of the estimate, on the samples that all methods share.
    reason : str
        Why there is no estimate; empty where there is one.
    findings : tuple of Finding
        What speaks against acting on the estimate.
    time_ms : float
        Without the filtering that all methods share.
    """

    method: str
    estimate: Estimate | None
    metric: Metric | None
    reason: str
    findings: tuple[Finding, ...]
    time_ms: float


@dataclass(frozen=True)
class AxisComparison:
    """All methods on one axis.

    Attributes
    ----------
    rows : tuple of Row
    units : tuple of str
        Of the four parameters.
    samples : int
        On which every row's metric is computed.
    cutoff_hz : float
        Of the zero-phase filter.
    """

    rows: tuple[Row, ...]
    units: tuple[str, str, str, str]
    samples: int
    cutoff_hz: float


@dataclass(frozen=True, repr=False)
class Comparison(Readable):
    """All axes of a recording, each identified by several methods.

    Attributes
    ----------
    axes : mapping of axis name to AxisComparison

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.compare(edge_ident.simulate(), methods=["least_squares"])
    >>> found.answered
    True
    """

    axes: Mapping[str, AxisComparison]

    @property
    def answered(self) -> bool:
        """Whether some method gave an answer for every axis."""
        return all(any(row.estimate for row in axis.rows) for axis in self.axes.values())

    def table(self) -> "Table":
        """One row for each parameter of each method on each axis.

        Returns
        -------
        mapping of column name to list
            What a data frame takes.
        """
        from edge_ident.report.result_tables import comparison_table

        return comparison_table(self)

    def __rich__(self) -> "RenderableType":
        from edge_ident.report.comparison_tables import comparison_view

        return comparison_view(self)

    def plot(self) -> "Figure":
        """Draw the estimates with their 95 % intervals side by side.

        Raises
        ------
        DataError
            matplotlib is not installed.
        """

        return comparison_figure(self)


def all_methods() -> "dict[str, Method]":
    """Every method by its name; scipy, which some need, is loaded when they are asked for."""
    from edge_ident.baselines.methods import METHODS

    return METHODS


def comparison_methods() -> tuple[str, ...]:
    """Names of the methods that `compare` knows, in alphabetical order.

    Examples
    --------
    >>> import edge_ident
    >>> "least_squares" in edge_ident.comparison_methods()
    True
    """
    return tuple(all_methods())


def compare(
    recording: Given | Iterable[Given],
    network: Network | str | PathLike[str] | None = None,
    *,
    methods: str | Sequence[str] = (),
    tries: int = 8,
    seed: int = 0,
    on_stage: Callable[[str], None] = lambda title: None,
    on_note: Callable[[str], None] = lambda note: None,
) -> Comparison:
    """Identify every axis by every method, on the same signals and samples.

    Parameters
    ----------
    recording : Recording, str, Path or data frame
        One recording, or what `load_recording` makes one of.
    network : Network, str, Path or None
    methods : str or sequence of str
        Names from `comparison_methods`; none stands for all.
    tries : int
        Of random search.
    seed : int
        Random seed of the methods that need one.
    on_stage, on_note : callables
        Told which method begins, and how far it is.

    Returns
    -------
    Comparison

    Raises
    ------
    DataError
        There is no such method, hardly any sample shows an axis in motion, or an effort never
        changes.

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.compare(edge_ident.simulate(), methods=["ordinary_least_squares"])
    >>> [row.method for row in found.axes["x"].rows]
    ['ordinary_least_squares']
    """
    recording = given_recording(recording, "compare")
    network = None if network is None else given_network(network)
    number("tries", tries, 1, 1e6, "give a whole number of tries, such as 8")
    methods = [methods] if isinstance(methods, str) else methods
    known, axes = all_methods(), {}
    for method in methods:
        if method not in known:
            raise DataError(f"there is no method {method}", f"choose from {listed(known)}")
    check_usable(recording)
    recording = with_mended_stamps(recording)
    for name, axis in recording.axes.items():
        problem = pose(recording, name, network=network, tries=tries, seed=seed, note=on_note)
        rows = []
        for method in methods or known:
            on_stage(f"axis {name}, {method.replace('_', ' ')}")
            rows.append(_run(method, known[method], problem))
        axes[name] = AxisComparison(
            tuple(rows), axis.parameter_units, len(problem.effort), problem.signals.cutoff_hz
        )
    return Comparison(axes)


def _run(name: str, method: "Method", problem: Problem) -> Row:
    start_s = time.perf_counter()
    estimate, reason = _attempt(method, problem)
    time_ms = 1e3 * (time.perf_counter() - start_s)
    if estimate is None:
        return Row(name, None, None, reason, (), time_ms)
    metric = measure(problem.effort, problem.regressor @ estimate.parameters)
    columns = problem.part.columns
    findings = check_estimate(estimate, columns, problem.effort, metric.relative_residual)
    for finding in findings:
        if finding.code == "inseparable":  # then any number is one of infinitely many
            return Row(name, None, None, finding.message, (), time_ms)
    return Row(name, estimate, metric, "", tuple(findings), time_ms)


def _attempt(method: "Method", problem: Problem) -> tuple[Estimate | None, str]:
    """The estimate, or none and why; one method's failure must not cost the others' answers."""
    try:
        estimate = method(problem)
    except EdgeIdentError as error:
        return None, error.cause
    except (ArithmeticError, ValueError) as error:  # LinAlgError is a ValueError
        return None, f"the computation failed: {error}"
    if not (np.isfinite(estimate.parameters).all() and np.isfinite(estimate.std).all()):
        return None, "the computation ended in numbers that are not finite"
    return estimate, ""


# Estimates with their intervals side by side, one panel per parameter.

# Times the best relative residual, above which an estimate does not set a panel's range.
_FAR: Final = 2.0


def comparison_figure(comparison: Comparison) -> "Figure":
    """Draw every method's estimate of every parameter, a row of panels per axis."""
    rows = sum(2 + len(axis.rows) for axis in comparison.axes.values())
    figure = new_figure(12, 0.32 * rows)
    grid = figure.subplots(len(comparison.axes), len(PARAMETERS), squeeze=False, sharey="row")
    for panels, (name, axis) in zip(grid, comparison.axes.items(), strict=True):
        for index, panel in enumerate(panels):
            _draw_parameter(panel, axis, index)
        panels[0].set_yticks(
            range(len(axis.rows)), [row.method.replace("_", " ") for row in axis.rows]
        )
        panels[0].set_ylim(len(axis.rows) - 0.5, -0.5)
        panels[0].set_ylabel(f"axis {name}")
    return figure


def _draw_parameter(panel: Any, axis: AxisComparison, index: int) -> None:
    """Value and 95 % interval of every method; an arrow where the value lies outside."""
    low, high = _range(axis, index)
    panel.set_xlim(low, high)
    panel.set_title(f"{PARAMETERS[index].replace('_', ' ')} ({axis.units[index]})", fontsize=10)
    panel.locator_params(axis="x", nbins=5)
    panel.grid(axis="x", alpha=0.3)
    for line, row in enumerate(axis.rows):
        if row.estimate is None:
            panel.text(0.5 * (low + high), line, "no answer", ha="center", va="center", alpha=0.5)
            continue
        value, std = float(row.estimate.parameters[index]), float(row.estimate.std[index])
        if low <= value <= high:
            panel.errorbar(value, line, xerr=NORMAL_95 * std, fmt="o", color="tab:blue", capsize=3)
            continue
        edge, side, arrow = (low, "left", "◀") if value < low else (high, "right", "▶")
        text = f"{arrow} {value:.3g}" if side == "left" else f"{value:.3g} {arrow}"
        panel.text(edge, line, text, ha=side, va="center", color="tab:red", fontsize=9)


def _range(axis: AxisComparison, index: int) -> tuple[float, float]:
    """From the lowest to the highest interval of the estimates that describe the effort."""
    answered = [(row.estimate, row.metric) for row in axis.rows if row.estimate and row.metric]
    best = min((metric.relative_residual for _, metric in answered), default=0.0)
    shown = [
        (estimate.parameters[index], NORMAL_95 * estimate.std[index])
        for estimate, metric in answered
        if metric.relative_residual <= _FAR * best
    ]
    if not shown:
        return 0.0, 1.0
    low = float(np.min([value - reach for value, reach in shown]))
    high = float(np.max([value + reach for value, reach in shown]))
    margin = 0.15 * (high - low) or 0.1 * abs(low) or 1.0
    return low - margin, high + margin

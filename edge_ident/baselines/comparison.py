"""Run the methods on every axis of a recording, and measure all answers alike."""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np

from edge_ident.baselines.problem import Problem, pose
from edge_ident.errors import DataError, EdgeIdentError
from edge_ident.estimation.network import Network, given_network
from edge_ident.estimation.trust import Finding, check_estimate
from edge_ident.model.model import Estimate
from edge_ident.signals import data_checks, metrics, recording_files, time_stamps
from edge_ident.signals.metrics import compare as measure
from edge_ident.support import given, words
from edge_ident.support.rows import Drawable

if TYPE_CHECKING:
    from edge_ident.baselines.methods import Method


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
    metric: metrics.Metric | None
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
class Comparison(Drawable):
    """All axes of a recording, each identified by several methods.

    `table` has a row for each parameter of each method on each axis. `plot` draws the estimates
    with their 95 % intervals side by side.

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
    recording: recording_files.Given | Iterable[recording_files.Given],
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
    recording = recording_files.given_recording(recording, "compare")
    network = None if network is None else given_network(network)
    given.seed(seed)
    given.number("tries", tries, 1, 1e6, "give a whole number of tries, such as 8")
    methods = [methods] if isinstance(methods, str) else methods
    known, axes = all_methods(), {}
    for method in methods:
        if method not in known:
            raise DataError(f"there is no method {method}", f"choose from {words.listed(known)}")
    data_checks.check_usable(recording)
    recording = time_stamps.with_mended_stamps(recording)
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

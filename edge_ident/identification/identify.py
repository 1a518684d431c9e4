"""From a recording to parameters: network and least squares side by side, and which to trust."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation import cnn, least_squares
from edge_ident.estimation.alignment import align
from edge_ident.estimation.assumed_effects import Remainder, without_effects
from edge_ident.estimation.network import Network
from edge_ident.estimation.trust import (
    Finding,
    assumed_in_time,
    compare_estimators,
    describe_data,
    judge,
)
from edge_ident.model.model import AxisModel, Estimate, Model, base_axis, effect_names
from edge_ident.signals.conditioning import Signals
from edge_ident.signals.metrics import Metric, compare
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.support.readable import Readable
from edge_ident.support.stopwatch import Stopwatch

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import RenderableType


@dataclass(frozen=True)
class EffortTrace:
    """What a plot shows of one axis: the samples that were estimated from.

    Attributes
    ----------
    time_s : (N,) array
        From the start of the recording.
    measured, modelled : (N,) arrays
        Filtered alike.
    """

    time_s: NDArray[np.float64]
    measured: NDArray[np.float64]
    modelled: NDArray[np.float64]


@dataclass(frozen=True)
class AxisIdentification:
    """What was found out about one axis.

    Attributes
    ----------
    reason : str
        Why `estimate` is what is reported.
    network : Estimate or None
        None where no network applies; `network_reason` says why, or how it ended.
    least_squares : Estimate
    model : AxisModel
        `estimate` as the base term, and the effects that were taken off the effort before.
    metric : Metric
        Of `model`, on the filtered effort.
    units : tuple of str
    cutoff_hz : float
        Of the zero-phase filter.
    condition_number : float
        Of the regressor with columns of unit length.
    findings : tuple of Finding
    trace : EffortTrace

    Examples
    --------
    >>> import edge_ident
    >>> axis = edge_ident.identify(edge_ident.simulate()).axes["x"]
    >>> axis.trusted
    True
    >>> axis.metric.relative_residual < 0.01
    True
    """

    reason: str
    network: Estimate | None
    network_reason: str
    least_squares: Estimate
    model: AxisModel
    metric: Metric
    units: tuple[str, str, str, str]
    cutoff_hz: float
    condition_number: float
    findings: tuple[Finding, ...]
    trace: EffortTrace

    @property
    def estimate(self) -> Estimate:
        """What is reported and acted on: least squares; the network is its witness."""
        return self.least_squares

    @property
    def assumed_effects(self) -> tuple[str, ...]:
        """Names of the effects that were taken for known."""
        return effect_names(self.model)

    @property
    def trusted(self) -> bool:
        """Whether nothing found forbids acting on the estimate."""
        return not any(finding.blocks for finding in self.findings)


@dataclass(frozen=True, repr=False)
class Identification(Readable):
    """What was found out about all axes of a recording.

    Attributes
    ----------
    axes : mapping of axis name to AxisIdentification
    timing_ms : mapping of stage to milliseconds

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.identify(edge_ident.simulate())
    >>> list(found.axes)
    ['x', 'z']
    >>> print(found)  # doctest: +ELLIPSIS
    axis x
    ...
    """

    axes: Mapping[str, AxisIdentification]
    timing_ms: Mapping[str, float]

    @property
    def trusted(self) -> bool:
        """Whether every axis is."""
        return all(axis.trusted for axis in self.axes.values())

    @property
    def model(self) -> Model:
        """The identified axes as a model, with the effects that were compensated."""
        return Model({name: axis.model for name, axis in self.axes.items()})

    def __rich__(self) -> "RenderableType":
        from edge_ident.report.identification_tables import identification_view

        return identification_view(self)

    def plot(self) -> "Figure":
        """Draw measured and modelled effort of every axis, and the residual.

        Raises
        ------
        DataError
            matplotlib is not installed.
        """
        from edge_ident.report.effort_figure import effort_figure

        return effort_figure(self)


def identify(
    recording: Recording,
    network: Network | None = None,
    *,
    model: Model | None = None,
    seed: int = 0,
    stopwatch: Stopwatch | None = None,
) -> Identification:
    """Identify the parameters of every axis of a recording.

    Parameters
    ----------
    recording : Recording
    network : Network or None
        Without one, least squares alone.
    model : Model, optional
        Its effects are taken off the effort before the base parameters are estimated.
    seed : int
        Of the network's random starting points.
    stopwatch : Stopwatch, optional
        Continued if given, so that the caller's stages are reported too.

    Returns
    -------
    Identification

    Raises
    ------
    DataError
        Hardly any sample shows an axis in motion.
    ModelError
        The model does not fit the recording.

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.identify(edge_ident.simulate())
    >>> found.trusted
    True
    >>> inertia, viscous, coulomb, offset = found.axes["x"].estimate.parameters
    >>> round(float(inertia), 2), found.axes["x"].units[0]
    (0.43, 'kg*m^2')
    """
    watch = stopwatch or Stopwatch()
    axes = {}
    for name, axis in recording.axes.items():
        with watch.stage("signals"):
            remainder = without_effects(recording, name, model)
            legible = remainder
            if network is not None and network.manifest.motion.effects:
                legible = without_effects(recording, name, None)
        with watch.stage("cnn"):
            estimate, reason = run_network(legible.signals, axis, network, seed, watch)
        with watch.stage("estimate"):
            axes[name] = _conclude(remainder, axis, estimate, reason)
    return Identification(axes, watch.timing_ms())


def run_network(
    signals: Signals, axis: AxisRecord, network: Network | None, seed: int, watch: Stopwatch
) -> tuple[Estimate | None, str]:
    """The network's estimate, or none and why.

    Parameters
    ----------
    signals : Signals
    axis : AxisRecord
        Tells the units.
    network : Network or None
    seed : int
        Of random starting points.
    watch : Stopwatch
        Gets the stages "align", "image" and "network".
    """
    if network is None:
        return None, "no network was given"
    motion = network.manifest.motion
    if (axis.position_unit, axis.effort_unit) != (motion.position_unit, motion.effort_unit):
        return None, (
            f"the network was trained for {motion.position_unit} and {motion.effort_unit}, "
            f"not {axis.position_unit} and {axis.effort_unit}"
        )
    with watch.stage("align"):
        found = align(signals, motion.columns[:, 1], motion.period_s)
    if found is None:
        return None, f"the recording is shorter than the {motion.period_s:.4g} s of its motion"
    mismatch = cnn.motion_mismatch(found.columns, network)
    limit = network.manifest.mismatch_limit
    if mismatch > limit:
        return None, f"no network was trained for that motion: it differs by {mismatch:.1%} " + (
            f"(limit {limit:.1%})"
        )
    result = cnn.identify(found.columns, found.effort, network, seed=seed, stopwatch=watch)
    if not result.trusted:
        return None, result.reason
    return Estimate(result.parameters, result.std), result.reason


def _conclude(
    remainder: Remainder, axis: AxisRecord, network: Estimate | None, reason: str
) -> AxisIdentification:
    signals = remainder.signals
    part = least_squares.estimation_part(signals)
    regressor, effects = signals.regressor[part], remainder.taken_off[part]
    measured = signals.effort[part] + effects
    linear = least_squares.fit(signals)
    if network is not None:
        # slow noise moves both answers alike; the network's own figures know white noise alone
        network = Estimate(network.parameters, np.hypot(network.std, linear.std))
    modelled = regressor @ linear.parameters + effects
    metric = compare(measured, modelled)
    base = base_axis(linear, axis.position_unit, axis.effort_unit)
    findings = describe_data(signals)
    findings += assumed_in_time(remainder.tied_to_time)
    findings += judge(linear, regressor, measured, metric.relative_residual)
    if network is not None:
        findings += compare_estimators(network, linear)
    return AxisIdentification(
        reason=_reason(network, linear),
        network=network,
        network_reason=reason,
        least_squares=linear,
        model=replace(base, terms=(*base.terms, *remainder.effects)),
        metric=metric,
        units=axis.parameter_units,
        cutoff_hz=signals.cutoff_hz,
        condition_number=least_squares.condition_number(regressor),
        findings=tuple(findings),
        trace=EffortTrace(signals.period_s * part.astype(np.float64), measured, modelled),
    )


def _reason(network: Estimate | None, linear: Estimate) -> str:
    """Why the parameters are those of least squares."""
    if network is None:
        return "the network does not apply"
    apart = np.max(np.abs(network.parameters - linear.parameters) / network.std)
    return (
        "its intervals hold under coloured noise; "
        f"the network agrees within {apart:.1f} standard deviations"
    )

"""From a recording to parameters: network and least squares side by side, and which to trust."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from edge_ident.estimation import least_squares, network_estimate
from edge_ident.estimation.alignment import align
from edge_ident.estimation.compensation import CompensatedAxis, compensate_effects
from edge_ident.estimation.network import Network
from edge_ident.estimation.trust import (
    Finding,
    compare_estimators,
    describe_data,
    judge,
    tied_to_time,
)
from edge_ident.model.model import AxisModel, Estimate, Model, base_axis, effect_names
from edge_ident.signals.conditioning import Signals
from edge_ident.signals.metrics import Metric, compare
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.support.stopwatch import Stopwatch


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
        `estimate` as the base term, and the effects that the effort is compensated for.
    metric : Metric
        Of `model`, on the filtered effort.
    units : tuple of str
    cutoff_hz : float
        Of the zero-phase filter.
    condition_number : float
        Of the regressor with columns of unit length.
    findings : tuple of Finding
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

    @property
    def estimate(self) -> Estimate:
        """What is reported and used: least squares. The network confirms it."""
        return self.least_squares

    @property
    def compensated_effects(self) -> tuple[str, ...]:
        """Names of the effects that the effort is compensated for."""
        return effect_names(self.model)

    @property
    def trusted(self) -> bool:
        """Whether nothing found forbids acting on the estimate."""
        return not any(finding.blocks for finding in self.findings)


@dataclass(frozen=True)
class Identification:
    """All axes of a recording, and where the time went (ms, by stage)."""

    axes: Mapping[str, AxisIdentification]
    timing_ms: Mapping[str, float]

    @property
    def trusted(self) -> bool:
        """Whether every axis is."""
        return all(axis.trusted for axis in self.axes.values())


def identify(
    recording: Recording,
    network: Network | None,
    *,
    model: Model | None = None,
    seed: int = 0,
    stopwatch: Stopwatch | None = None,
) -> Identification:
    """Identify every axis of a recording.

    Parameters
    ----------
    recording : Recording
    network : Network or None
        Without one, least squares alone.
    model : Model, optional
        The effort is compensated for its effects before the base parameters are estimated.
    seed : int
        Of the network's random starting points.
    stopwatch : Stopwatch, optional
        Continued if given, so that the caller's stages are reported too.

    Raises
    ------
    ModelError
        The model does not fit the recording.
    """
    watch = stopwatch or Stopwatch()
    axes = {}
    for name, axis in recording.axes.items():
        with watch.stage("signals"):
            compensated = compensate_effects(recording, name, model)
            network_input = compensated
            if network is not None and network.manifest.motion.effects:
                network_input = compensate_effects(recording, name, None)
        with watch.stage("cnn"):
            estimate, reason = run_network(network_input.signals, axis, network, seed, watch)
        with watch.stage("estimate"):
            axes[name] = _conclude(compensated, axis, estimate, reason)
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
        found = align(signals, motion.regressor[:, 1], motion.period_s)
    if found is None:
        return None, f"the recording is shorter than the {motion.period_s:.4g} s of its motion"
    mismatch = network_estimate.motion_mismatch(found.regressor, network)
    limit = network.manifest.mismatch_limit
    if mismatch > limit:
        return None, f"no network was trained for that motion: it differs by {mismatch:.1%} " + (
            f"(limit {limit:.1%})"
        )
    result = network_estimate.estimate(
        found.regressor, found.effort, network, seed=seed, stopwatch=watch
    )
    if not result.trusted:
        return None, result.reason
    return Estimate(result.parameters, result.std), result.reason


def _conclude(
    compensated: CompensatedAxis, axis: AxisRecord, network: Estimate | None, reason: str
) -> AxisIdentification:
    signals = compensated.signals
    part = least_squares.estimation_part(signals)
    regressor, effects = signals.regressor[part], compensated.effects_effort[part]
    measured = signals.effort[part] + effects
    linear = least_squares.fit(signals, part)
    if network is not None:
        # slow noise moves both answers alike; the network's own figures know white noise alone
        network = Estimate(network.parameters, np.hypot(network.std, linear.std))
    metric = compare(measured, regressor @ linear.parameters + effects)
    base = base_axis(linear, axis.position_unit, axis.effort_unit)
    findings = describe_data(signals)
    findings += tied_to_time(compensated.tied_to_time)
    findings += judge(linear, regressor, measured, metric.relative_residual)
    if network is not None:
        findings += compare_estimators(network, linear)
    return AxisIdentification(
        reason=_reason(network, linear),
        network=network,
        network_reason=reason,
        least_squares=linear,
        model=replace(base, terms=(*base.terms, *compensated.effects)),
        metric=metric,
        units=axis.parameter_units,
        cutoff_hz=signals.cutoff_hz,
        condition_number=least_squares.condition_number(regressor),
        findings=tuple(findings),
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

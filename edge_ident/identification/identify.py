"""From a recording to parameters: network and least squares side by side, and which to trust."""

from dataclasses import replace

import numpy as np

from edge_ident.estimation import least_squares, network_estimate
from edge_ident.estimation.alignment import align
from edge_ident.estimation.compensation import CompensatedAxis, compensate_effects
from edge_ident.estimation.network import Network
from edge_ident.estimation.outside_support import departures, range_of
from edge_ident.estimation.trust import (
    check_estimate,
    compare_estimators,
    describe_data,
    tied_to_time,
)
from edge_ident.identification.result import AxisIdentification, EffortTrace, Identification
from edge_ident.model.model import Estimate, Model, base_axis
from edge_ident.signals.conditioning import Signals
from edge_ident.signals.metrics import compare
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.support.stopwatch import Stopwatch


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
        The effort is compensated for its effects before the base parameters are estimated.
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
    modelled = regressor @ linear.parameters + effects
    metric = compare(measured, modelled)
    seen = range_of(signals, axis, part, signals.effort + compensated.effects_effort)
    base = base_axis(linear, axis.position_unit, axis.effort_unit, seen)
    findings = describe_data(signals)
    findings += departures(compensated.effects, seen, axis)
    findings += tied_to_time(compensated.tied_to_time)
    findings += check_estimate(linear, regressor, measured, metric.relative_residual)
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

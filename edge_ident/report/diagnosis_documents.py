"""A diagnosis as a JSON document for scripts."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.measures import ModelFit, Traces, Validation
from edge_ident.diagnosis.result import Alternative, AxisDiagnosis, Cause, Diagnosis
from edge_ident.model.model import PARAMETERS, AxisModel, base_axis
from edge_ident.model.model_files import values_document
from edge_ident.support.documents import finite

Array = NDArray[np.float64]


def diagnosis_document(diagnosis: Diagnosis, model_file: Path | None) -> dict[str, Any]:
    """The document of schema edge-ident/diagnosis/2; equal diagnoses give equal documents.

    Parameters
    ----------
    diagnosis : Diagnosis
    model_file : Path or None
        Path of the extended model's file, if there is one.
    """
    return {
        "schema": "edge-ident/diagnosis/2",
        "axes": {name: _axis(name, diagnosis.axes) for name in diagnosis.axes},
        "data_quality": [asdict(finding) for finding in diagnosis.data_quality],
        "validation": {
            name: _validation(validation) for name, validation in diagnosis.validation.items()
        }
        or None,
        "model": None if model_file is None else str(model_file),
    }


def _axis(name: str, axes: Mapping[str, AxisDiagnosis]) -> dict[str, Any]:
    axis = axes[name]
    base, extended = (fit.estimate.parameters for fit in (axis.base, axis.extended))
    return {
        "verdict": axis.verdict.value,
        "explained_share": axis.explained_share,
        "converged": axis.converged,
        "causes": [_cause(cause, axis.model) for cause in axis.causes],
        "curves": [curve.document() for curve in axis.curves],
        "suspected": [_cause(cause, axis.model) for cause in axis.suspected],
        "minor": [_cause(cause, axis.model) for cause in axis.minor],
        "findings": [asdict(found) for found in axis.findings],
        "timing": asdict(axis.timing),
        "band": {"cutoff_hz": axis.cutoff_hz, "share_of_effort_variance": axis.share_in_band},
        "lines": [asdict(line) for line in axis.lines],
        "refused": [{"effect": r.effect, "reason": r.reason} for r in axis.refused],
        "outside_vibrations": [asdict(vibration) for vibration in axis.external_vibrations],
        "not_testable": [asdict(effect) for effect in axis.not_testable],
        "budget": axis.budget.document(),
        "base": _fit(axis.base, axis.model),
        "extended": _fit(axis.extended, axis.model),
        "noise_floor": axis.noise_floor,
        "noise_floor_source": axis.noise_floor_source,
        "parameters_shift": {
            parameter: {"base": float(base[i]), "extended": float(extended[i])}
            for i, parameter in enumerate(PARAMETERS)
        },
        "residual_whereabouts": explained_variance(name, axes),
        "cutoff_hz": axis.cutoff_hz,
        "knee_hz": axis.knee_hz,
    }


def _cause(cause: Cause, axis: AxisModel) -> dict[str, Any]:
    source = {} if cause.term.source_axis is None else {"source_axis": cause.term.source_axis}
    return {
        "effect": cause.term.effect,
        **source,
        "parameters": values_document(cause.term, axis),
        "held_out_gain": finite(cause.held_out_gain),
        "held_out_gain_interval": [finite(end) for end in cause.held_out_gain_interval],
        "share": cause.share,
        "rivals": [_alternative(alternative, axis) for alternative in cause.alternatives],
        "evidence": cause.evidence,
        "decision": cause.decision,
        "shown_in": list(cause.shown_in),
    }


def _alternative(alternative: Alternative, axis: AxisModel) -> dict[str, Any]:
    found = alternative.term
    return {
        "effect": alternative.effect,
        "separable": alternative.separable,
        "evidence": alternative.evidence,
        "experiment": alternative.experiment,
        "parameters": None if found is None else values_document(found, axis),
    }


def _fit(fit: ModelFit, axis: AxisModel) -> dict[str, Any]:
    base, line = (base_axis(e, *axis.units) for e in (fit.estimate, fit.effective or fit.estimate))
    effective = values_document(line.terms[0], line)
    return {
        "parameters": values_document(base.terms[0], base),
        "effective": {name: effective[name] for name in PARAMETERS[1:]},
        "relative_residual": {"fitted": fit.fitted, "held_out": finite(fit.held_out)},
        "metric": asdict(fit.metric),
        "motion_error": {"rms": fit.motion_error, "unit": axis.position_unit},
    }


def _seen_there(residual: float, friction_anew: float) -> dict[str, float]:
    return {
        "relative_residual": residual,
        "relative_residual_with_friction_anew": friction_anew,
    }


def _validation(validation: Validation) -> dict[str, Any]:
    return {
        "base": _seen_there(validation.base, validation.friction_anew[0]),
        "extended": _seen_there(validation.extended, validation.friction_anew[1]),
        "as_found": {"relative_residual": validation.as_found},
        "causes": [
            {
                "effect": cause.effect,
                "relative_residual_without": cause.without,
                "gain": cause.gain,
                "gain_interval": cause.interval and [finite(end) for end in cause.interval],
                "carries_over": cause.carries_over,
                "reason": cause.reason,
            }
            for cause in validation.causes
        ],
    }


# How much of a residual's variance each quantity explains.

_BINS: Final = 40
"""Most bins of a quantity, in each direction."""
_PER_BIN: Final = 20
"""Fewest samples of a bin, of both directions."""
_TIME_BINS: Final = 10
"""Few, so that time does not stand for whatever changes slowly."""


def explained_variance(
    name: str, diagnosed: Mapping[str, AxisDiagnosis]
) -> dict[str, dict[str, float]]:
    """Variance of the residual that each quantity explains, as a share (correlation ratio).

    Pearson's correlation ratio η², adjusted for the number of bins: zero where the quantity
    explains nothing, one where it explains all. Each direction of motion has its own bins, except
    for time. Quantities that move together explain the same share.

    Parameters
    ----------
    name : str
        Of the axis.
    diagnosed : mapping of axis name to AxisDiagnosis
        All axes.

    Returns
    -------
    dict
        By "base" and "extended", then by quantity.
    """
    traces, valid = diagnosed[name].traces, diagnosed[name].traces.valid
    residuals = {"base": traces.base_effort, "extended": traces.extended_effort}
    by = groups(name, diagnosed)
    return {
        model: {
            of: correlation_ratio((traces.effort - effort)[valid], group)
            for of, group in by.items()
        }
        for model, effort in residuals.items()
    }


def groups(name: str, diagnosed: Mapping[str, AxisDiagnosis]) -> dict[str, NDArray[np.intp]]:
    """Numbers of bins of the valid samples, by quantity; each direction has its own, time not."""
    traces = diagnosed[name].traces
    valid, forward = traces.valid, (traces.velocity > 0.0)[traces.valid]
    quantities = {
        "position": traces.position,
        "velocity": traces.velocity,
        "distance_since_reversal": traces.since_reversal,
    } | {
        f"acceleration_of_{other}": acceleration_at(traces, diagnosed[other].traces)
        for other in diagnosed
        if other != name
    }
    bins = min(_BINS, len(forward) // _PER_BIN)
    found = {of: 2 * _bins(values[valid], bins) + forward for of, values in quantities.items()}
    return found | {"time": _bins(running_time(traces)[valid], _TIME_BINS)}


def acceleration_at(traces: Traces, other: Traces) -> Array:
    """Acceleration (N,) of another axis at this axis's times, recording by recording; 0 where it
    rests."""
    found = np.zeros_like(traces.time_s)
    for number in np.intersect1d(traces.recording, other.recording):
        here, there = traces.recording == number, other.recording == number
        found[here] = np.interp(traces.time_s[here], other.time_s[there], other.acceleration[there])
    return found


def running_time(traces: Traces) -> Array:
    """Seconds (N,) since the first sample, one recording after the other."""
    steps = np.diff(traces.time_s, prepend=traces.time_s[0])
    first = np.flatnonzero(np.diff(traces.file)) + 1
    steps[first] = np.median(steps)
    return np.asarray(np.cumsum(steps))


def correlation_ratio(residual: Array, group: NDArray[np.intp]) -> float:
    """Share of the variance between groups of samples, adjusted for their number."""
    _, index, count = np.unique(group, return_inverse=True, return_counts=True)
    free = len(residual) - len(count)
    if free <= 0 or np.ptp(residual) == 0.0:
        return 0.0
    means = np.bincount(index, weights=residual) / count
    within = float(np.sum((residual - means[index]) ** 2)) / free
    return round(max(0.0, 1.0 - within / float(np.var(residual, ddof=1))), 4)


def _bins(values: Array, bins: int) -> NDArray[np.intp]:
    """Numbers of bins that hold equally many samples."""
    rank = np.argsort(np.argsort(values, kind="stable"), kind="stable")
    return np.asarray(rank * bins // max(len(values), 1))

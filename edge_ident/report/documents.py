"""Identification, gains and simulation as JSON documents."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from edge_ident.estimation.trust import Finding
from edge_ident.identification import result
from edge_ident.model.model import NORMAL_95, PARAMETERS, Estimate
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording
from edge_ident.support.documents import file_sha256, finite
from edge_ident.support.version import VERSION

if TYPE_CHECKING:
    from edge_ident.control.gain_design import GainDesign
    from edge_ident.diagnosis.result import AxisDiagnosis, Cause


def identification_document(identification: result.Identification) -> dict[str, Any]:
    """Schema edge-ident/identification/2."""
    return {
        "schema": "edge-ident/identification/2",
        "axes": {name: _axis(axis) for name, axis in identification.axes.items()},
        "trusted": identification.trusted,
        "timing_ms": {name: round(ms, 3) for name, ms in identification.timing_ms.items()},
    }


def _axis(axis: result.AxisIdentification) -> dict[str, Any]:
    network = None if axis.network is None else estimate_document(axis.network, axis.units)
    curve = axis.friction_curve
    return {
        "parameters": _parameters(axis),
        "physical": _with_known(estimate_document(axis.estimate, axis.units), axis.known),
        "effective": _effective(axis),
        "friction_curve": None if curve is None else friction_document(curve),
        "parameters_from": axis.source.value,
        "parameters_reason": axis.reason,
        "model_error": dict(zip(PARAMETERS, axis.model_error.tolist(), strict=True)),
        "base": _base(axis),
        "diagnosis": _short_diagnosis(axis.diagnosis),
        "budget": None if axis.budget is None else axis.budget.document(),
        "adequacy": {
            "adequate": axis.adequacy.adequate,
            "reason": axis.adequacy.reason,
            "relative_residual": axis.adequacy.relative_residual,
            "noise_ratio": axis.adequacy.noise_ratio,
            "cutoff_hz": axis.adequacy.cutoff_hz,
        },
        "timing": dataclasses.asdict(axis.timing),
        "estimators": {
            "cnn": network,
            "least_squares": estimate_document(axis.least_squares, axis.units),
            "whitened_least_squares": estimate_document(axis.whitened, axis.units),
        },
        "cnn_reason": axis.network_reason,
        "metric": dataclasses.asdict(axis.metric),
        "assumed_effects": list(axis.compensated_effects),
        "cutoff_hz": axis.cutoff_hz,
        "moved_up_to_hz": axis.moved_up_to_hz,
        "condition_number": finite(axis.condition_number),
        "trusted": axis.trusted,
        "consistent": axis.consistent,
        "warnings": [dataclasses.asdict(finding) for finding in axis.findings],
    }


def friction_document(curve: result.FrictionCurve) -> dict[str, Any]:
    """Efforts over speed by direction, with their bands."""
    return {
        "speed": {"values": curve.speed.tolist(), "unit": curve.speed_unit},
        **{
            way: {
                "values": effort.tolist(),
                "low": (effort - curve.deviation).tolist(),
                "high": (effort + curve.deviation).tolist(),
            }
            for way, effort in (("forward", curve.forward), ("backward", curve.backward))
        },
        "coverage": 0.9,
        "unit": curve.unit,
    }


def _parameters(axis: result.AxisIdentification) -> dict[str, Any]:
    """What is known best. Friction that trades places among the terms of the model is the line; its
    numbers belong together, and are all of one kind."""
    effective = axis.line is not None and axis.known != axis.effective_known
    best, known = (
        (axis.effective, axis.effective_known) if effective else (axis.estimate, axis.known)
    )
    entries = _with_known(estimate_document(best, axis.units), known)
    first = PARAMETERS[0]
    return {
        name: {**entry, "kind": "effective" if effective and name != first else "physical"}
        for name, entry in entries.items()
    }


def _with_known(entries: dict[str, Any], known: tuple[bool, ...]) -> dict[str, Any]:
    """Entries of parameters, and whether each is known."""
    return {name: {**entries[name], "known": known[i]} for i, name in enumerate(PARAMETERS)}


def _effective(axis: result.AxisIdentification) -> dict[str, Any]:
    """Friction as a line: that through the friction curve, or the parameters where it is one."""
    entries = _with_known(estimate_document(axis.effective, axis.units), axis.effective_known)
    source = "parameters" if axis.line is None else "line_through_friction_curve"
    friction = {
        name: {**entry, "interval": _interval(entry["value"], entry["std"])}
        for name, entry in list(entries.items())[1:]
    }
    return {"from": source, **friction}


def _interval(value: float, std: float) -> list[float | None]:
    """The ends of a 95 % interval."""
    return [finite(value - NORMAL_95 * std), finite(value + NORMAL_95 * std)]


def _base(axis: result.AxisIdentification) -> dict[str, Any] | None:
    """The base model's parameters, where the answer is another model's."""
    if axis.source is not result.ParameterSource.EXTENDED_MODEL:
        return None
    return {"parameters": estimate_document(axis.least_squares, axis.units)}


def _short_diagnosis(diagnosis: "AxisDiagnosis | None") -> dict[str, Any] | None:
    """Verdict, causes and curves; all of it is what `diagnose` prints."""
    if diagnosis is None:
        return None
    return {
        "verdict": diagnosis.verdict.value,
        "explained_share": diagnosis.explained_share,
        **{
            kind: [_cause(cause, diagnosis) for cause in causes]
            for kind, causes in (
                ("causes", diagnosis.causes),
                ("suspected", diagnosis.suspected),
                ("minor", diagnosis.minor),
            )
        },
        "curves": [curve.document() for curve in diagnosis.curves],
        "noise_floor": diagnosis.noise_floor,
        "relative_residual": diagnosis.extended.fitted,
    }


def _cause(cause: "Cause", diagnosis: "AxisDiagnosis") -> dict[str, Any]:
    from edge_ident.model.model_files import values_document

    return {
        "effect": cause.term.effect,
        "parameters": values_document(cause.term, diagnosis.model),
        "share": cause.share,
        "evidence": cause.evidence,
    }


def estimate_document(estimate: Estimate, units: Sequence[str]) -> dict[str, Any]:
    """Parameters with their deviations and units."""
    return {
        name: {
            "value": float(estimate.parameters[i]),
            "std": float(estimate.std[i]),
            "unit": units[i],
        }
        for i, name in enumerate(PARAMETERS)
    }


def gains_document(
    identification: result.Identification, designs: Mapping[str, "GainDesign"]
) -> dict[str, Any]:
    """Schema edge-ident/gains/1: designs by axis, empty where the data contradict themselves."""
    return {
        "schema": "edge-ident/gains/1",
        "axes": {name: design_document(design) for name, design in designs.items()},
        "identification": identification_document(identification),
    }


def design_document(design: "GainDesign") -> dict[str, Any]:
    """Gains of one axis with their margins; an infinite gain margin is null."""
    return {
        "gains": dataclasses.asdict(design.gains),
        "bandwidth_rad_s": design.bandwidth_rad_s,
        "phase_margin_deg": design.phase_margin_deg,
        "gain_margin": finite(design.gain_margin),
        "quantization_effort_nm": design.quantization_effort_nm,
        "used": [dataclasses.asdict(used) for used in design.used],
        "not_used": [dataclasses.asdict(unused) for unused in design.unused],
        "feedback_kept": design.kept or None,
    }


def simulation_document(
    recording: Recording,
    file: Path,
    model: str,
    motion: str,
    seed: int,
    left: Mapping[str, Sequence[Finding]],
) -> dict[str, Any]:
    """Schema edge-ident/simulation/1: what was simulated and where it lies.

    `left` tells of each axis where it leaves the range in which the model was supported.
    """
    return {
        "schema": "edge-ident/simulation/1",
        "file": str(file),
        "sha256": file_sha256(file),
        "model": model,
        "motion": motion,
        "seed": seed,
        "samples": len(recording.time_s),
        "period_s": float(np.mean(np.diff(recording.time_s))),
        "axes": {
            name: {
                "tracking_rms": rms(axis.position - axis.reference),
                "effort_rms": rms(axis.effort),
                "position_unit": axis.position_unit,
                "effort_unit": axis.effort_unit,
                "warnings": [dataclasses.asdict(finding) for finding in left.get(name, ())],
            }
            for name, axis in recording.axes.items()
            if axis.reference is not None
        },
        "version": VERSION,
    }

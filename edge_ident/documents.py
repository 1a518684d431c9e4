"""The JSON documents that scripts outside the project rely on (schemas edge-ident/*/1)."""

import dataclasses
import json
import math
from collections.abc import Mapping
from typing import Any

from edge_ident.gain_design import GainDesign
from edge_ident.identification import AxisIdentification, Identification
from edge_ident.model import PARAMETERS, Estimate
from edge_ident.trust import Finding


def to_json(document: Mapping[str, Any]) -> str:
    """One document, readable and with numbers that any parser takes (no NaN)."""
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False)


def identification_document(identification: Identification) -> dict[str, Any]:
    """Schema edge-ident/identification/1."""
    return {
        "schema": "edge-ident/identification/1",
        "axes": {name: _axis(axis) for name, axis in identification.axes.items()},
        "trusted": identification.trusted,
        "timing_ms": {name: round(ms, 3) for name, ms in identification.timing_ms.items()},
    }


def _axis(axis: AxisIdentification) -> dict[str, Any]:
    network = None if axis.network is None else _estimate(axis.network, axis.units)
    return {
        "parameters": _estimate(axis.estimate, axis.units),
        "parameters_from": {"estimator": axis.source, "reason": axis.reason},
        "estimators": {"cnn": network, "least_squares": _estimate(axis.least_squares, axis.units)},
        "cnn_reason": axis.network_reason,
        "metric": {
            "time_spectral": axis.metric.time_spectral,
            "fit": axis.metric.fit,
            "relative_residual": axis.metric.relative_residual,
        },
        "cutoff_hz": axis.cutoff_hz,
        "condition_number": axis.condition_number,
        "trusted": axis.trusted,
        "warnings": [finding_document(finding) for finding in axis.findings],
    }


def _estimate(estimate: Estimate, units: tuple[str, ...]) -> dict[str, Any]:
    return {
        name: {
            "value": float(estimate.parameters[i]),
            "std": float(estimate.std[i]),
            "unit": units[i],
        }
        for i, name in enumerate(PARAMETERS)
    }


def finding_document(finding: Finding) -> dict[str, Any]:
    """One warning; `blocks` tells whether it forbids acting on the result."""
    return {
        "code": finding.code,
        "message": finding.message,
        "next_step": finding.next_step,
        "blocks": finding.blocks,
    }


def gains_document(
    identification: Identification, designs: Mapping[str, GainDesign]
) -> dict[str, Any]:
    """Schema edge-ident/gains/1: designs by axis, empty where the identification is not trusted."""
    return {
        "schema": "edge-ident/gains/1",
        "axes": {name: design_document(design) for name, design in designs.items()},
        "identification": identification_document(identification),
    }


def design_document(design: GainDesign) -> dict[str, Any]:
    """Gains of one axis and what they promise; an infinite gain margin is null."""
    return {
        "gains": dataclasses.asdict(design.gains),
        "bandwidth_rad_s": design.bandwidth_rad_s,
        "phase_margin_deg": design.phase_margin_deg,
        "gain_margin": design.gain_margin if math.isfinite(design.gain_margin) else None,
        "quantization_effort_nm": design.quantization_effort_nm,
    }

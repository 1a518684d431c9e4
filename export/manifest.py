"""The manifest of exported networks: what they are, what they can do, and their hashes."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from edge_ident.estimation.manifest import SCHEMA, Evaluation, Manifest, NetworkMotion, Variant
from edge_ident.model.model import PARAMETERS, effect_names
from export.configuration import Configuration
from export.motion import TrainingMotion

MISMATCH_LIMIT: Final = 0.3
"""Largest motion mismatch at which the network's accuracy was checked (docs/network.md)."""


def describe(
    configuration: Configuration, motion: TrainingMotion, contents: Mapping[Variant, bytes]
) -> Manifest:
    """A manifest without figures.

    Parameters
    ----------
    configuration : Configuration
        That the network was trained with.
    motion : TrainingMotion
    contents : mapping
        Bytes of each variant's file.
    """
    start = configuration.start_shares
    return Manifest(
        normalization=configuration.normalization,
        sha256={name: hashlib.sha256(content).hexdigest() for name, content in contents.items()},
        configuration=asdict(configuration),
        motion=NetworkMotion(
            period_s=len(motion.position) * motion.period_s,
            regressor=motion.scaled_regressor(configuration.points) * motion.column_scales,
            column_scales=motion.column_scales,
            position_unit=motion.position_unit,
            effort_unit=motion.effort_unit,
            effects=() if motion.known is None else effect_names(motion.known),
        ),
        mismatch_limit=MISMATCH_LIMIT,
        start_shares=None if start is None else np.array(start),
        parameter_std=dict.fromkeys(contents, np.zeros(len(PARAMETERS))),
        parameter_std_per_residual=np.zeros(len(PARAMETERS)),
        evaluation=(),
    )


def with_figures(
    manifest: Manifest, evaluation: tuple[Evaluation, ...], std_per_residual: np.ndarray
) -> Manifest:
    """Add the evaluation, and the standard deviations that follow from it."""
    by_name = {figures.name: figures for figures in evaluation}
    base = by_name["noisy"].share_error_rms
    std = {"fp32": base}
    if "noisy_int8" in by_name:
        std["int8"] = np.maximum(base, by_name["noisy_int8"].share_error_rms)
    return replace(
        manifest,
        evaluation=evaluation,
        parameter_std=std,
        parameter_std_per_residual=std_per_residual,
    )


def write(manifest: Manifest, path: Path) -> None:
    """Write a manifest as JSON."""
    fields: dict[str, Any] = {"schema": SCHEMA, **asdict(manifest)}
    motion = fields["motion"]
    fields["motion"] = {"columns" if name == "regressor" else name: motion[name] for name in motion}
    path.write_text(json.dumps(fields, indent=1, default=np.ndarray.tolist) + "\n")

"""The manifest of exported networks: what they are, what they can do, and their hashes."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from edge_ident.model import PARAMETERS
from edge_ident.network import SCHEMA, Evaluation, Manifest, NetworkMotion
from export.configuration import Configuration
from export.data import Batches
from export.evaluate import UNEXPLAINED_RESIDUAL
from export.motion import PERIOD_S, SAMPLES, column_scales, motion_columns

MISMATCH_LIMIT: Final = 0.3
"""Largest motion mismatch at which the error stays below 6 % on nine drives of ten."""
RANGE_EXAMPLES: Final = 10_000


def describe(configuration: Configuration, contents: Mapping[str, bytes]) -> Manifest:
    """A manifest without figures.

    Parameters
    ----------
    configuration : Configuration
        That the network was trained with.
    contents : mapping
        Bytes of each variant's file.
    """
    rng = np.random.default_rng(configuration.seed)
    _, truth, guess = Batches(configuration).examples(rng, RANGE_EXAMPLES)
    return Manifest(
        normalization=configuration.normalization,
        sha256={name: hashlib.sha256(content).hexdigest() for name, content in contents.items()},
        configuration=asdict(configuration),
        motion=NetworkMotion(
            period_s=SAMPLES * PERIOD_S,
            columns=motion_columns(1.0, 0.0),
            column_scales=column_scales(),
        ),
        mismatch_limit=MISMATCH_LIMIT,
        guess_range=(float(guess.min()), float(guess.max())),
        share_range=(float(truth.min()), float(truth.max())),
        parameter_std=dict.fromkeys(contents, np.zeros(len(PARAMETERS))),
        parameter_std_per_residual=np.zeros(len(PARAMETERS)),
        evaluation=(),
    )


def with_figures(manifest: Manifest, evaluation: tuple[Evaluation, ...]) -> Manifest:
    """Add the evaluation, and the standard deviations that follow from it."""
    by_name = {figures.name: figures for figures in evaluation}
    base = by_name["noisy"].share_error_rms
    coarse = np.maximum(base, by_name["noisy_int8"].share_error_rms)
    added = np.sqrt(np.maximum(by_name["unexplained"].share_error_rms ** 2 - base**2, 0.0))
    return replace(
        manifest,
        evaluation=evaluation,
        parameter_std={"fp32": base, "int8": coarse},
        parameter_std_per_residual=added / UNEXPLAINED_RESIDUAL,
    )


def write(manifest: Manifest, path: Path) -> None:
    """Write a manifest as JSON."""
    fields: dict[str, Any] = {"schema": SCHEMA, **asdict(manifest)}
    path.write_text(json.dumps(fields, indent=1, default=np.ndarray.tolist) + "\n")

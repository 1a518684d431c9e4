"""The header by which the reference firmware knows a network: its motion, as constants."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from edge_ident.estimation.manifest import Manifest
from edge_ident.estimation.network_estimate import why_not_on_a_board
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.metrics import POINTS
from edge_ident.signals.one_period import ALIGNED_HARMONICS, KnownMotion
from edge_ident.support.version import VERSION
from export.c_source.arrays import Array
from export.c_source.rendering import templates
from firmware_interface.board_identification import network_code

FILE: Final = "identification_network.h"


def identification_header(manifest: Manifest, name: str, file: str) -> str | None:
    """The text of the header, or None where a board cannot identify with this network.

    Parameters
    ----------
    manifest : Manifest
    name, file : str
        Of the network in C, and of its ONNX file.
    """
    if why_not_on_a_board(manifest):
        return None
    arrays = list(_arrays(manifest))
    facts = {
        "name": name,
        "file": file,
        "version": VERSION,
        "code": f"{network_code(manifest.sha256['int8']):#010x}",
        "points": POINTS,
        "parameters": len(PARAMETERS),
        "harmonics": ALIGNED_HARMONICS,
        "period_s": np.float64(manifest.motion.period_s),
        "acceleration_rms": np.float64(KnownMotion.of(manifest.motion.regressor).acceleration_rms),
        "mismatch_limit": np.float64(manifest.mismatch_limit),
        "arrays": arrays,
        "constants_bytes": sum(array.values.nbytes for _, array in arrays),
    }
    return templates().get_template("identification.h.jinja").render(facts)


def _arrays(manifest: Manifest) -> Iterator[tuple[str, Array]]:
    motion, start = manifest.motion, manifest.start_shares
    assert start is not None
    scaled = motion.regressor / motion.column_scales
    velocity = KnownMotion.of(motion.regressor).harmonics
    norms = np.linalg.norm(motion.regressor, axis=0)
    for comment, name, values in (
        ("harmonics of its velocity from the first on: real parts, imaginary parts",
         "velocity", np.stack([velocity.real, velocity.imag])),
        ("acceleration, velocity, its sign and one, SI", "regressor", motion.regressor.T),
        ("the norms of these", "norms", norms),
        ("peaks of the same at the full rate", "scales", motion.column_scales),
        ("pseudo-inverse of the columns over their scales", "inverse", np.linalg.pinv(scaled)),
        ("shares from which the loop starts", "start", start),
        ("effort at these, over its scale", "start_effort", scaled @ start),
    ):  # fmt: skip
        yield comment, Array(f"network_{name}", np.asarray(values, dtype=np.float64))

"""The manifest of a network: its motion, its accuracy, the hashes of its files."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from edge_ident.errors import ModelError
from edge_ident.estimation.image import Normalization
from edge_ident.model.model import PARAMETERS, Array
from edge_ident.signals.metrics import POINTS
from edge_ident.support import documents
from edge_ident.support.words import brief

Variant = Literal["fp32", "int8"]
Graph = Literal["rank_one", "image"]
"""What a network reads: both efforts, or the image that they make."""

BUILT_IN: Final = Path(__file__).parents[1] / "networks" / "feed_drive.json"
SCHEMA: Final = "edge-ident/network/2"
VARIANTS: Final[tuple[Variant, ...]] = ("fp32", "int8")
GRAPHS: Final[tuple[Graph, ...]] = ("rank_one", "image")
_SHA256: Final = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class NetworkMotion:
    """The motion that a network was trained for.

    Attributes
    ----------
    period_s : float
    regressor : (100, 4) array
        Subsampled, SI; "columns" in the manifest's file.
    column_scales : (4,) array
        Peaks of the full-rate columns: a parameter times its scale over the effort's scale is
        its share.
    position_unit, effort_unit : str
    effects : tuple of str
        Effects that all drives of training had: the network takes an effort that is not
        compensated for them.
    """

    period_s: float
    regressor: Array
    column_scales: Array
    position_unit: str
    effort_unit: str
    effects: tuple[str, ...] = ()


@dataclass(frozen=True)
class Evaluation:
    """Figures of one set of unseen drives, as fractions.

    Attributes
    ----------
    name : str
    drives : int
    residual_median, residual_p90 : float
        Torque of the result against the noise-free torque, ‖error‖/‖torque‖.
    share_error_rms, share_error_median, share_error_p95 : (4,) arrays
        Errors of the shares, in the order of `PARAMETERS`.
    """

    name: str
    drives: int
    residual_median: float
    residual_p90: float
    share_error_rms: Array
    share_error_median: Array
    share_error_p95: Array


@dataclass(frozen=True)
class Manifest:
    """What is known about a network's files.

    Attributes
    ----------
    normalization : {"effort-scale", "min-max"}
    sha256 : mapping
        Of each variant's file.
    configuration : mapping
        Of the training run, seed included.
    motion : NetworkMotion
    mismatch_limit : float
        Largest `motion_mismatch` (`edge_ident.estimation.network_estimate`) at which the network
        keeps its accuracy.
    start_shares : (4,) array or None
        Where the loop starts, if the network reads from remainders. None means random starts, and
        images of guess and measurement.
    parameter_std : mapping of (4,) arrays
        Of each variant: standard deviation of the shares on drives that the model describes.
    parameter_std_per_residual : (4,) array
        What the relative residual adds to it, times the relative residual.
    evaluation : tuple of Evaluation
    """

    normalization: Normalization
    sha256: Mapping[str, str]
    configuration: Mapping[str, Any]
    motion: NetworkMotion
    mismatch_limit: float
    start_shares: Array | None
    parameter_std: Mapping[str, Array]
    parameter_std_per_residual: Array
    evaluation: tuple[Evaluation, ...]


def load_manifest(path: Path) -> Manifest:
    """Read a manifest.

    Raises
    ------
    ModelError
        If it is missing, malformed or of another schema.
    """
    try:
        fields = documents.from_json(read_content(path, documents.MOST_DOCUMENT_BYTES))
        if fields["schema"] != SCHEMA:
            raise ValueError(f"schema is {brief(fields['schema'])}, not {SCHEMA}")
        return _manifest(fields)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        what = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise ModelError(
            f"{path}: not a network's manifest: {what}", "export the network again"
        ) from error


def _manifest(fields: dict[str, Any]) -> Manifest:
    motion, start = fields["motion"], fields["start_shares"]
    if fields["normalization"] not in ("effort-scale", "min-max"):
        raise ValueError(f"unknown normalization {brief(fields['normalization'])}")
    return Manifest(
        normalization=fields["normalization"],
        sha256=_hashes(fields["sha256"]),
        configuration=dict(fields["configuration"]),
        motion=NetworkMotion(
            period_s=float(motion["period_s"]),
            regressor=_array(motion["columns"], (POINTS, len(PARAMETERS))),
            column_scales=_array(motion["column_scales"], (len(PARAMETERS),)),
            position_unit=str(motion["position_unit"]),
            effort_unit=str(motion["effort_unit"]),
            effects=tuple(str(name) for name in motion.get("effects", ())),
        ),
        mismatch_limit=float(fields["mismatch_limit"]),
        start_shares=None if start is None else _array(start, (len(PARAMETERS),)),
        parameter_std={
            variant: _array(fields["parameter_std"][variant], (len(PARAMETERS),))
            for variant in fields["sha256"]
        },
        parameter_std_per_residual=_array(fields["parameter_std_per_residual"], (len(PARAMETERS),)),
        evaluation=tuple(_evaluation(entry) for entry in fields["evaluation"]),
    )


def _hashes(given: Mapping[str, Any]) -> dict[str, str]:
    for variant, sha256 in given.items():
        if not isinstance(sha256, str) or not _SHA256.fullmatch(sha256):
            raise ValueError(f"sha256 of {variant} is {brief(sha256)}, not 64 hexadecimal digits")
    return dict(given)


def _evaluation(fields: dict[str, Any]) -> Evaluation:
    arrays = {
        name: _array(value, (len(PARAMETERS),))
        for name, value in fields.items()
        if isinstance(value, list)
    }
    return Evaluation(**{**fields, **arrays})


def _array(values: list[Any], shape: tuple[int, ...]) -> Array:
    array = np.array(values, dtype=np.float64)
    if array.shape != shape or not np.all(np.isfinite(array)):
        raise ValueError(f"expected finite numbers of shape {shape}, found {array.shape}")
    return array


def variant_named(name: str) -> Variant:
    """The variant of that name.

    Raises
    ------
    ModelError
        If there is none.
    """
    for variant in VARIANTS:
        if variant == name:
            return variant
    raise ModelError(f"there is no variant {name}", f"choose {' or '.join(VARIANTS)}")


def read_content(path: Path, most: int = documents.MOST_NETWORK_BYTES) -> bytes:
    """The bytes of a network's file or of its manifest.

    Raises
    ------
    ModelError
        If it cannot be read, or has more than the most.
    """
    try:
        return documents.read_bytes(path, most)
    except documents.TooLargeError as error:
        raise ModelError(f"{path}: {error}", "export the network again") from error
    except OSError as error:
        raise ModelError(
            f"{path}: cannot be read ({error.strerror})",
            "give an existing .onnx file with its .json manifest in the same folder",
        ) from error

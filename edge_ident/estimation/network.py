"""The trained network at run time: manifest, hash, session."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.estimation.image import Normalization
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.dct import POINTS

Array = NDArray[np.float64]
Variant = Literal["fp32", "int8"]

SCHEMA: Final = "edge-ident/network/2"
VARIANTS: Final[tuple[Variant, ...]] = ("fp32", "int8")
BUILT_IN: Final = Path(__file__).parents[1] / "networks" / "feed_drive.json"

_IMAGE_SHAPE: Final = [1, POINTS, POINTS]
_OUTPUT_MARGIN: Final = 1e-6
"""Distance that outputs keep from 0 and 1, where the inverse sigmoid has no value."""


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


class Network:
    """A network that is ready to run.

    Attributes
    ----------
    manifest : Manifest
    variant : {"fp32", "int8"}
    sha256 : str
        Of the file that was loaded.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.load_network().manifest.motion.effort_unit
    'N*m'
    """

    def __init__(self, content: bytes, manifest: Manifest, variant: Variant) -> None:
        self.manifest = manifest
        self.variant = variant
        self.sha256 = hashlib.sha256(content).hexdigest()
        self._session = _open_session(content)
        self._input = self._session.get_inputs()[0].name
        self.residual_shares(np.zeros((1, *_IMAGE_SHAPE), dtype=np.float32))  # warm up

    def residual_shares(self, images: NDArray[np.float32]) -> Array:
        """Guess minus truth, in shares.

        Parameters
        ----------
        images : (n, 1, 100, 100) float32 array
            From `edge_ident.estimation.image.effort_image`.

        Returns
        -------
        (n, 4) array
        """
        (outputs,) = self._session.run(None, {self._input: images})
        clipped = np.clip(outputs.astype(np.float64), _OUTPUT_MARGIN, 1.0 - _OUTPUT_MARGIN)
        return np.asarray(np.log(clipped / (1.0 - clipped)))


def load_network(variant: Variant = "fp32", path: str | Path | None = None) -> Network:
    """Load the network of the package, or another one with its manifest beside it.

    Parameters
    ----------
    variant : {"fp32", "int8"}
        Of the package's network; a path names its own.
    path : str or Path, optional
        `NAME_fp32.onnx` or `NAME_int8.onnx`, with `NAME.json` in the same folder.

    Returns
    -------
    Network

    Raises
    ------
    ModelError
        If a file is missing or malformed, the network fails its hash, or it does not take a
        100x100 image to four outputs.

    Examples
    --------
    >>> import edge_ident
    >>> network = edge_ident.load_network()
    >>> found = edge_ident.identify(edge_ident.simulate(), network)
    >>> found.axes["x"].network is not None
    True
    """
    if path is not None:
        path = Path(path)
        variant = _variant_of(path)
        manifest_path = path.with_name(path.stem.removesuffix(f"_{variant}") + ".json")
    else:
        manifest_path = BUILT_IN
        path = BUILT_IN.with_name(f"{BUILT_IN.stem}_{variant}.onnx")
    manifest = load_manifest(manifest_path)
    content = _read(path)
    if hashlib.sha256(content).hexdigest() != manifest.sha256.get(variant):
        raise ModelError(
            f"{path}: fails its hash: it is not the file that {manifest_path.name} describes",
            "copy network and manifest again, both from the same export",
        )
    return Network(content, manifest, variant)


def load_manifest(path: Path) -> Manifest:
    """Read a manifest.

    Raises
    ------
    ModelError
        If it is missing, malformed or of another schema.
    """
    try:
        fields = json.loads(_read(path))
        if fields["schema"] != SCHEMA:
            raise ValueError(f"schema is {fields['schema']}, not {SCHEMA}")
        return _manifest(fields)
    except (KeyError, TypeError, ValueError) as error:
        what = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise ModelError(
            f"{path}: not a network's manifest: {what}", "export the network again"
        ) from error


def _manifest(fields: dict[str, Any]) -> Manifest:
    motion, start = fields["motion"], fields["start_shares"]
    if fields["normalization"] not in ("effort-scale", "min-max"):
        raise ValueError(f"unknown normalization '{fields['normalization']}'")
    return Manifest(
        normalization=fields["normalization"],
        sha256=dict(fields["sha256"]),
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
            for variant in VARIANTS
        },
        parameter_std_per_residual=_array(fields["parameter_std_per_residual"], (len(PARAMETERS),)),
        evaluation=tuple(_evaluation(entry) for entry in fields["evaluation"]),
    )


def _evaluation(fields: dict[str, Any]) -> Evaluation:
    arrays = {name: np.array(value) for name, value in fields.items() if isinstance(value, list)}
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


def _variant_of(path: Path) -> Variant:
    for variant in VARIANTS:
        if path.stem.endswith(f"_{variant}"):
            return variant
    raise ModelError(
        f"{path}: the name does not say which variant it is", "call it NAME_fp32 or NAME_int8"
    )


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ModelError(
            f"{path}: cannot be read ({error.strerror})",
            "name an existing .onnx file with its .json manifest beside it",
        ) from error


def _open_session(content: bytes) -> onnxruntime.InferenceSession:
    """A session on one thread; bytes, so that a file cannot refer to others beside it."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL
    options.log_severity_level = 4
    try:
        session = onnxruntime.InferenceSession(content, options, ["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's exceptions have no common base
        first_line = (str(error).splitlines() or [type(error).__name__])[0]
        raise ModelError(
            f"onnxruntime refuses the network: {first_line}", "export the network again"
        ) from error
    inputs, outputs = session.get_inputs(), session.get_outputs()
    signature = [(len(inputs), len(outputs)), *(list(i.shape[1:]) for i in (*inputs, *outputs))]
    if signature != [(1, 1), _IMAGE_SHAPE, [len(PARAMETERS)]]:
        raise ModelError(
            f"the network maps {inputs[0].shape} to {outputs[0].shape}, "
            f"not (n, 1, {POINTS}, {POINTS}) to (n, {len(PARAMETERS)})",
            "name a network made by edge-ident export",
        )
    return session

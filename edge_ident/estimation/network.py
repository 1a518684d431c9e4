"""The trained network at run time: hash and session."""

import hashlib
from pathlib import Path
from typing import Final

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.estimation.manifest import VARIANTS, Manifest, Variant, load_manifest, read_content
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.dct import POINTS

Array = NDArray[np.float64]

BUILT_IN: Final = Path(__file__).parents[1] / "networks" / "feed_drive.json"

_IMAGE_SHAPE: Final = [1, POINTS, POINTS]
_OUTPUT_MARGIN: Final = 1e-6
"""Distance that outputs keep from 0 and 1, where the inverse sigmoid has no value."""


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
    content = read_content(path)
    if hashlib.sha256(content).hexdigest() != manifest.sha256.get(variant):
        raise ModelError(
            f"{path}: has the wrong hash: it is not the file that {manifest_path.name} describes",
            "copy network and manifest again, both from the same export",
        )
    return Network(content, manifest, variant)


def _variant_of(path: Path) -> Variant:
    for variant in VARIANTS:
        if path.stem.endswith(f"_{variant}"):
            return variant
    raise ModelError(
        f"{path}: the name does not contain the variant", "call it NAME_fp32 or NAME_int8"
    )


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
            "give a network made by edge-ident export",
        )
    return session

"""From a checkpoint to the files that ship: two ONNX networks and their manifest."""

import logging
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np
import onnx
import torch
from numpy.typing import NDArray

from edge_ident.dct import POINTS
from edge_ident.errors import ModelError
from edge_ident.image import effort_image
from edge_ident.network import VARIANTS, Network, load_network
from export.checkpoint import trained_network
from export.configuration import Configuration
from export.data import Batches, tensor
from export.evaluate import clean_drives, evaluate_all, identified, shares
from export.manifest import describe, with_figures, write
from export.network import ResidualNetwork
from export.quantization import quantize

NAME: Final = "feed_drive"
PARITY: Final = 1e-5
"""Largest difference of outputs between torch and onnxruntime."""
INT8_LIMIT: Final = 0.01
"""Median over drives of the largest change of a share by quantization; shares range over 1."""
CALIBRATION_IMAGES: Final = 256
ROUNDING_IMAGES: Final = 4000


def export(checkpoint: Path, output: Path, on_progress: Callable[[str], None]) -> Path:
    """Write feed_drive_fp32.onnx, feed_drive_int8.onnx and feed_drive.json.

    Parameters
    ----------
    checkpoint : Path
        Of a finished training run.
    output : Path
        Folder.
    on_progress : callable
        Called with the name of each stage.

    Returns
    -------
    Path
        Of the manifest.

    Raises
    ------
    ModelError
        If the run is not finished, the exported network differs from torch's, or quantization
        moves the identified parameters too far.
    """
    network, trained = trained_network(checkpoint)
    configuration = trained.configuration
    images, features = _calibration(network, configuration)
    on_progress("exporting")
    float_model = to_onnx(network)
    on_progress("quantizing")
    models = {"fp32": float_model, "int8": clean(quantize(float_model, images, features))}
    output.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=output) as folder:  # nothing is replaced before all checks pass
        draft = Path(folder)
        contents = {variant: model.SerializeToString() for variant, model in models.items()}
        for variant, content in contents.items():
            (draft / f"{NAME}_{variant}.onnx").write_bytes(content)
        manifest = draft / f"{NAME}.json"
        described = describe(configuration, contents)
        write(described, manifest)
        fp32, int8 = (load_network(path=draft / f"{NAME}_{variant}.onnx") for variant in VARIANTS)
        check_parity(network, fp32, images)
        on_progress("evaluating")
        check_quantization(fp32, int8)
        write(with_figures(described, evaluate_all(fp32, int8)), manifest)
        for file in draft.iterdir():
            file.replace(output / file.name)
    return output / manifest.name


def to_onnx(network: ResidualNetwork) -> onnx.ModelProto:
    """The plain network, image in, sigmoid out, any number of images."""
    # the exporter warns of every optional package that is not there
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    program = torch.onnx.export(
        network,
        (torch.zeros(2, 1, POINTS, POINTS),),
        dynamo=True,
        external_data=False,
        input_names=["image"],
        output_names=["sigmoid"],
        dynamic_shapes=({0: torch.export.Dim("images")},),
        verbose=False,
    )
    return clean(program.model_proto)


def clean(model: onnx.ModelProto) -> onnx.ModelProto:
    """Remove notes: the exporter leaves paths of the machine that it ran on in them."""
    graph = model.graph
    for part in (model, graph, *graph.node, *graph.input, *graph.output, *graph.value_info):
        part.doc_string = ""
        del part.metadata_props[:]
    for weights in graph.initializer:
        weights.doc_string = ""
        del weights.metadata_props[:]
    onnx.checker.check_model(model)
    return model


def check_parity(network: ResidualNetwork, exported: Network, images: NDArray[np.float32]) -> None:
    """Compare onnxruntime's outputs with torch's.

    Raises
    ------
    ModelError
        If they differ by more than rounding.
    """
    with torch.no_grad():
        wanted = network(torch.from_numpy(images)).numpy()
    found = 1.0 / (1.0 + np.exp(-exported.residual_shares(images)))
    difference = float(np.max(np.abs(found - wanted)))
    if difference > PARITY:
        raise ModelError(
            f"the exported network differs from torch's by {difference:.1e} (limit {PARITY:.0e})",
            "use the torch and onnxruntime versions of the train extra",
        )


def check_quantization(fp32: Network, int8: Network) -> None:
    """Compare what both networks identify.

    Raises
    ------
    ModelError
        If quantization moves the parameters too far.
    """
    drives = clean_drives()
    moved = identified(int8, drives) - identified(fp32, drives)
    change = np.max(np.abs(shares(drives, moved, fp32.manifest.normalization)), axis=1)
    median = float(np.median(change))
    if median > INT8_LIMIT:
        raise ModelError(
            f"int8 moves the parameters by {median:.2%} in the median (limit {INT8_LIMIT:.0%})",
            "train longer: a network that resolves less than its quantization does not help",
        )


def _calibration(
    network: ResidualNetwork, configuration: Configuration
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Images of training drives (256, 1, 100, 100), and features (4000, 3610) of more of them."""
    batches, images, features, seen = Batches(configuration), [], [], 0
    while seen < ROUNDING_IMAGES:
        batch = batches.batch(-(10**6) - seen)
        factors = tensor(batch.model_effort), tensor(batch.measured_effort), tensor(batch.bias)
        with torch.no_grad():
            features.append(network.features(*factors).flatten(1).numpy().astype(np.float64))
        if seen < CALIBRATION_IMAGES:
            # the gain is in the factor already; the constant is what is left to add
            product = effort_image(batch.model_effort, batch.measured_effort, "effort-scale")
            images.append(product + batch.bias.astype(np.float32)[:, None, None, None])
        seen += len(batch.bias)
    return np.concatenate(images), np.concatenate(features)

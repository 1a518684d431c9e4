"""From a checkpoint to the files that ship: two ONNX networks and their manifest."""

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np
import onnx
import torch
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.estimation.image import effort_image
from edge_ident.estimation.manifest import Manifest, Variant
from edge_ident.estimation.network import Network, load_network
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.dct import POINTS
from export.checkpoint import Checkpoint, trained_network
from export.data import Batches
from export.evaluate import (
    DriveSet,
    EvaluationDrives,
    error_per_residual,
    evaluate_all,
    evaluation_drives,
    identified,
)
from export.manifest import describe, with_figures, write
from export.network import ResidualNetwork
from export.quantization import quantize
from export.rounding import with_spared_bits

PARITY: Final = 1e-5
"""Largest difference of outputs between torch and onnxruntime."""
INT8_LIMIT: Final = 0.01
"""Largest change of a share by quantization, on any drive; shares range over 1."""
CALIBRATION_IMAGES: Final = 256
ROUNDING_IMAGES: Final = 8000
BATCH: Final = 64


def export(
    checkpoint: Path, output: Path, on_progress: Callable[[str], None], *, int8: bool = True
) -> Path:
    """Write NAME_fp32.onnx, NAME_int8.onnx and NAME.json, and return the path of the last.

    NAME is that of the motion. `on_progress` is called with the name of each stage. Without `int8`
    that network is left out.

    Raises
    ------
    ModelError
        The training run is not finished, the exported network differs from torch's, or
        quantization moves the identified parameters too far.
    """
    network, trained = _trained(checkpoint)
    configuration, motion = trained.configuration, trained.motion
    on_progress("recording")
    images, features = _calibration(network, Batches(configuration, motion))
    drives = evaluation_drives(motion, POINTS)
    on_progress("exporting")
    models: dict[Variant, onnx.ModelProto] = {"fp32": to_onnx(network)}
    if int8:
        on_progress("quantizing")
        models["int8"] = clean(quantize(models["fp32"], images, features))
    models["fp32"] = with_spared_bits(models["fp32"])
    output.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=output) as folder:  # nothing is replaced before all checks pass
        draft = Path(folder)
        contents = {variant: model.SerializeToString() for variant, model in models.items()}
        described = describe(configuration, motion, contents)
        networks = _written(draft, motion.name, described, contents)
        check_parity(network, networks["fp32"], images)
        on_progress("evaluating")
        if int8:
            check_quantization(networks["fp32"], networks["int8"], drives.clean)
        write(_evaluated(described, networks, drives), draft / f"{motion.name}.json")
        for file in draft.iterdir():
            file.replace(output / file.name)
    return output / f"{motion.name}.json"


def _trained(checkpoint: Path) -> tuple[ResidualNetwork, Checkpoint]:
    network, trained = trained_network(checkpoint)
    points = trained.configuration.points
    if points != POINTS:
        raise ModelError(
            f"{checkpoint}: takes images of {points} points",
            f"train with {POINTS}: the runtime knows no other",
        )
    return network, trained


def _written(
    folder: Path, name: str, manifest: Manifest, contents: Mapping[Variant, bytes]
) -> dict[Variant, Network]:
    """The networks, written with their manifest and loaded as the runtime does."""
    for variant, content in contents.items():
        (folder / f"{name}_{variant}.onnx").write_bytes(content)
    write(manifest, folder / f"{name}.json")
    return {of: load_network(path=folder / f"{name}_{of}.onnx") for of in contents}


def _evaluated(
    manifest: Manifest, networks: Mapping[Variant, Network], drives: EvaluationDrives
) -> Manifest:
    """The manifest with the networks' figures."""
    evaluation = evaluate_all(networks, drives)
    noisy = next(figures for figures in evaluation if figures.name == "noisy")
    growth = error_per_residual(networks["fp32"], drives.disturbed, noisy.share_error_rms)
    return with_figures(manifest, evaluation, growth)


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
    assert program is not None
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


def check_quantization(fp32: Network, int8: Network, drives: DriveSet) -> None:
    """Compare what both networks identify.

    Raises
    ------
    ModelError
        If quantization moves a parameter of any drive by more than 1 % of its range.
    """
    moved = drives.shares(identified(int8, drives) - identified(fp32, drives))
    worst = float(np.max(np.abs(moved)))
    if worst > INT8_LIMIT:
        name = PARAMETERS[int(np.argmax(np.max(np.abs(moved), axis=0)))]
        raise ModelError(
            f"int8 moves the {name} of a drive by {worst:.2%} of its range "
            f"(limit {INT8_LIMIT:.0%})",
            "train longer, or leave the int8 network out: --no-int8",
        )


def _calibration(
    network: ResidualNetwork, batches: Batches
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Images of training drives (256, 1, 100, 100), and features (8000, 3610) of more of them."""
    images, features = [], []
    for number in range(ROUNDING_IMAGES // BATCH):
        batch = batches.batch("calibration", number, BATCH)
        with torch.no_grad():
            features.append(network.features(*batch.factors).flatten(1).numpy().astype(np.float64))
        if number < CALIBRATION_IMAGES // BATCH:
            # the scale is in the factor already; the offset is left to add
            product = effort_image(batch.model_effort, batch.measured_effort, "effort-scale")
            images.append(product + batch.offset.astype(np.float32)[:, None, None, None])
    return np.concatenate(images), np.concatenate(features)

"""From a checkpoint to the files that ship: two ONNX networks and their manifest."""

import logging
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np
import onnx
import torch
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.estimation.image import effort_image
from edge_ident.estimation.manifest import VARIANTS, Manifest, Variant
from edge_ident.estimation.network import Network, load_network
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.metrics import POINTS
from export.checkpoint import Checkpoint, trained_network
from export.data import Batch, Batches
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
from export.quantization import EQUALIZED_IMAGES, equalized, input_moments, quantize
from export.rounding import with_spared_bits

PARITY: Final = 1e-5
"""Largest difference of outputs between torch and onnxruntime."""
INT8_LIMIT: Final = 0.01
"""Largest change of a share by quantization, on any drive; shares range over 1."""
CALIBRATION_IMAGES: Final = 1024
ROUNDING_IMAGES: Final = 8000
BATCH: Final = 64


@dataclass(frozen=True)
class Change:
    """What quantization changes most.

    Attributes
    ----------
    parameter : str
    share : float
        Of the parameter's range, on the drive where it is largest.
    """

    parameter: str
    share: float

    @property
    def small(self) -> bool:
        """Whether the int8 network stands for the other."""
        return self.share <= INT8_LIMIT

    def __str__(self) -> str:
        text = f"int8 moves the {self.parameter} of a drive by {self.share:.2%} of its range"
        if self.small:
            return f"{text}, and no parameter by more"
        return f"{text} (limit {INT8_LIMIT:.0%}): only the fp32 network was written"


@dataclass(frozen=True)
class Exported:
    """What an export wrote.

    Attributes
    ----------
    manifest : Path
    int8 : Change or None
        What quantization changes; where that is too much, the int8 network was left out. None: it
        was not wanted.
    """

    manifest: Path
    int8: Change | None


def export(
    checkpoint: Path, output: Path, on_progress: Callable[[str], None], *, int8: bool = True
) -> Exported:
    """Write NAME_fp32.onnx, NAME_int8.onnx and NAME.json.

    NAME is that of the motion. `on_progress` is called with the name of each stage. Without `int8`,
    and where quantization moves the identified parameters too far, that network is left out, and
    one of an earlier export is removed: it does not belong to the manifest.

    Raises
    ------
    ModelError
        The training run is not finished, or the exported network differs from torch's.
    """
    network, trained = _trained(checkpoint)
    configuration, motion = trained.configuration, trained.motion
    on_progress("recording")
    batches = Batches(configuration, motion)
    images = _images(batches)
    drives = evaluation_drives(motion, POINTS)
    on_progress("exporting")
    with foreign_messages_unheard():
        models: dict[Variant, onnx.ModelProto] = {"fp32": to_onnx(network)}
        if int8:
            on_progress("quantizing")
            models["int8"] = _quantized(network, batches, images)
    models["fp32"] = with_spared_bits(models["fp32"])
    output.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=output) as folder:  # nothing is replaced before all checks pass
        draft, name = Path(folder), motion.name
        contents = {variant: model.SerializeToString() for variant, model in models.items()}
        networks = _written(draft, name, describe(configuration, motion, contents), contents)
        check_parity(network, networks["fp32"], images)
        on_progress("evaluating")
        change = largest_change(networks["fp32"], networks["int8"], drives.clean) if int8 else None
        if change is not None and not change.small:
            del networks["int8"], contents["int8"]
        described = describe(configuration, motion, contents)
        write(_evaluated(described, networks, drives), draft / f"{name}.json")
        for variant in VARIANTS:
            if variant in contents:
                (draft / f"{name}_{variant}.onnx").replace(output / f"{name}_{variant}.onnx")
            else:
                (output / f"{name}_{variant}.onnx").unlink(missing_ok=True)
        (draft / f"{name}.json").replace(output / f"{name}.json")
    return Exported(output / f"{name}.json", change)


@contextmanager
def foreign_messages_unheard() -> Iterator[None]:
    """Keep from the user what torch and the quantizer say about their own working."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        logging.disable(logging.WARNING)
        try:
            yield
        finally:
            logging.disable(logging.NOTSET)


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


def largest_change(fp32: Network, int8: Network, drives: DriveSet) -> Change:
    """Compare what both networks identify."""
    moved = np.abs(drives.shares(identified(int8, drives) - identified(fp32, drives)))
    worst = np.max(moved, axis=0)
    return Change(PARAMETERS[int(np.argmax(worst))], float(np.max(worst)))


def _quantized(
    network: ResidualNetwork, batches: Batches, images: NDArray[np.float32]
) -> onnx.ModelProto:
    """The int8 network."""
    even = equalized(network, _calibration(batches, EQUALIZED_IMAGES))
    moments = input_moments(even, _calibration(batches, ROUNDING_IMAGES))
    return clean(quantize(to_onnx(even), images, moments))


def _calibration(batches: Batches, images: int) -> Iterator[Batch]:
    """Training drives, for so many images."""
    for number in range(images // BATCH):
        yield batches.batch("calibration", number, BATCH)


def _images(batches: Batches) -> NDArray[np.float32]:
    """Images of training drives (n, 1, 100, 100)."""
    images = []
    for batch in _calibration(batches, CALIBRATION_IMAGES):
        # the scale is in the factor already; the offset is left to add
        product = effort_image(batch.model_effort, batch.measured_effort, "effort-scale")
        images.append(product + batch.offset.astype(np.float32)[:, None, None, None])
    return np.concatenate(images)

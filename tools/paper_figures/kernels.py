"""Spectra of the network's 210 kernels."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import onnx
import torch
from matplotlib.figure import Figure
from numpy.typing import NDArray
from onnx import numpy_helper

from edge_ident.errors import ModelError
from export.configuration import IMPROVED
from export.network import ResidualNetwork
from export.warm_start import look_linear
from tools.paper_figures.page import Section, Sources, percent, table

Array = NDArray[np.float64]

DENSITY: Final = 4
"""A kernel is padded with zeros to so many times its size: frequencies along each side."""
LAYERS: Final = ("first", "second", "third")


@dataclass(frozen=True)
class Layer:
    """Kernels of one convolution.

    Attributes
    ----------
    name : str
    kernels : (outputs, inputs, k, k) array
    """

    name: str
    kernels: Array

    @property
    def size(self) -> int:
        """Rows and columns of a kernel."""
        return int(self.kernels.shape[-1])

    @property
    def count(self) -> int:
        """Kernels of all outputs and inputs."""
        return int(np.prod(self.kernels.shape[:2]))

    @property
    def spectra(self) -> Array:
        """Magnitudes (outputs, inputs, R, R), frequency zero in the middle, each over its peak."""
        points = DENSITY * self.size
        magnitude = np.abs(np.fft.fft2(self.kernels, (points, points)))
        peak = np.max(magnitude, axis=(2, 3), keepdims=True)
        return np.asarray(np.fft.fftshift(magnitude / np.maximum(peak, 1e-30), axes=(2, 3)))

    @property
    def low_share(self) -> float:
        """Mean share of a kernel's energy below half the highest frequency, both ways."""
        energy = self.spectra**2
        middle = slice(self.size * DENSITY // 4, self.size * DENSITY * 3 // 4)
        low = energy[..., middle, middle].sum(axis=(2, 3))
        return float(np.mean(low / energy.sum(axis=(2, 3))))

    @property
    def smoothing_share(self) -> float:
        """Part of the kernels whose spectrum is largest within a step of frequency zero."""
        spectra = self.spectra
        flat = spectra.reshape(self.count, -1)
        place = np.stack(np.unravel_index(np.argmax(flat, axis=1), spectra.shape[2:]))
        return float(np.mean(np.all(np.abs(place - spectra.shape[-1] // 2) <= 1, axis=0)))

    def moved_from(self, start: "Layer") -> float:
        """How far training has moved the kernels, over their length."""
        return float(np.linalg.norm(self.kernels - start.kernels) / np.linalg.norm(start.kernels))


def read_layers(network: Path) -> list[Layer]:
    """The convolutions' kernels from the weights of an ONNX file.

    Raises
    ------
    ModelError
        The file is missing, or holds no such kernels in plain numbers.
    """
    try:
        weights = {i.name: i for i in onnx.load(network).graph.initializer}
        arrays = [numpy_helper.to_array(weights[f"{name}.weight"]) for name in LAYERS]
    except (OSError, KeyError) as error:
        raise ModelError(
            f"{network}: no kernels of three convolutions ({error})", "name the fp32 network"
        ) from error
    return [
        Layer(name, array.astype(np.float64)) for name, array in zip(LAYERS, arrays, strict=True)
    ]


def layers_at_start() -> list[Layer]:
    """The kernels that training of the improved configuration begins with."""
    torch.manual_seed(IMPROVED.seed)
    network = ResidualNetwork()
    look_linear(network)
    weights = network.state_dict()
    return [Layer(name, weights[f"{name}.weight"].double().numpy()) for name in LAYERS]


def section(sources: Sources) -> Section:
    """Three panels, one a layer, and how much of the kernels smooths."""
    layers = read_layers(sources.network)
    picture = sources.save(draw(layers), "kernels", "Spectra of the 210 kernels")
    count = sum(layer.count for layer in layers)
    rows = [
        [
            f"{layer.name}, {layer.count} of {layer.size}×{layer.size}",
            percent(layer.smoothing_share, 0),
            percent(layer.low_share, 0),
            percent(layer.moved_from(start), 1),
        ]
        for layer, start in zip(layers, layers_at_start(), strict=True)
    ]
    heading = ["layer", "largest at frequency zero", "energy in the lower half", "moved"]
    numbers = table(heading, rows)
    return Section(
        "Spectra of the kernels",
        "It shows the spectra of its 210 kernels after training.",
        f"Magnitudes of the two-dimensional Fourier transforms of the built-in network's {count} "
        "kernels, each over its own peak; frequency zero is in the middle of each tile, half the "
        "sampling rate at its edges. A white kernel has a quarter of its energy in the lower half "
        "of both frequencies. The last column is how far training has moved a layer's kernels, "
        f"over their length at its start.\n\n{numbers}\n\n{picture}",
        "The paper's kernels are learned from random ones. Here training begins with random "
        "kernels in pairs of opposite sign, which pass an image linearly. The first layer keeps "
        "them; the others are trained last ([network](network.md#the-training-recipe)).",
    )


def draw(layers: list[Layer]) -> Figure:
    """Mosaics of spectra; rows are a layer's outputs, columns its inputs."""
    figure = Figure(figsize=(11, 3.9), layout="constrained")
    panels = figure.subplots(1, len(layers))
    for panel, layer in zip(panels, layers, strict=True):
        tiles = layer.spectra
        if tiles.shape[1] == 1:  # ten kernels of the image itself: two rows
            tiles = tiles.reshape(2, -1, *tiles.shape[2:])
        shown = panel.imshow(_mosaic(tiles), cmap="viridis", vmin=0.0, vmax=1.0)
        panel.set_title(f"{layer.name} layer: {layer.count} of {layer.size}×{layer.size}")
        panel.set_xticks([])
        panel.set_yticks([])
        if layer.kernels.shape[1] > 1:
            panel.set_xlabel("input map")
            panel.set_ylabel("output map")
    figure.colorbar(shown, ax=panels, shrink=0.7, label="magnitude over its peak")
    return figure


def _mosaic(tiles: Array) -> Array:
    """One array of (rows, columns, R, R) tiles, with a blank line between them."""
    framed = np.pad(tiles, ((0, 0), (0, 0), (0, 1), (0, 1)), constant_values=np.nan)
    rows, columns, height, width = framed.shape
    return framed.transpose(0, 2, 1, 3).reshape(rows * height, columns * width)[:-1, :-1]

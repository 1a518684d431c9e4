"""The time of the three convolutions, for each way to compute them."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import onnx
import onnxruntime
import scipy.fft
import torch
from matplotlib.figure import Figure
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from onnx import TensorProto, helper

from tools.paper_figures.page import Section, Sources, table

Array = NDArray[np.float32]
Run = Callable[[], Array]

SEED: Final = 20_210_146
REPETITIONS: Final = 41
MAPS: Final = 10
REFERENCE: Final = "im2col"
METHODS: Final = ("direct", REFERENCE, "FFT", "torch", "onnxruntime", "rank one")


@dataclass(frozen=True)
class Layer:
    """Input and kernel of one convolution; every one has ten output maps."""

    name: str
    inputs: int
    size: int
    kernel: int

    @property
    def multiplications(self) -> int:
        """Of a convolution in plain sums."""
        return MAPS * self.inputs * (self.kernel * (self.size - self.kernel + 1)) ** 2


LAYERS: Final = (
    Layer("first, 9×9", 1, 100, 9),
    Layer("second, 5×5", MAPS, 46, 5),
    Layer("third, 3×3", MAPS, 21, 3),
)


@dataclass(frozen=True)
class Task:
    """One convolution to compute.

    Attributes
    ----------
    image : (C, N, N) float32 array
    kernels : (10, C, k, k) float32 array
    factors : (2, N) float32 array or None
        ψ and α where the image is their outer product.
    """

    image: Array
    kernels: Array
    factors: Array | None

    @classmethod
    def random(cls, layer: Layer) -> "Task":
        """Random numbers of a layer's shape; the first layer's image is an outer product."""
        rng = np.random.default_rng(SEED)
        shape = (MAPS, layer.inputs, layer.kernel, layer.kernel)
        kernels = rng.normal(size=shape).astype(np.float32)
        if layer.inputs == 1:
            factors = rng.normal(size=(2, layer.size)).astype(np.float32)
            return cls(np.outer(*factors)[None], kernels, factors)
        image = rng.normal(size=(layer.inputs, layer.size, layer.size)).astype(np.float32)
        return cls(image, kernels, None)


def direct(task: Task) -> Run:
    """Sums of products: the shifted image times one weight of every kernel, weight by weight."""
    size = task.kernels.shape[-1]
    valid = task.image.shape[-1] - size + 1

    def run() -> Array:
        maps = np.zeros((MAPS, valid, valid), dtype=task.image.dtype)
        for channel, row, column in np.ndindex(task.kernels.shape[1:]):
            part = task.image[channel, row : row + valid, column : column + valid]
            maps += task.kernels[:, channel, row, column, None, None] * part
        return maps

    return run


def im2col(task: Task) -> Run:
    """All windows of the image as columns of a matrix, then one matrix product."""
    size = task.kernels.shape[-1]
    rows = task.kernels.reshape(MAPS, -1)

    def run() -> Array:
        windows = sliding_window_view(task.image, (size, size), axis=(1, 2))
        height, width = windows.shape[1:3]
        columns = windows.transpose(0, 3, 4, 1, 2).reshape(-1, height * width)
        return np.asarray(rows @ columns).reshape(MAPS, height, width)

    return run


def by_fft(task: Task) -> Run:
    """Products of spectra; those of the kernels are made beforehand."""
    points, size = task.image.shape[-1], task.kernels.shape[-1]
    # a correlation that wraps round is wrong only where the kernel leaves the image
    shape = (scipy.fft.next_fast_len(points, real=True),) * 2
    spectra = np.conj(scipy.fft.rfft2(task.kernels, shape))
    valid = points - size + 1

    def run() -> Array:
        product = np.einsum("mcij,cij->mij", spectra, scipy.fft.rfft2(task.image, shape))
        return np.asarray(scipy.fft.irfft2(product, shape)[:, :valid, :valid])

    return run


def by_torch(task: Task) -> Run:
    """torch on the processor, one thread."""
    torch.set_num_threads(1)
    image, kernels = torch.from_numpy(task.image)[None], torch.from_numpy(task.kernels)
    return lambda: torch.nn.functional.conv2d(image, kernels)[0].numpy()


def by_onnxruntime(task: Task) -> Run:
    """The runtime of the edge, one thread."""
    weights = helper.make_tensor(
        "kernels", TensorProto.FLOAT, task.kernels.shape, task.kernels.tobytes(), raw=True
    )
    size = task.image.shape[-1] - task.kernels.shape[-1] + 1
    graph = helper.make_graph(
        [helper.make_node("Conv", ["image", "kernels"], ["maps"])],
        "convolution",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, *task.image.shape])],
        [helper.make_tensor_value_info("maps", TensorProto.FLOAT, [1, MAPS, size, size])],
        [weights],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    onnx.checker.check_model(model)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(
        model.SerializeToString(), options, ["CPUExecutionProvider"]
    )
    return lambda: session.run(None, {"image": task.image[None]})[0][0]


def rank_one(task: Task) -> Run:
    """Two matrix products on ψ and α: the image is never made."""
    assert task.factors is not None
    model, measured = task.factors
    size = task.kernels.shape[-1]
    along = task.kernels[:, 0].transpose(1, 0, 2).reshape(size, -1)

    def run() -> Array:
        left = (sliding_window_view(model, size) @ along).reshape(-1, MAPS, size)
        return np.asarray(left.transpose(1, 0, 2) @ sliding_window_view(measured, size).T)

    return run


PREPARE: Final = dict(
    zip(METHODS, (direct, im2col, by_fft, by_torch, by_onnxruntime, rank_one), strict=True)
)


@dataclass(frozen=True)
class Cost:
    """Median time of one convolution, and its largest error over the largest output."""

    time_s: float
    error: float


def measure(layer: Layer, repetitions: int) -> dict[str, Cost]:
    """Cost of every method that can compute a layer, by name.

    The methods take turns, so that what else the machine does meets all of them.
    """
    task = Task.random(layer)
    able = [name for name in METHODS if task.factors is not None or name != "rank one"]
    runs = {name: PREPARE[name](task) for name in able}
    exact = im2col(Task(task.image.astype(float), task.kernels.astype(float), None))()
    scale = float(np.max(np.abs(exact)))
    error = {name: float(np.max(np.abs(run() - exact))) / scale for name, run in runs.items()}
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repetitions):
        for name, run in runs.items():
            began_s = time.perf_counter()
            run()
            times[name].append(time.perf_counter() - began_s)
    return {name: Cost(float(np.median(times[name])), error[name]) for name in runs}


def section(sources: Sources) -> Section:
    """A bar for each method and layer, as a ratio to im2col."""
    costs = {layer: measure(layer, REPETITIONS) for layer in LAYERS}
    picture = sources.save(draw(costs), "convolutions", "Convolution time by method and layer")
    first = costs[LAYERS[0]]
    worst = max(cost.error for by_method in costs.values() for cost in by_method.values())
    rows = [
        [name, *(_cell(costs[layer], name) for layer in LAYERS), *_total(costs, name)]
        for name in METHODS
    ]
    heading = ["method", *(layer.name for layer in LAYERS), "all three"]
    millions = ", ".join(f"{layer.multiplications / 1e6:.1f}" for layer in LAYERS)
    return Section(
        "Convolution time by method and layer",
        "It shows the run time of its convolutions by method and layer on a GTX 1060 and an i7. A "
        "pass through its network takes 3.3426 ms.",
        f"Medians of {REPETITIONS} turns on one thread of a processor, float32, one image; in "
        f"brackets as ratios to {REFERENCE}. In plain sums the layers take {millions} million "
        f"multiplications. All methods agree to {worst:.0e} of the largest output.\n\n"
        f"{table(heading, rows)}\n\n{picture}",
        "The paper's times and methods are not available. Ratios hold better than times. The last "
        "row is open to this network alone: its image is an outer product, so its first layer is "
        "two small matrix products, "
        f"{first[REFERENCE].time_s / first['rank one'].time_s:.1f} times faster than {REFERENCE} "
        f"and {first['onnxruntime'].time_s / first['rank one'].time_s:.1f} times faster than "
        "onnxruntime.",
    )


def draw(costs: Mapping[Layer, Mapping[str, Cost]]) -> Figure:
    """Ratios to the reference, a group of bars for each layer."""
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    panel = figure.subplots()
    width = 0.8 / len(METHODS)
    for number, name in enumerate(METHODS):
        places, ratios = zip(
            *(
                (place + width * (number - 0.5 * (len(METHODS) - 1)), _ratio(by_method, name))
                for place, by_method in enumerate(costs.values())
                if name in by_method
            ),
            strict=True,
        )
        bars = panel.bar(places, ratios, 0.92 * width, label=name)
        labels = [f"{ratio:#.2g}".rstrip(".") for ratio in ratios]
        panel.bar_label(bars, labels, fontsize=8, padding=2)
    panel.axhline(1.0, color="k", linewidth=0.8)
    panel.set_yscale("log")
    panel.set_xticks(range(len(costs)), [f"{layer.name} layer" for layer in costs])
    panel.set_ylabel(f"time over that of {REFERENCE}")
    panel.margins(y=0.1)
    figure.legend(loc="outside upper center", ncols=len(METHODS), fontsize=9)
    return figure


def _ratio(by_method: Mapping[str, Cost], name: str) -> float:
    return by_method[name].time_s / by_method[REFERENCE].time_s


def _cell(by_method: Mapping[str, Cost], name: str) -> str:
    if name not in by_method:
        return "–"
    return f"{by_method[name].time_s * 1e3:.3f} ms ({_ratio(by_method, name):.2f})"


def _total(costs: Mapping[Layer, Mapping[str, Cost]], name: str) -> list[str]:
    if not all(name in by_method for by_method in costs.values()):
        return ["–"]
    return [f"{sum(by_method[name].time_s for by_method in costs.values()) * 1e3:.3f} ms"]

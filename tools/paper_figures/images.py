"""The images that the network looks at, and what each normalization hides."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from edge_ident.estimation.image import Normalization, effort_image, effort_scale
from edge_ident.signals.metrics import POINTS
from export.configuration import IMPROVED
from export.motion import paper_motion
from tools.paper_figures.page import Section, Sources, table

Array = NDArray[np.float64]

NOISE: Final = 0.002
"""Of the subsampled effort, over its scale: 2 % before subsampling."""
TRUTH: Final = np.array([0.3, 0.5, 0.4, 0.1])
GUESSES: Final = {
    "the guess matches": TRUTH,
    "another guess": np.array([0.5, 0.1, 0.9, -0.4]),
    "twice the match": 2.0 * TRUTH,
}
"""Ratios of parameters, as the truth; in shares once the true effort has the scale one."""
KINDS: Final = ("min-max", "effort-scale", "remainder")


@dataclass(frozen=True)
class Pictured:
    """One image (100, 100), of a guess in one way to make images."""

    kind: str
    guess: str
    image: NDArray[np.float32]


def make_images() -> list[Pictured]:
    """Every guess in every kind, against one measurement with white noise."""
    regressor = paper_motion().scaled_regressor(POINTS)
    unit = effort_scale(regressor @ TRUTH, "effort-scale")
    noise = NOISE * np.random.default_rng(0).normal(size=POINTS)
    measured = regressor @ TRUTH / unit + noise
    return [
        Pictured(kind, name, _image(kind, regressor, guess / unit, measured))
        for kind in KINDS
        for name, guess in GUESSES.items()
    ]


def _image(kind: str, regressor: Array, guess: Array, measured: Array) -> NDArray[np.float32]:
    model = regressor @ guess
    if kind == "remainder":
        left = measured - model
        start = regressor @ np.array(IMPROVED.start_shares)
        return _outer(start, left / effort_scale(left, "effort-scale"), "effort-scale")
    normalization: Normalization = "min-max" if kind == "min-max" else "effort-scale"
    scale = effort_scale(measured, normalization)
    return _outer(model / scale, measured / scale, normalization)


def _outer(first: Array, second: Array, normalization: Normalization) -> NDArray[np.float32]:
    return np.asarray(effort_image(first[None], second, normalization)[0, 0])


def section(sources: Sources) -> Section:
    """Three kinds of image of three guesses."""
    images = make_images()
    picture = sources.save(draw(images), "images", "Images of matching and other guesses")
    by_kind = {kind: {i.guess: i.image for i in images if i.kind == kind} for kind in KINDS}
    match, *others = GUESSES
    rows = [
        [kind, *(f"{_difference(shown[match], shown[name]):.2f}" for name in others)]
        for kind, shown in by_kind.items()
    ]
    numbers = table(["image", *(f"{name} from the match" for name in others)], rows)
    return Section(
        "Images",
        "It shows images of 100×100 points made of two vectors multiplied, ψαᵀ, normalized to [0, "
        "1].",
        "ψ, the guess, runs downwards; α, the measurement, to the right. Largest difference of an "
        f"image from that of the matching guess, over the range of its values:\n\n{numbers}\n\n"
        f"{picture}",
        "The first row is the paper's kind. A guess twice too large makes the very image of the "
        "match, so no network can tell how far off it is. The second divides both vectors by the "
        "scale of the measurement. The third is what the built-in network sees: what the guess "
        "leaves, over its own scale ([network](network.md#the-loop)).",
    )


def draw(images: list[Pictured]) -> Figure:
    """A row a kind, a column a guess; one scale of colours a row."""
    figure = Figure(figsize=(9.5, 8.6), layout="constrained")
    grid = figure.subplots(len(KINDS), len(GUESSES))
    limits = {"min-max": (0.0, 1.0)}
    for kind in KINDS[1:]:
        peak = max(float(np.max(np.abs(i.image))) for i in images if i.kind == kind)
        limits[kind] = (-peak, peak)
    for panel, pictured in zip(grid.flat, images, strict=True):
        low, high = limits[pictured.kind]
        shown = panel.imshow(
            pictured.image, vmin=low, vmax=high, cmap="gray" if low == 0.0 else "RdBu_r"
        )
        panel.set_xticks([0, 50, 99])
        panel.set_yticks([0, 50, 99])
        if pictured.kind == KINDS[0]:
            panel.set_title(pictured.guess)
        if panel in grid[:, 0]:
            panel.set_ylabel(f"{pictured.kind}\nψ, point")
        if panel in grid[-1]:
            panel.set_xlabel("α, point")
        if panel in grid[:, -1]:
            figure.colorbar(shown, ax=panel)
    return figure


def _difference(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    return float(np.max(np.abs(one - other)) / np.ptp(one))

"""What a training run is made of, under a name."""

from dataclasses import dataclass, replace
from typing import Literal

from edge_ident.errors import ModelError
from edge_ident.estimation.image import Normalization


@dataclass(frozen=True)
class Configuration:
    """One training run, complete: the same configuration gives the same network.

    Attributes
    ----------
    name : str
    points : int
        That signals are subsampled to; the image has as many rows and columns.
    normalization : {"effort-scale", "min-max"}
        Of the image.
    rotations : bool
        Show every image in a random one of four orientations, with the label unchanged: the
        paper's, and wrong (a half turn changes the sign of the inertia's part).
    drives : {"halves", "mixture"}
        The paper's halves (matching and random parameters), or the families of
        `export.drives` on perturbed motions with noise.
    motions : int
        Recordings of the motion that "mixture" draws from.
    drives_with_effect : int
        Recorded with each effect of the catalogue on each of the motions; 0 leaves effects out.
    start_shares : tuple of float or None
        The guess that every loop starts from, and whose effort makes every image with what later
        guesses leave of the measured effort; None are the paper's random starts, and images of
        guess and measurement.
    loss : {"sigmoid", "relative", "absolute"}
        Squared error of the sigmoid (reconstruction of the paper's); squared error of the
        residual relative to its size, because repeated passes have to shrink small residuals
        too; or the error itself, which leaves drives undisturbed by what effects do to others.
    optimizer : {"sgd", "adam"}
    learning_rate : float
        Constant for "sgd". For "adam" the peak of a warm-up and cosine, of a layer with 100
        inputs per unit; other layers get it divided by their inputs.
    head_steps, dense_steps, dense_examples : int
        Of `export.warm_start`; 0 steps leave a stage out.
    steps, batch : int
        Of the whole network.
    seed : int
    """

    name: str
    points: int
    normalization: Normalization
    rotations: bool
    drives: Literal["halves", "mixture"]
    motions: int
    drives_with_effect: int
    start_shares: tuple[float, float, float, float] | None
    loss: Literal["sigmoid", "relative", "absolute"]
    optimizer: Literal["sgd", "adam"]
    learning_rate: float
    head_steps: int
    dense_steps: int
    dense_examples: int
    steps: int
    batch: int
    seed: int


PAPER = Configuration(
    name="paper",
    points=100,
    normalization="min-max",
    rotations=True,
    drives="halves",
    motions=1,
    drives_with_effect=0,
    start_shares=None,
    loss="sigmoid",
    optimizer="sgd",
    learning_rate=0.14,
    head_steps=0,
    dense_steps=0,
    dense_examples=0,
    steps=100_000,
    batch=1,
    seed=1,
)
IMPROVED = Configuration(
    name="improved",
    points=100,
    normalization="effort-scale",
    rotations=False,
    drives="mixture",
    motions=96,
    drives_with_effect=12,
    start_shares=(0.5, 0.5, 0.5, 0.0),
    loss="absolute",
    optimizer="adam",
    learning_rate=1e-4,
    head_steps=8_000,
    dense_steps=6_000,
    dense_examples=60_000,
    steps=3_000,
    batch=64,
    seed=1,
)
PLAIN = replace(
    IMPROVED,
    name="plain",
    drives_with_effect=0,
    head_steps=2_000,
    dense_steps=2_000,
    dense_examples=30_000,
    steps=1_000,
)
"""Without effects: the answer comes as close to the effort as that of least squares."""
CONFIGURATIONS = {configuration.name: configuration for configuration in (PAPER, IMPROVED, PLAIN)}


def configuration(name: str) -> Configuration:
    """Look a configuration up.

    Raises
    ------
    ModelError
        If there is none of that name.
    """
    if name not in CONFIGURATIONS:
        known = ", ".join(CONFIGURATIONS)
        raise ModelError(f"no training configuration is called '{name}'", f"choose {known}")
    return CONFIGURATIONS[name]

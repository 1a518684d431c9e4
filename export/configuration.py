"""What a training run is made of, under a name."""

from dataclasses import dataclass
from typing import Literal

from edge_ident.errors import ModelError
from edge_ident.image import Normalization


@dataclass(frozen=True)
class Configuration:
    """One training run, complete: the same configuration gives the same network.

    Attributes
    ----------
    name : str
    normalization : {"effort-scale", "min-max"}
        Of the image.
    drives : {"halves", "mixture"}
        The paper's halves (matching and random parameters), or the families of
        `export.drives` on perturbed motions with noise.
    loss : {"sigmoid", "relative"}
        Squared error of the sigmoid (reconstruction of the paper's), or squared error of the
        residual relative to its size: the loop has to shrink small residuals too.
    optimizer : {"sgd", "adam"}
    learning_rate : float
        Constant for "sgd". For "adam" the peak of a warm-up and cosine, of a layer with 100
        inputs per unit; other layers get it divided by their inputs.
    head_steps : int
        Steps of `export.warm_start` before the whole network is trained; 0 leaves it out.
    steps, batch : int
        Of the whole network.
    seed : int
    """

    name: str
    normalization: Normalization
    drives: Literal["halves", "mixture"]
    loss: Literal["sigmoid", "relative"]
    optimizer: Literal["sgd", "adam"]
    learning_rate: float
    head_steps: int
    steps: int
    batch: int
    seed: int


PAPER = Configuration(
    name="paper",
    normalization="min-max",
    drives="halves",
    loss="sigmoid",
    optimizer="sgd",
    learning_rate=0.14,
    head_steps=0,
    steps=100_000,
    batch=1,
    seed=1,
)
IMPROVED = Configuration(
    name="improved",
    normalization="effort-scale",
    drives="mixture",
    loss="relative",
    optimizer="adam",
    learning_rate=1e-4,
    head_steps=30_000,
    steps=4_500,
    batch=64,
    seed=1,
)
CONFIGURATIONS = {configuration.name: configuration for configuration in (PAPER, IMPROVED)}


def configuration(name: str) -> Configuration:
    """Look a configuration up.

    Raises
    ------
    ModelError
        If there is none of that name.
    """
    if name not in CONFIGURATIONS:
        known = " or ".join(CONFIGURATIONS)
        raise ModelError(f"no training configuration is called '{name}'", f"choose {known}")
    return CONFIGURATIONS[name]

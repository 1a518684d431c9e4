"""Training batches, made as they are needed and fixed by seed and step."""

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from edge_ident.image import effort_scale, gain_and_bias
from export.configuration import Configuration
from export.drives import as_shares, efforts, guesses, mixture, random_starts
from export.motion import column_scales, motion_columns, perturbed_motions

Array = NDArray[np.float64]

MOTIONS: Final = 256
"""Recordings of the motion that the mixture draws from."""
NOISE: Final = (0.0002, 0.02)
"""Effort noise after subsampling over the effort's scale. White noise comes through reduced by
√(100/8742), so 2 % of it is 0.002 here; the rest stands for what the model does not explain."""


@dataclass(frozen=True)
class Batch:
    """Training examples.

    Attributes
    ----------
    model_effort, measured_effort : (n, 100) arrays
        The image's two factors; the first with the normalization's gain.
    bias : (n,) array
        The normalization's constant.
    residual : (n, 4) array
        Guess minus truth in shares, as seen through the nominal motion.
    """

    model_effort: Array
    measured_effort: Array
    bias: Array
    residual: Array


class Batches:
    """The stream of batches of a configuration.

    A batch is a function of the configuration's seed and its own number, so a resumed run
    goes on with exactly the examples that it would have seen.
    """

    def __init__(self, configuration: Configuration) -> None:
        self._configuration = configuration
        self._inverse = np.linalg.pinv(nominal_shapes())
        if configuration.drives == "mixture":
            self._motions = perturbed_motions(np.random.default_rng(configuration.seed), MOTIONS)
        else:
            self._motions = nominal_shapes()[None]

    def batch(self, number: int) -> Batch:
        """One batch; negative numbers are for purposes other than gradient steps."""
        configuration = self._configuration
        normalization = configuration.normalization
        rng = np.random.default_rng((configuration.seed, abs(number), int(number < 0)))
        columns, truth, guess = self.examples(rng, configuration.batch)
        clean, model = efforts(columns, truth), efforts(columns, guess)
        measured = clean + self._noise(rng, clean.shape)
        # the loop scales by what it measures, noise included
        scale = effort_scale(measured, normalization)[:, None]
        gain, bias = gain_and_bias(model, measured / scale, normalization)
        # what a wrong amplitude does to guess and truth alike, an image cannot show
        residual = (model - clean / scale) @ self._inverse.T
        return Batch(gain[:, None] * model, measured / scale, bias, residual)

    def examples(self, rng: np.random.Generator, count: int) -> tuple[Array, Array, Array]:
        """Columns (n, 100, 4), true shares (n, 4) and guesses (n, 4)."""
        configuration = self._configuration
        columns = self._motions[rng.integers(len(self._motions), size=count)]
        if configuration.drives == "mixture":
            truth = as_shares(columns, mixture(rng, count), configuration.normalization)
            return columns, truth, guesses(rng, truth)
        truth = as_shares(columns, random_starts(rng, count), configuration.normalization)
        matching = rng.integers(0, 2, (count, 1)) == 1
        return columns, truth, np.where(matching, truth, random_starts(rng, count))

    def _noise(self, rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
        if self._configuration.drives == "halves":
            return np.zeros(shape)
        noisy = rng.integers(0, 2, (shape[0], 1))
        level = noisy * np.exp(rng.uniform(*np.log(NOISE), (shape[0], 1)))
        return np.asarray(level * rng.normal(size=shape))


@cache
def nominal_shapes() -> Array:
    """Columns (100, 4) of the nominal motion over their scales."""
    return motion_columns(1.0, 0.0) / column_scales()


def tensor(array: Array) -> Tensor:
    """Single precision tensor of an array."""
    return torch.as_tensor(array, dtype=torch.float32)

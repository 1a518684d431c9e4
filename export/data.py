"""Training batches, made as they are needed and fixed by seed and number."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from edge_ident.errors import ModelError
from edge_ident.estimation.image import effort_scale, scale_and_offset
from export.configuration import Configuration
from export.drives import as_shares, efforts, guesses, mixture, random_starts
from export.motion import TrainingMotion
from export.recordings import Recordings, make_recordings

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

NOISE: Final = (0.0002, 0.01)
"""Effort noise after subsampling over the effort's scale. White noise comes through reduced by
√(100/8742), so 2 % of it is 0.002 here."""
EFFECTS: Final = (0.3, 0.5, 0.2)
"""Parts of the drives that have no effect, one, and two."""
GUESSES: Final = (0.3, 0.35, 0.35)
"""Parts of the guesses that are the start, near the truth, and near what least squares finds."""
DISTANCES: Final = (0.0003, 0.3)
"""Nearest and farthest of these guesses from the truth or from least squares, in shares."""
DETAILS: Final = 32
"""Principal components of what efforts hold beside the four parameters."""
BASIS_EXAMPLES: Final = 20_000


@dataclass(frozen=True)
class Examples:
    """Recordings of random drives, all in shares of the measured effort's scale.

    Attributes
    ----------
    regressor : (n, points, 4) array
        Measured, over the motion's scales.
    measured : (n, points) array
    truth : (n, 4) array
    """

    regressor: Array
    measured: Array
    truth: Array


@dataclass(frozen=True)
class Batch:
    """Training examples.

    Attributes
    ----------
    model_effort, measured_effort : (n, points) arrays
        The image's two factors; the first with the normalization's scale. With a fixed start the
        second is what the guess leaves of the effort, over its own scale.
    offset : (n,) array
        The normalization's constant.
    guess, residual : (n, 4) arrays
        Guess, and guess minus truth as seen through the nominal motion, in shares of the scale
        that the second factor was divided by.
    """

    model_effort: Array
    measured_effort: Array
    offset: Array
    guess: Array
    residual: Array

    @property
    def factors(self) -> tuple[Tensor, Tensor, Tensor]:
        """What `ResidualNetwork.features` takes, in single precision."""
        return tensor(self.model_effort), tensor(self.measured_effort), tensor(self.offset)


class Batches:
    """The stream of examples of a configuration on a motion.

    A batch is a function of the configuration's seed, the stream's and its own number, so a
    resumed run goes on with exactly the examples that it would have seen.

    Parameters
    ----------
    configuration : Configuration
    motion : TrainingMotion
    held_out : bool
        Other motions, drives and effects than those of training.
    on_progress : callable
        Called with the motions recorded and their number.
    """

    def __init__(
        self,
        configuration: Configuration,
        motion: TrainingMotion,
        *,
        held_out: bool = False,
        on_progress: Callable[[int, int], None] = lambda done, total: None,
    ) -> None:
        self.configuration = configuration
        self.nominal = motion.scaled_regressor(configuration.points)
        """Regressor (points, 4) of the nominal motion over its scales."""
        self.inverse = np.linalg.pinv(self.nominal)
        self._held_out = held_out
        self._recordings = self._record(motion, on_progress)

    def _record(
        self, motion: TrainingMotion, on_progress: Callable[[int, int], None]
    ) -> Recordings:
        configuration = self.configuration
        if configuration.drives == "halves":
            if motion.known is not None:
                raise ModelError(
                    "the paper's recipe knows no effects", "train another configuration"
                )
            exact, nothing = self.nominal[None], np.zeros(0)
            return Recordings(exact, exact, (), nothing, nothing)
        motions = configuration.motions // 4 if self._held_out else configuration.motions
        return make_recordings(
            motion,
            configuration.points,
            self._generator(0),
            motions=max(1, motions),
            drives=configuration.drives_with_effect,
            on_progress=on_progress,
        )

    def batch(self, stream: str, number: int, count: int) -> Batch:
        """The examples of one gradient step.

        Parameters
        ----------
        stream : str
            What they are for; other names give other examples.
        number : int
        count : int
        """
        rng = self._generator(number, *stream.encode())
        examples = self.examples(rng, count)
        return self._with_guesses(examples, rng)

    def examples(self, rng: np.random.Generator, count: int) -> Examples:
        """Random drives, as they are measured."""
        configuration, recordings = self.configuration, self._recordings
        index = rng.integers(len(recordings.measured), size=count)
        truth, added = self._drives(rng, index)
        effort = efforts(recordings.true[index], truth) + added
        effort = effort + self._noise(rng, effort)
        # the loop scales by what it measures, noise and effects included
        scale = effort_scale(effort, configuration.normalization)[:, None]
        return Examples(recordings.measured[index], effort / scale, truth / scale)

    def _drives(self, rng: np.random.Generator, index: Indices) -> tuple[Array, Array]:
        """Base parameters, and what the effects of each drive add to its effort."""
        recordings, count = self._recordings, len(index)
        normalization = self.configuration.normalization
        regressor = recordings.true[index]
        if self.configuration.drives == "halves":
            raw = random_starts(rng, count)
        else:
            raw = mixture(rng, count)
        truth = as_shares(regressor, raw, normalization)
        added = np.zeros(regressor.shape[:2])
        known = recordings.known_drives(rng, index)
        if known is not None:
            made_for, added = known
            truth = made_for + _more(rng, count) * truth
        if not recordings.effects:
            return truth, added
        number = rng.choice(len(EFFECTS), p=EFFECTS, size=count)
        for rank in range(1, len(EFFECTS)):
            chosen = number >= rank
            effect = rng.integers(len(recordings.effects), size=count)
            drive = rng.integers(recordings.parameters.shape[2], size=count)
            which = (index[chosen], effect[chosen], drive[chosen])
            added[chosen] += recordings.added[which]
            if rank == 1 and known is None:
                more = _more(rng, int(np.count_nonzero(chosen)))
                truth[chosen] = recordings.parameters[which] + more * truth[chosen]
        return truth, added

    def _with_guesses(self, examples: Examples, rng: np.random.Generator) -> Batch:
        if self.configuration.start_shares is not None:
            return self._remainders(examples, self.configuration.start_shares, rng)
        configuration, truth, regressor = self.configuration, examples.truth, examples.regressor
        guess = self._random_guesses(rng, truth)
        # guess and truth as seen through the nominal motion: what an image can show
        guess, seen = (efforts(regressor, shares) @ self.inverse.T for shares in (guess, truth))
        model = guess @ self.nominal.T
        contrast, offset = scale_and_offset(model, examples.measured, configuration.normalization)
        factors = contrast[:, None] * model, examples.measured
        if configuration.rotations:
            factors = rotate(*factors, rng.integers(4, size=len(seen)))
        return Batch(*factors, offset, guess, guess - seen)

    def _remainders(
        self, examples: Examples, start: tuple[float, ...], rng: np.random.Generator
    ) -> Batch:
        """Images of what guesses leave of the effort, in shares of its scale.

        The guesses are those that passes meet: the start, answers at any distance from the truth,
        and what least squares makes of the effort.
        """
        truth, regressor, count = examples.truth, examples.regressor, len(examples.truth)
        direction = rng.normal(size=truth.shape)
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        nearest, farthest = np.log(DISTANCES)
        distance = np.exp(rng.uniform(nearest, farthest, (count, 1)))
        fitted = (np.linalg.pinv(regressor) @ examples.measured[:, :, None])[:, :, 0]
        kind = rng.choice(3, size=(count, 1), p=GUESSES)
        near = np.where(kind == 1, truth, fitted) + distance * direction
        guess = np.where(kind == 0, np.array(start), near)
        remainder = examples.measured - efforts(regressor, guess)
        scale = effort_scale(remainder, self.configuration.normalization)[:, None]
        residual = efforts(regressor, guess - truth) @ self.inverse.T / scale
        model = np.broadcast_to(self.nominal @ np.array(start), remainder.shape)
        measured = remainder / scale
        contrast, offset = scale_and_offset(model, measured, self.configuration.normalization)
        return Batch(contrast[:, None] * model, measured, offset, guess, residual)

    def _random_guesses(self, rng: np.random.Generator, truth: Array) -> Array:
        if self.configuration.drives == "mixture":
            return guesses(rng, truth)
        matching = rng.integers(0, 2, (len(truth), 1)) == 1
        return np.where(matching, truth, random_starts(rng, len(truth)))

    def _noise(self, rng: np.random.Generator, effort: Array) -> Array:
        if self.configuration.drives == "halves":
            return np.zeros_like(effort)
        noisy = rng.uniform(size=(len(effort), 1)) < 0.7
        faintest, loudest = np.log(NOISE)
        level = noisy * np.exp(rng.uniform(faintest, loudest, (len(effort), 1)))
        return np.asarray(level * rng.normal(size=effort.shape))

    def basis(self) -> Array:
        """What an effort is described by: four parameters, then details, (K, points)."""
        if not self.configuration.drives_with_effect:
            return np.asarray(self.inverse, dtype=np.float64)
        measured = self.batch("basis", 0, BASIS_EXAMPLES).measured_effort
        rest = measured - measured @ self.inverse.T @ self.nominal.T
        _, size, details = np.linalg.svd(rest - rest.mean(axis=0), full_matrices=False)
        deviation = size[:DETAILS, None] / np.sqrt(len(rest))
        return np.vstack([self.inverse, 0.3 * details[:DETAILS] / deviation])

    def _generator(self, number: int, *key: int) -> np.random.Generator:
        seed = (self.configuration.seed, int(self._held_out), number, *key)
        return np.random.default_rng(seed)


def _more(rng: np.random.Generator, count: int) -> Array:
    """How much of another drive (count, 1) to put on top of the one that an effect was made for:
    up to as much, and for one half nothing."""
    return rng.uniform(-1.0, 1.0, (count, 1)).clip(min=0.0)


def rotate(model: Array, measured: Array, turns: Indices) -> tuple[Array, Array]:
    """Factors (n, points) of images turned by quarters, counter-clockwise.

    Turning ψαᵀ once gives (α reversed)ψᵀ: the factors change places, one of them reversed.
    """
    left, right = model.copy(), measured.copy()
    for _ in range(3):
        turned = turns > 0
        left[turned], right[turned] = right[turned][:, ::-1], left[turned]
        turns = turns - 1
    return left, right


def tensor(array: Array) -> Tensor:
    """Single precision tensor of an array."""
    return torch.as_tensor(np.ascontiguousarray(array), dtype=torch.float32)

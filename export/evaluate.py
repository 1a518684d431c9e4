"""How well a network identifies drives it has never seen, with the loop that runs at the edge."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident import cnn
from edge_ident.dct import POINTS
from edge_ident.image import Normalization, effort_scale
from edge_ident.metrics import relative_residual
from edge_ident.network import Evaluation, Network
from export.data import nominal_shapes
from export.drives import FAMILIES, as_shares, efforts, random_starts
from export.motion import SAMPLES, column_scales, perturbed_motions

Array = NDArray[np.float64]

DRIVES: Final = 500
PASSES: Final = 8
SEED: Final = 20_261_121
"""Of evaluation alone: no training configuration and no choice of one was made with it."""
NOISE: Final = 0.02
"""Effort noise over the effort's scale."""
CORRELATED_POINTS: Final = 9
"""Of the noise that stands for what the model does not explain."""
UNEXPLAINED_RESIDUAL: Final = NOISE * np.sqrt(2.0)
"""Relative residual of a perfect answer there: the effort's scale is √2 times its rms."""


@dataclass(frozen=True)
class DriveSet:
    """Drives with their recordings, SI.

    Attributes
    ----------
    columns : (n, 100, 4) array
    effort, clean_effort : (n, 100) arrays
        With and without noise.
    parameters : (n, 4) array
        The truth.
    """

    columns: Array
    effort: Array
    clean_effort: Array
    parameters: Array


def clean_drives(families: tuple[str, ...] = tuple(FAMILIES)) -> DriveSet:
    """Noise-free drives on the nominal motion, as many of each family."""
    return _drives(np.broadcast_to(nominal_shapes(), (DRIVES, POINTS, 4)), families, np.zeros(1))


def noisy_drives() -> DriveSet:
    """Recordings of perturbed motions by the encoder, with 2 % white effort noise."""
    rng = np.random.default_rng((SEED, 1))
    measured = perturbed_motions(rng, 64)[1::2]
    level = NOISE * np.sqrt(POINTS / SAMPLES)
    return _drives(measured[rng.integers(len(measured), size=DRIVES)], tuple(FAMILIES), level)


def unexplained_drives() -> DriveSet:
    """Drives on the nominal motion with 2 % of effort that the model does not explain."""
    average = np.ones(CORRELATED_POINTS) / np.sqrt(CORRELATED_POINTS)
    shapes = np.broadcast_to(nominal_shapes(), (DRIVES, POINTS, 4))
    return _drives(shapes, tuple(FAMILIES), NOISE * average)


def evaluate_all(fp32: Network, int8: Network) -> tuple[Evaluation, ...]:
    """All figures of a network."""
    clean, noisy = clean_drives(), noisy_drives()
    return (
        evaluate("clean", fp32, clean),
        *(evaluate(f"clean_{family}", fp32, clean_drives((family,))) for family in FAMILIES),
        evaluate("clean_int8", int8, clean),
        evaluate("noisy", fp32, noisy),
        evaluate("noisy_int8", int8, noisy),
        evaluate("unexplained", fp32, unexplained_drives()),
        random_search("random_search", clean, fp32.manifest.normalization),
    )


def evaluate(name: str, network: Network, drives: DriveSet) -> Evaluation:
    """Identify every drive."""
    found = identified(network, drives)
    return _figures(name, drives, found, network.manifest.normalization)


def identified(network: Network, drives: DriveSet) -> Array:
    """Parameters (n, 4) of every drive, SI, after at most `PASSES` passes each."""
    pairs = zip(drives.columns, drives.effort, strict=True)
    return np.array(
        [
            cnn.identify(columns, effort, network, seed=index, passes=PASSES).parameters
            for index, (columns, effort) in enumerate(pairs)
        ]
    )


def random_search(name: str, drives: DriveSet, normalization: Normalization) -> Evaluation:
    """The same number of random guesses without any network, the best by relative residual."""
    rng = np.random.default_rng((SEED, 2))
    found = np.empty_like(drives.parameters)
    for index, (columns, effort) in enumerate(zip(drives.columns, drives.effort, strict=True)):
        unit = effort_scale(effort, normalization) / column_scales()
        tries = random_starts(rng, PASSES) * unit
        scores = [relative_residual(effort, columns @ guess) for guess in tries]
        found[index] = tries[int(np.argmin(scores))]
    return _figures(name, drives, found, normalization)


def shares(drives: DriveSet, parameters: Array, normalization: Normalization) -> Array:
    """Parameters (n, 4) in SI as shares of their recordings' effort."""
    return parameters * column_scales() / effort_scale(drives.effort, normalization)[:, None]


def _drives(shapes: Array, families: tuple[str, ...], filtered_noise: Array | float) -> DriveSet:
    """Drives of several families on (n, 100, 4) shapes, effort scales over two decades.

    `filtered_noise` is the impulse response that white noise is filtered by.
    """
    rng = np.random.default_rng((SEED, 3))
    sizes = [len(part) for part in np.array_split(np.arange(DRIVES), len(families))]
    raw = np.vstack([FAMILIES[f](rng, n) for f, n in zip(families, sizes, strict=True)])
    unit_nm = np.exp(rng.uniform(np.log(0.1), np.log(10.0), (DRIVES, 1)))
    true_shares = as_shares(shapes, raw, "effort-scale")
    response = np.atleast_1d(filtered_noise)
    white = rng.normal(size=(DRIVES, POINTS + len(response) - 1))
    noise = np.array([np.convolve(row, response, mode="valid") for row in white])
    clean = efforts(shapes, true_shares)
    scales = column_scales()
    return DriveSet(
        columns=shapes * scales,
        effort=unit_nm * (clean + noise),
        clean_effort=unit_nm * clean,
        parameters=unit_nm * true_shares / scales,
    )


def _figures(name: str, drives: DriveSet, found: Array, normalization: Normalization) -> Evaluation:
    modelled = efforts(drives.columns, found)
    pairs = zip(drives.clean_effort, modelled, strict=True)
    errors = [relative_residual(clean, model) for clean, model in pairs]
    difference = shares(drives, found - drives.parameters, normalization)
    return Evaluation(
        name=name,
        drives=len(errors),
        residual_median=float(np.median(errors)),
        residual_p90=float(np.quantile(errors, 0.9)),
        share_error_rms=np.sqrt(np.mean(difference**2, axis=0)),
    )

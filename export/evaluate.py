"""How well a network identifies drives it has never seen, with the loop that runs at the edge."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation.image import effort_scale
from edge_ident.estimation.manifest import Evaluation, Variant
from edge_ident.estimation.network import Network
from edge_ident.estimation.network_estimate import estimate
from edge_ident.signals.metrics import relative_residual
from export.drives import FAMILIES, as_shares, efforts, mixture, random_starts
from export.motion import TrainingMotion
from export.recordings import Recordings, make_recordings

Array = NDArray[np.float64]

DRIVES: Final = 500
PASSES: Final = 8
SEED: Final = 20_261_121
"""Seed of evaluation alone: no training configuration was made or chosen with it."""
NOISE: Final = 0.02
"""White effort noise over the effort's scale, before subsampling."""
MOTIONS: Final = 20
DRIVES_WITH_EFFECT: Final = 2
"""Drives with each effect on each of these motions."""


@dataclass(frozen=True)
class DriveSet:
    """Drives with their recordings, SI.

    Attributes
    ----------
    regressor : (n, points, 4) array
    effort, base_effort : (n, points) arrays
        Measured, and what the base model makes of the drive's parameters.
    parameters : (n, 4) array
        The truth.
    column_scales : (4,) array
    """

    regressor: Array
    effort: Array
    base_effort: Array
    parameters: Array
    column_scales: Array

    def shares(self, parameters: Array) -> Array:
        """Parameters (n, 4) in SI as shares of their recordings' effort."""
        scale = effort_scale(self.effort, "effort-scale")[:, None]
        return parameters * self.column_scales / scale


@dataclass(frozen=True)
class EvaluationDrives:
    """The sets that a network is judged by, all on one motion.

    Attributes
    ----------
    clean : DriveSet
        The model's effort without noise, as many drives of each family.
    noisy : DriveSet
        Recordings by the encoder, with 2 % white effort noise.
    disturbed : DriveSet
        The same with one effect of the catalogue each.

    Where effects are known of the machine, all drives have them.
    """

    clean: DriveSet
    noisy: DriveSet
    disturbed: DriveSet


def evaluation_drives(motion: TrainingMotion, points: int) -> EvaluationDrives:
    """Draw and record all sets."""
    rng = np.random.default_rng(SEED)
    recordings = make_recordings(motion, points, rng, motions=MOTIONS, drives=DRIVES_WITH_EFFECT)
    level = NOISE * np.sqrt(points / len(motion.position))
    sizes = [len(part) for part in np.array_split(np.arange(DRIVES), len(FAMILIES))]
    raw = np.vstack([family(rng, n) for family, n in zip(FAMILIES.values(), sizes, strict=True)])
    nominal = np.broadcast_to(motion.scaled_regressor(points), (DRIVES, points, 4))
    truth = as_shares(nominal, raw, "effort-scale")
    base = efforts(nominal, truth)
    clean = _in_si(motion, rng, nominal, base, base, truth)
    index = rng.integers(MOTIONS, size=DRIVES)
    regressor = recordings.true[index]
    truth = as_shares(regressor, mixture(rng, DRIVES), "effort-scale")
    effort = base = efforts(regressor, truth)
    known = recordings.known_drives(rng, index)
    if known is not None:
        truth, added = known
        base = efforts(regressor, truth)
        effort = base + added
        clean = _in_si(motion, rng, regressor, effort, base, truth)
    noise = level * rng.normal(size=base.shape)
    noisy = _in_si(motion, rng, recordings.measured[index], effort + noise, base, truth)
    return EvaluationDrives(clean, noisy, _disturbed(motion, rng, recordings, level))


def _disturbed(
    motion: TrainingMotion, rng: np.random.Generator, recordings: Recordings, level: float
) -> DriveSet:
    """Every drive that the recordings have."""
    index = np.repeat(np.arange(MOTIONS), recordings.parameters[0, ..., 0].size)
    truth = recordings.parameters.reshape(-1, 4)
    base = efforts(recordings.true[index], truth)
    effort = base + recordings.added.reshape(base.shape) + level * rng.normal(size=base.shape)
    known = recordings.known_drives(rng, index)
    if known is not None:
        effort = effort + known[1]
    return _in_si(motion, rng, recordings.measured[index], effort, base, truth)


def _in_si(
    motion: TrainingMotion,
    rng: np.random.Generator,
    scaled_regressor: Array,
    effort: Array,
    base: Array,
    truth: Array,
) -> DriveSet:
    """Give drives efforts over two decades."""
    unit = np.exp(rng.uniform(np.log(0.1), np.log(10.0), (len(truth), 1)))
    scales = motion.column_scales
    return DriveSet(
        scaled_regressor * scales, unit * effort, unit * base, unit * truth / scales, scales
    )


def evaluate_all(
    networks: Mapping[Variant, Network], drives: EvaluationDrives
) -> tuple[Evaluation, ...]:
    """All figures of a network, and those of least squares and of guessing."""
    disturbed = ("noisy", drives.noisy), ("one_effect", drives.disturbed)
    return (
        *(
            evaluate(name if variant == "fp32" else f"{name}_{variant}", network, some)
            for name, some in (("clean", drives.clean), *disturbed)
            for variant, network in networks.items()
        ),
        *(
            figures(f"{name}_{kind}", some, method(some))
            for name, some in disturbed
            for kind, method in (("least_squares", solved), ("random_search", guessed))
        ),
    )


def evaluate(name: str, network: Network, drives: DriveSet) -> Evaluation:
    """Identify every drive."""
    return figures(name, drives, identified(network, drives))


def identified(network: Network, drives: DriveSet) -> Array:
    """Parameters (n, 4) of every drive, SI, after at most `PASSES` passes each."""
    pairs = zip(drives.regressor, drives.effort, strict=True)
    return np.array(
        [
            estimate(regressor, effort, network, seed=index, passes=PASSES).parameters
            for index, (regressor, effort) in enumerate(pairs)
        ]
    )


def solved(drives: DriveSet) -> Array:
    """Parameters (n, 4) by least squares on the same subsampled signals."""
    pairs = zip(drives.regressor, drives.effort, strict=True)
    return np.array(
        [np.linalg.lstsq(regressor, effort, rcond=None)[0] for regressor, effort in pairs]
    )


def guessed(drives: DriveSet) -> Array:
    """As many random guesses as there are passes, without any network: the best by residual."""
    rng = np.random.default_rng((SEED, 2))
    found = np.empty_like(drives.parameters)
    for index, (regressor, effort) in enumerate(zip(drives.regressor, drives.effort, strict=True)):
        unit = effort_scale(effort, "effort-scale") / drives.column_scales
        tries = random_starts(rng, PASSES) * unit
        scores = [relative_residual(effort, regressor @ guess) for guess in tries]
        found[index] = tries[int(np.argmin(scores))]
    return found


def figures(name: str, drives: DriveSet, found: Array) -> Evaluation:
    """Compare found parameters (n, 4) with the truth."""
    pairs = zip(drives.base_effort, efforts(drives.regressor, found), strict=True)
    residuals = [relative_residual(base, model) for base, model in pairs]
    error = np.abs(drives.shares(found - drives.parameters))
    return Evaluation(
        name=name,
        drives=len(residuals),
        residual_median=float(np.median(residuals)),
        residual_p90=float(np.quantile(residuals, 0.9)),
        share_error_rms=np.sqrt(np.mean(error**2, axis=0)),
        share_error_median=np.median(error, axis=0),
        share_error_p95=np.quantile(error, 0.95, axis=0),
    )


def error_per_residual(network: Network, drives: DriveSet, base: Array) -> Array:
    """How the shares' errors grow with what an effect leaves unexplained, (4,).

    Parameters
    ----------
    network : Network
    drives : DriveSet
        With effects.
    base : (4,) array
        Rms error without.
    """
    found = identified(network, drives)
    error = drives.shares(found - drives.parameters)
    pairs = zip(drives.effort, efforts(drives.regressor, found), strict=True)
    residual = np.array([relative_residual(effort, model) for effort, model in pairs])
    added = np.maximum(np.mean(error**2, axis=0) - base**2, 0.0)
    return np.asarray(np.sqrt(added / np.mean(residual**2)))

"""Random drives: parameters as shares of the effort, and guesses at them.

A share is a parameter times the peak of its column over the scale of the measured effort. So the
network sees numbers near one whatever the drive. The families are the paper's uniform parameters,
ratios over two and a half decades, one dominant term, and ratios of real feed drives.
"""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation.image import Normalization, effort_scale

Array = NDArray[np.float64]
Family = Callable[[np.random.Generator, int], Array]

_START_SHARE: Final = 0.35  # share of the guesses that are random starts


def uniform(rng: np.random.Generator, count: int) -> Array:
    """The paper's: in [0, 1], the offset in [-1, 1]."""
    shares = rng.uniform(0.0, 1.0, (count, 4))
    return _with_signs(rng, shares)


def log_uniform(rng: np.random.Generator, count: int) -> Array:
    """Ratios between 1 and 1/300."""
    return _with_signs(rng, np.exp(rng.uniform(np.log(1.0 / 300.0), 0.0, (count, 4))))


def corner(rng: np.random.Generator, count: int) -> Array:
    """Mostly one or two terms: Dirichlet of concentration 0.4."""
    return _with_signs(rng, rng.dirichlet(np.full(4, 0.4), count) + 1e-3)


def realistic(rng: np.random.Generator, count: int) -> Array:
    """A geared ball screw on a slow motion: little inertia, viscous and Coulomb about equal."""
    spread = np.exp(rng.normal(0.0, [0.6, 0.4, 0.4], (count, 3)))
    offset = rng.normal(0.0, 0.04, (count, 1))
    return np.hstack([np.array([0.07, 0.5, 0.45]) * spread, offset])


FAMILIES: Final[dict[str, Family]] = {
    "uniform": uniform,
    "log_uniform": log_uniform,
    "corner": corner,
    "realistic": realistic,
}
PROPORTIONS: Final = {"uniform": 0.3, "log_uniform": 0.3, "corner": 0.2, "realistic": 0.2}
"""How the training mixture is made up."""


def efforts(regressor: Array, shares: Array) -> Array:
    """Efforts (n, 100) of shares (n, 4) of regressors (n, 100, 4) or (100, 4)."""
    return np.asarray((regressor @ shares[:, :, None])[:, :, 0])


def as_shares(regressor: Array, raw: Array, normalization: Normalization) -> Array:
    """Scale (n, 4) raw parameters so that the efforts of the regressor have scale one."""
    return np.asarray(raw / effort_scale(efforts(regressor, raw), normalization)[:, None])


def mixture(rng: np.random.Generator, count: int) -> Array:
    """Raw parameters (count, 4) from all families in their proportions."""
    names = rng.choice(list(PROPORTIONS), size=count, p=list(PROPORTIONS.values()))
    raw = np.empty((count, 4))
    for name, family in FAMILIES.items():
        chosen = names == name
        raw[chosen] = family(rng, int(np.count_nonzero(chosen)))
    return raw


def random_starts(rng: np.random.Generator, count: int) -> Array:
    """The paper's starting points (count, 4): in [0, 1], the offset in [-1, 1]."""
    return _with_signs(rng, rng.uniform(0.0, 1.0, (count, 4)))


def guesses(rng: np.random.Generator, truth: Array) -> Array:
    """Where the loop may stand: at a random start, or off the truth by 0.002 to 1 in any direction.

    Guesses that physics forbids are among them, since the loop passes through such.
    """
    count = len(truth)
    direction = rng.normal(size=truth.shape)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    distance = np.exp(rng.uniform(np.log(0.002), 0.0, (count, 1)))
    from_start = rng.uniform(size=(count, 1)) < _START_SHARE
    return np.where(from_start, random_starts(rng, count), truth + distance * direction)


def _with_signs(rng: np.random.Generator, magnitudes: Array) -> Array:
    """Give the offset either sign."""
    magnitudes[:, 3] *= rng.choice([-1.0, 1.0], len(magnitudes))
    return magnitudes

"""Random search: the best of a few random drives, which is the network's loop without the network.

It shows how lenient a metric is: guesses from [0, 1] reach a correlation of 0.9 in most draws.
"""

from typing import Final

import numpy as np

from edge_ident.baselines.problem import Problem
from edge_ident.model.model import POSITIVE, Estimate

_REPEATS: Final = 64
"""Further searches, which show how far from each other they end."""


def estimate(problem: Problem) -> Estimate:
    """Draw as often as the network may look, and keep the smallest relative residual.

    Shares are uniform in [0, 1], the offset's in [-1, 1]; a share of one alone causes the peak
    effort. The deviation is that of the same search with other draws.
    """
    regressor, effort = problem.regressor, problem.effort
    peak = np.max(np.abs(regressor), axis=0)
    scale = np.max(np.abs(effort)) / np.where(peak > 0, peak, 1.0)
    rng = np.random.default_rng(problem.seed)
    shares = rng.uniform(np.where(POSITIVE, 0.0, -1.0), 1.0, (1 + _REPEATS, problem.tries, 4))
    drives = scale * shares
    # ‖effort - regressor·drive‖², less the effort's own square, which all have in common
    misses = np.sum((drives @ (regressor.T @ regressor) - 2.0 * effort @ regressor) * drives, -1)
    best = drives[np.arange(1 + _REPEATS), np.argmin(misses, axis=1)]
    return Estimate(best[0], np.std(best, axis=0))

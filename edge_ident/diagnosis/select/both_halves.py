"""Whether both halves of the data show a cause with the same size.

A cause is a law of the machine, so it holds throughout. A disturbance that no effect explains may
look like one for a while: the loop answers a sweep as a delay would, by another delay at every
frequency.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, jacobian_of
from edge_ident.diagnosis.fit.projection import orthonormal
from edge_ident.diagnosis.fit.term_effort import contributions
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.acceptance import Decision, same_size
from edge_ident.diagnosis.select.standstill import tied_to_time
from edge_ident.model.model import PARAMETERS

Array = NDArray[np.float64]

_ROUNDED: Final = float(np.finfo(float).eps)


def decide_halves(data: AxisData, model: FittedModel) -> list[Decision | None]:
    """For each added term, whether the halves agree; None for what is tied to time."""
    valid = data.valid
    base = jacobian_of(data, model)[valid, : len(PARAMETERS)]
    residual, block = (data.effort - model.predicted)[valid], data.block[valid]
    parts = np.array_split(np.arange(len(residual)), 2)
    decisions: list[Decision | None] = []
    for term, effort in zip(model.terms, contributions(data, model), strict=True):
        if term.candidate == VIBRATION or tied_to_time(term):
            decisions.append(None)
            continue
        own = effort[valid]
        halves = [_scale(own[p], residual[p], base[p], block[p], float(own @ own)) for p in parts]
        (first, first_std), (second, second_std) = halves
        decisions.append(same_size(first, second, float(np.hypot(first_std, second_std))))
    return decisions


def _scale(
    own: Array, residual: Array, base: Array, block: NDArray[np.intp], whole: float
) -> tuple[float, float]:
    """By what a half would multiply an effort (n,), beside the base model, and its deviation.

    The deviation is robust to coloured residuals: the products of effort and residual are summed
    by blocks of time (Liang and Zeger, Biometrika 73 (1986) 13).

    Parameters
    ----------
    own, residual : (n,) arrays
        Effort of the cause, and what the model leaves.
    base : (n, 4) array
        Columns of the base model.
    block : (n,) array of int
        Numbers of the blocks of time.
    whole : float
        Energy of the effort in both halves.
    """
    space = orthonormal(base)
    own, residual = (signal - space @ (space.T @ signal) for signal in (own, residual))
    energy = float(own @ own)
    if not energy > _ROUNDED * whole:
        return 1.0, np.inf
    change = float(own @ residual) / energy
    scores = np.bincount(block, own * (residual - change * own))
    return 1.0 + change, float(np.linalg.norm(scores)) / energy

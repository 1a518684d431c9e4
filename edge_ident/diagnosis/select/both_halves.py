"""Whether both halves of the data show a cause with the same size.

They are divided in time where half of the energy of the cause's own effort has passed.

A cause is a law of the machine, so it holds throughout. A disturbance that no effect explains may
look like one for a while: the loop answers a sweep as a delay would, by another delay at every
frequency.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.acceptance import Decision, same_size
from edge_ident.diagnosis.select.own_effort import own_efforts
from edge_ident.diagnosis.select.standstill import tied_to_time

Array = NDArray[np.float64]

_TINY: Final = float(np.finfo(float).tiny)


def decide_halves(data: AxisData, model: FittedModel, space: Array) -> list[Decision | None]:
    """For each added term, whether the halves agree; None for what is tied to time.

    Parameters
    ----------
    data : AxisData
    model : FittedModel
    space : (n, R) array
        Of the base model's columns (`own_effort.base_space`).
    """
    residual, block = (data.effort - model.predicted)[data.valid], data.block[data.valid]
    decisions: list[Decision | None] = []
    for term, own in zip(model.terms, own_efforts(data, model, space), strict=True):
        if term.candidate == VIBRATION or tied_to_time(term):
            decisions.append(None)
            continue
        energy = np.cumsum(own**2)
        middle = int(np.searchsorted(energy, 0.5 * energy[-1]))
        parts = slice(0, middle), slice(middle, None)
        halves = [_scale(own[part], residual[part], block[part]) for part in parts]
        (first, first_std), (second, second_std) = halves
        decisions.append(same_size(first, second, float(np.hypot(first_std, second_std))))
    return decisions


def _scale(own: Array, residual: Array, block: NDArray[np.intp]) -> tuple[float, float]:
    """By what a half would multiply a cause's own effort (n,), and its standard deviation.

    The deviation is robust to coloured residuals: the products of effort and residual are summed
    by blocks of time (Liang and Zeger, Biometrika 73 (1986) 13).

    Parameters
    ----------
    own, residual : (n,) arrays
        Own effort of the cause, and what the model leaves.
    block : (n,) array of int
        Numbers of the blocks of time.
    """
    energy = max(float(own @ own), _TINY)
    change = float(own @ residual) / energy
    scores = np.bincount(block, own * (residual - change * own))
    return 1.0 + change, float(np.linalg.norm(scores)) / energy

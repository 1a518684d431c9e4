"""Whether both halves of the data show a cause with the same size.

A cause is a law of the machine, so it holds throughout: early and late, at low and high speed, at
small and large acceleration. What only looks like it does not. The loop answers a sweep as a
delay would, by another delay at every frequency, and a spring that is called a delay is another
delay at every speed.

Each time the data are divided so that both halves have half of the energy of the cause's own
effort.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.summary import own_efforts
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.acceptance import Decision, same_size
from edge_ident.diagnosis.select.cross_validation import tied_to_time

Array = NDArray[np.float64]
Places = NDArray[np.intp]
_TINY: Final = float(np.finfo(float).tiny)


def decide_halves(data: AxisData, model: FittedModel, space: Array) -> list[Decision | None]:
    """For each added term, whether the halves agree; None for what is tied to time.

    The decision is that on the two halves that agree least.

    Parameters
    ----------
    space : (n, R) array
        Of the base model's columns (`fit.summary.base_space`).
    """
    residual, block = (data.effort - model.predicted)[data.valid], data.block[data.valid]
    divisions = _divisions(data)
    decisions: list[Decision | None] = []
    for term, own in zip(model.terms, own_efforts(data, model, space), strict=True):
        if term.candidate == VIBRATION or tied_to_time(term):
            decisions.append(None)
            continue
        each = []
        for parts, order in divisions.items():
            halves = [_scale(own[k], residual[k], block[k]) for k in _halves(own, order)]
            (first, first_std), (second, second_std) = halves
            each.append(same_size(first, second, float(np.hypot(first_std, second_std)), parts))
        decisions.append(min(each, key=lambda decision: decision.margin))
    return decisions


def _divisions(data: AxisData) -> dict[tuple[str, str], Places]:
    """What the halves are called, and the valid samples in the order in which they are divided."""
    speed, acceleration = (
        np.abs(data.of_motion(name)[data.valid]) for name in ("velocity", "acceleration")
    )
    return {
        ("early", "late"): np.arange(len(speed)),
        ("at low speed", "at high speed"): np.argsort(speed, kind="stable"),
        ("at small acceleration", "at large"): np.argsort(acceleration, kind="stable"),
    }


def _halves(own: Array, order: Places) -> tuple[Places, Places]:
    """Samples of either half, from a cause's own effort (n,)."""
    energy = np.cumsum(own[order] ** 2)
    middle = int(np.searchsorted(energy, 0.5 * energy[-1]))
    return order[:middle], order[middle:]


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

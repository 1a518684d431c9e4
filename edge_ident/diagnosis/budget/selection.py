"""Which curves the recordings support: each has to predict what is held out, in time and by regime.

A curve enters where its likelihood gains, where the error on held-out stretches of time falls in
more of them than chance allows, and where no error grows that is held out by quarters of position,
speed or acceleration: its own coordinate aside, because no curve is known where it was not seen.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.curves import Curve
from edge_ident.diagnosis.budget.smoothing import Fit, Products, fitted
from edge_ident.diagnosis.select.thresholds import STRUCTURE

Array = NDArray[np.float64]

_NATS: Final = 6.0
"""Gain of the logarithm of the likelihood: odds of 1 to 400, because a score of curves are tried.
"""
_SURE: Final = 2.0
"""Standard deviations by which the logarithm of the held-out error falls, over blocks of time."""
_FALL: Final = 0.02
"""Least share by which a curve reduces the mean square that the base model leaves held out: what
reduces it less shows in no picture."""
_FOLDS: Final = 5
_TINY: Final = float(np.finfo(float).tiny)
_COORDINATES: Final = ("position", "speed", "acceleration")


def parts(block: NDArray[np.intp], coordinates: Sequence[Array]) -> list[NDArray[np.intp]]:
    """Ways to hold samples (n,) out: stretches of time, and quarters of each coordinate."""
    return [block % _FOLDS, *(_quarters(x) for x in coordinates)]


def _quarters(x: Array) -> NDArray[np.intp]:
    return np.digitize(x, np.quantile(x, [0.25, 0.5, 0.75]))


def select(
    products: Products, curves: Sequence[Curve], block: NDArray[np.intp], noise: float
) -> Fit:
    """The curves that the recordings support, fitted beside the base model.

    Parameters
    ----------
    products : Products
        Of all curves; the ways to hold out are those of `parts`.
    curves : sequence of Curve
    block : (n,) array of int
        Number of the block of time of each sample.
    noise : float
        Mean square that noise alone leaves of the signal: less is not divided among curves.
    """
    model = fitted(products, ())
    errors = _squares(model)
    least, least_held_out = _FALL * _left(model), _FALL * float(np.sum(errors[0]))
    while (left := _left(model)) > STRUCTURE.value**2 * noise:
        best: tuple[Fit, list[Array]] | None = None
        for k, curve in enumerate(curves):
            if k in model.curves:
                continue
            tried = fitted(products, (*model.curves, k), model)
            gain = tried.likelihood - model.likelihood
            if gain < _NATS or left - _left(tried) < least:
                continue
            found = _squares(tried)
            if not _agrees(errors, found, curve, block, least_held_out):
                continue
            if best is None or np.sum(found[0]) < np.sum(best[1][0]):
                best = tried, found
        if best is None:
            break
        model, errors = best
    return model


def _left(model: Fit) -> float:
    """Mean square that a fit leaves."""
    return float(np.mean((model.products.signal - model.predicted) ** 2))


def _squares(model: Fit) -> list[Array]:
    return [left**2 for left in model.held_out()]


def _agrees(
    before: Sequence[Array],
    after: Sequence[Array],
    curve: Curve,
    block: NDArray[np.intp],
    least: float,
) -> bool:
    """Whether what is held out is predicted better with a curve, by at least so much.

    By the logarithm of the error of each block: a few blocks hold most of the squares.
    """
    if np.sum(before[0]) - np.sum(after[0]) < least:
        return False
    here = np.unique(block)
    then, now = (np.log(np.bincount(block, e)[here] + _TINY) for e in (before[0], after[0]))
    falls = then - now
    if np.mean(falls) < _SURE * float(np.std(falls, ddof=1) / np.sqrt(len(falls))):
        return False
    return all(
        np.sum(now) <= np.sum(then)
        for coordinate, then, now in zip(_COORDINATES, before[1:], after[1:], strict=True)
        if coordinate not in curve.kind.over_what
    )

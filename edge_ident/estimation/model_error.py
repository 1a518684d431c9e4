"""Model error of an estimate: how far it moves when one regime of the motion is left out.

A right model fits every part of the motion with the same parameters. A wrong one balances its
errors over all of them, so its parameters depend on which parts there are. The samples are divided
into quarters by speed, by position, by time and by acceleration, and each quarter is left out in
turn. The direction is no such regime: one direction alone cannot tell Coulomb friction from offset.

The moves make a deviation as in the jackknife over groups (Quenouille 1956; Efron 1982, ch. 2).
What noise alone makes of the moves is taken off, so that a right model moves nowhere.

No model of a machine is right, and what it lacks may be too little to be noticed. This part follows
from the least that is noticed. It matters where noise is small.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.conditioning import unit_length
from edge_ident.signals.decimation import LONG

Array = NDArray[np.float64]

QUARTERS: Final = 4
SMALLEST_EXCESS: Final = 0.002
"""Residual beyond noise, of the rms effort, from which a model lacks something: it moves a
parameter that makes up a tenth of the effort by 2 % of its value."""
_RIDGE: Final = 1e-10
"""Added to normal matrices of unit diagonal: what a part of the motion does not show moves far, and
the noise of its move is as large."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class RegimeSpread:
    """How far least-squares parameters depend on the regimes of the motion.

    Attributes
    ----------
    model_error : (P,) array
        Standard deviation of each parameter by model error, beyond that by noise.
    significance : (P,) array
        Largest move of each parameter in standard deviations of the move by noise.
    largest_move : (P,) array
        In the parameter's unit.
    """

    model_error: Array
    significance: Array
    largest_move: Array


@dataclass(frozen=True)
class RegimeMoves:
    """Parameters without each of K quarters of the motion, less those of all of it.

    Attributes
    ----------
    move : (K, P) array
    by_noise : (K, P) array
        Deviation by noise of each move, in deviations by noise of the parameter.
    """

    move: Array
    by_noise: Array

    def beyond(self, std: Array) -> RegimeSpread:
        """What deviations by noise (P,) of the parameters leave of the moves."""
        noise = self.by_noise * std
        beyond = (self.move**2 - noise**2).reshape(-1, QUARTERS, len(std))
        variance = (QUARTERS - 1) / QUARTERS * beyond.sum(axis=1)
        with np.errstate(over="ignore"):  # a move that noise cannot make at all
            certainty = np.abs(self.move) / np.maximum(noise, _TINY)
        return RegimeSpread(
            model_error=np.sqrt(np.maximum(variance.max(axis=0), 0.0)),
            significance=certainty.max(axis=0),
            largest_move=np.abs(self.move).max(axis=0),
        )


def regimes(
    regressor: Array, position: Array, samples: NDArray[np.intp]
) -> tuple[Array, Array, Array, Array]:
    """Speed, position, time and acceleration, (N,) each.

    Parameters
    ----------
    regressor : (N, 4) array
        Of the base model.
    position : (N,) array
    samples : (N,) array of int
        Their numbers, which tell the time.
    """
    speed, acceleration = np.abs(regressor[:, 1]), regressor[:, 0]
    return speed, position, samples.astype(np.float64), acceleration


def unnoticed_error(regressor: Array, effort: Array) -> Array:
    """Deviation (P,) of least-squares parameters by what a model lacks and nothing shows.

    It leaves anything between nothing and `SMALLEST_EXCESS` in the residual, evenly distributed.
    In each of the P directions that the columns span, it is taken to be as large.

    Parameters
    ----------
    regressor : (N, P) array
    effort : (N,) array
    """
    unit, length = unit_length(regressor)
    inverse = np.linalg.inv(unit.T @ unit + _RIDGE * np.eye(unit.shape[1]))
    unnoticed = SMALLEST_EXCESS / np.sqrt(3.0) * np.linalg.norm(effort)
    return np.asarray(unnoticed * np.sqrt(np.diag(inverse)) / length)


def regime_spread(
    regressor: Array, effort: Array, regimes: Sequence[Array], std: Array
) -> RegimeSpread:
    """Leave out one regime at a time and compare the parameters.

    Parameters
    ----------
    regressor : (N, P) array
    effort : (N,) array
    regimes : sequence of (N,) arrays
        Quantities by which the samples are divided into quarters.
    std : (P,) array
        Standard deviations by noise of the parameters from all samples.
    """
    return regime_moves(regressor, effort, regimes).beyond(std)


def regime_moves(regressor: Array, effort: Array, regimes: Sequence[Array]) -> RegimeMoves:
    """The first half of `regime_spread`, which needs no deviations."""
    unit, length = unit_length(regressor)
    count = unit.shape[1]
    quarters = [_quarters(values) for values in regimes]
    whole, parts = np.zeros(count**2 + count), np.zeros((len(regimes), QUARTERS, count**2 + count))
    for begin in range(0, len(unit), LONG):  # in blocks: there are many products
        block = slice(begin, begin + LONG)
        rows = np.column_stack([_products(unit[block]), unit[block] * effort[block, None]])
        whole += rows.sum(axis=0)
        parts += [_sums(rows, quarter[block]) for quarter in quarters]
    inverse, parameters = _solved(whole[None], count)
    inverses, moved = _solved((whole - parts).reshape(-1, len(whole)), count)
    share = np.diagonal(inverses, axis1=1, axis2=2) / np.diagonal(inverse, axis1=1, axis2=2) - 1.0
    return RegimeMoves((moved - parameters) / length, np.sqrt(np.maximum(share, 0.0)))


def _quarters(values: Array) -> NDArray[np.intp]:
    """Number of the quarter, by size, of each of N values."""
    rank = np.empty(len(values), dtype=np.intp)
    rank[np.argsort(values, kind="stable")] = np.arange(len(values))
    return rank * QUARTERS // len(values)


def _sums(rows: Array, quarter: NDArray[np.intp]) -> Array:
    """Sums (4, R) of rows (N, R) by quarter."""
    return np.asarray((quarter == np.arange(QUARTERS)[:, None]).astype(np.float64) @ rows)


def _products(unit: Array) -> Array:
    """Products of every two of P columns, (N, P²)."""
    return (unit[:, :, None] * unit[:, None, :]).reshape(len(unit), -1)


def _solved(sums: Array, count: int) -> tuple[Array, Array]:
    """Inverses (K, P, P) and parameters (K, P) of K normal equations of P parameters."""
    normal = sums[:, : count**2].reshape(-1, count, count) + _RIDGE * np.eye(count)
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    return inverse, (inverse @ sums[:, count**2 :, None])[..., 0]

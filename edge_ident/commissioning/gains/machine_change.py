"""Whether a machine stayed the same from one recording of a motion to the next.

A machine that stays the same needs the same effort for the same motion, whatever the gains are. So
the base model is fitted to each recording by itself. What its parameters differ by is compared with
their scatter from one part of the motion to the next (a Wald test with clustered errors).

Source: Cameron and Miller, A practitioner's guide to cluster-robust inference, 2015, section II.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.model import PARAMETERS
from edge_ident.signals.conditioning import Signals, condition
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import AxisRecord

Array = NDArray[np.float64]

_PARTS: Final = 32
"""Parts of a recording, each long enough for its residual to forget the one before."""
_PARAMETERS: Final = len(PARAMETERS)
_CHANCE: Final = 1e-3
"""Probability of a difference as large on a machine that stayed the same."""
_RANK: Final = 1e-9


def changed_share(time_s: tuple[Array, Array], axis: tuple[AxisRecord, AxisRecord]) -> float:
    """How much an axis changed from one recording to the other, as a share of the rms effort.

    Parameters
    ----------
    time_s : two (N,) arrays
    axis : two AxisRecord
        Of one motion, with any gains.

    Returns
    -------
    float
        What the base parameters differ by, as effort along the later recording; zero where that
        may be chance.
    """
    signals = [
        condition(times, record.position, record.effort)
        for times, record in zip(time_s, axis, strict=True)
    ]
    fits = [_fitted(s) for s in signals]
    difference = fits[1][0] - fits[0][0]
    wald = difference @ np.linalg.pinv(fits[0][1] + fits[1][1], _RANK, hermitian=True) @ difference
    if _by_chance(float(wald)) > _CHANCE:
        return 0.0
    later = signals[1]
    effort = rms(later.effort[later.moving])
    return rms(later.regressor[later.moving] @ difference) / effort


def _fitted(signals: Signals) -> tuple[Array, Array]:
    """Base parameters (4,) by least squares, and their covariance (4, 4)."""
    moving = signals.moving
    rows, effort = signals.regressor[moving], signals.effort[moving]
    inverse = np.linalg.pinv(rows.T @ rows, _RANK, hermitian=True)
    found = inverse @ (rows.T @ effort)
    part = (_PARTS * np.flatnonzero(moving)) // len(moving)
    scores = np.zeros((_PARTS, _PARAMETERS))
    np.add.at(scores, part, rows * (effort - rows @ found)[:, None])
    return found, inverse @ (scores.T @ scores) @ inverse


def _by_chance(wald: float) -> float:
    """Probability of a Wald statistic as large: of F with four degrees of freedom and those of the
    scatter, which is estimated too. For an even number of parameters it has a closed form."""
    half = _PARTS - 1
    rest = 2 * half / (2 * half + wald)
    return float(rest**half * (1.0 + half * (1.0 - rest)))

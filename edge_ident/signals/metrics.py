"""How well a model's effort matches the measured one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.dct import dct2, transformable

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Metric:
    """Three measures of one comparison, all fractions.

    Attributes
    ----------
    time_spectral : float
        The paper's: mean of Pearson's correlation in time and of the DCT-II magnitudes
        (reconstruction). Lenient: it does not see a wrong scale.
    fit : float
        1 - ‖error‖ / ‖measured - mean‖.
    relative_residual : float
        ‖error‖ / ‖measured‖.
    """

    time_spectral: float
    fit: float
    relative_residual: float


def compare(measured: Array, modelled: Array) -> Metric:
    """Measure the match of two (N,) efforts."""
    shown = transformable(len(measured))
    spectra = np.abs(dct2(np.stack([measured[:shown], modelled[:shown]]).T))
    spectral = _correlation(spectra[:, 0], spectra[:, 1])
    error = float(np.linalg.norm(measured - modelled))
    spread = float(np.linalg.norm(measured - np.mean(measured)))
    return Metric(
        time_spectral=0.5 * (_correlation(measured, modelled) + spectral),
        fit=1.0 - error / max(spread, np.finfo(float).tiny),
        relative_residual=relative_residual(measured, modelled),
    )


def relative_residual(measured: Array, modelled: Array) -> float:
    """‖measured - modelled‖ / ‖measured‖ of two (N,) efforts."""
    scale = max(float(np.linalg.norm(measured)), np.finfo(float).tiny)
    return float(np.linalg.norm(measured - modelled)) / scale


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def quantile(values: Array, share: float) -> float:
    """What a share of finite values does not exceed, interpolated as by `numpy.quantile`.

    That, and `numpy.median`, load `numpy.ma`: a twentieth of the start of a command.
    """
    place = share * (len(values) - 1)
    below = int(place)
    ordered = np.partition(values, below)
    above = ordered[below + 1 :].min() if place > below else ordered[below]
    return float(np.interp(place, (below, below + 1), (ordered[below], above)))


def _correlation(first: Array, second: Array) -> float:
    """Pearson's, and zero where either does not vary."""
    a, b = first - np.mean(first), second - np.mean(second)
    scale = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / scale if scale > 0 else 0.0

"""Ordinary least squares on the filtered regressor, corrected for encoder noise.

Standard deviations hold when residuals are coloured.

Source: IDIM-LS with parallel filtering and decimation (Gautier 1997; Janot et al. 2014); the
correction is that of errors in variables with known variance (Fuller 1987), to first order.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.estimation.covariance import coloured_std
from edge_ident.model.model import Estimate
from edge_ident.signals.conditioning import Signals, decimated, decimation, unit_length
from edge_ident.signals.filters import lowpass
from edge_ident.signals.standstill import shortest_move_s

Array = NDArray[np.float64]

_FEWEST_SAMPLES: Final = 12
"""Three for each parameter."""
_NOISE_POWER_STD: Final = 0.5
"""Relative deviation of the encoder noise's power from that predicted for white noise: at constant
speed quantization makes tones, most of them outside the band."""
_TINY: Final = float(np.finfo(float).tiny)


# Columns of a linear model, decomposed once for all who ask of them.

_RANK: Final = 1e-10
"""Singular value over the largest that counts as zero."""


class Columns:
    """A regressor, its columns of unit length, and their singular value decomposition.

    Parameters
    ----------
    values : (N, P) array

    Attributes
    ----------
    values : (N, P) array
    unit : (N, P) array
        Columns of unit length.
    length : (P,) array
        That they had; one for empty ones.
    """

    def __init__(self, values: Array) -> None:
        self.values = values
        self.unit, self.length = unit_length(values)

    @cached_property
    def svd(self) -> tuple[Array, Array, Array]:
        """Left singular vectors (N, P) of `unit`, singular values (P,), and right vectors (P, P)
        in rows."""
        left, singular, right = np.linalg.svd(self.unit, full_matrices=False)
        return left, singular, right

    def solved(self, effort: Array, rank: float = _RANK) -> Array:
        """Least-squares parameters (P,) of the unit columns for an effort (N,).

        Parameters
        ----------
        rank : float
            Singular value over the largest up to which a direction counts as zero.
        """
        left, singular, right = self.svd
        kept = singular > rank * singular[0]
        return np.asarray(right[kept].T @ ((left[:, kept].T @ effort) / singular[kept]))

    @cached_property
    def inverse(self) -> Array:
        """Inverse (P, P) of the unit columns' normal matrix."""
        _, singular, right = self.svd
        kept = singular > _RANK * singular[0]
        root = right[kept].T / singular[kept]
        return np.asarray(root @ root.T)

    @property
    def condition_number(self) -> float:
        """Condition number of the unit columns; infinite where one follows from the others."""
        singular = self.svd[1]
        return float(singular[0] / singular[-1]) if singular[-1] > 0.0 else float(np.inf)


@dataclass(frozen=True)
class EstimationPart:
    """Samples of signals that an estimate is made from.

    Attributes
    ----------
    samples : (n,) array of int
    regressor : (N, 4) array
        Of all samples.
    """

    samples: NDArray[np.intp]
    regressor: Array

    @cached_property
    def columns(self) -> Columns:
        """The regressor at these samples."""
        return Columns(self.regressor[self.samples])


def fit(signals: Signals, part: EstimationPart) -> Estimate:
    """Estimate the base model's parameters.

    The estimate is corrected for the bias by encoder noise and by reversals that the filter moves.
    The standard deviations include the noise in effort and regressor, and the uncertainty of both
    corrections.

    Parameters
    ----------
    signals : Signals
    part : EstimationPart
        `estimation_part` of the signals, with any effort.
    """
    effort, columns = signals.effort[part.samples], part.columns
    plain, noise = columns.solved(effort), motion_noise(signals)
    noise_shift, noise_std = _encoder_noise_bias(noise, columns, plain)
    turn_shift, turn_std = _reversal_bias(signals, noise, part, plain)
    normalized = plain + noise_shift + turn_shift
    std = coloured_std(columns.unit, effort - columns.unit @ normalized, columns.svd)
    std = np.sqrt(std**2 + noise_std**2 + turn_std**2)
    return Estimate(normalized / columns.length, std / columns.length)


def estimation_part(signals: Signals) -> EstimationPart:
    """Samples to estimate from: moving, and decimated to what the filter passes.

    Raises
    ------
    DataError
        Hardly any sample is left.
    """
    part = decimated(len(signals.effort), signals.cutoff_hz, signals.period_s)
    moving: NDArray[np.intp] = part[signals.moving[part]]
    if len(moving) < _FEWEST_SAMPLES:
        raise DataError(
            f"only {len(moving)} independent samples show the axis in motion",
            "record a longer motion, or one with less time at rest, or with longer moves, or "
            f"sample faster: {1.0 / signals.recorded_period_s:.4g} Hz shows moves between rests "
            f"of {shortest_move_s(signals.cutoff_hz):.2g} s, or more",
        )
    return EstimationPart(moving, signals.regressor)


def solve(columns: Columns, effort: Array, *, acceleration_noise: float = 0.0) -> Estimate:
    """Ordinary least squares, for a regressor with little noise or none.

    A loop follows the noise of its encoder up to its bandwidth. There the noise in the recorded
    acceleration biases less than white noise, somewhere between nothing and all. So half of the
    bias is corrected, and the other half is part of the deviation.

    Parameters
    ----------
    columns : Columns
        (N, 4).
    effort : (N,) array
    acceleration_noise : float
        Standard deviation that white noise of the encoder has in the first column.
    """
    plain, inverse = columns.solved(effort), columns.inverse
    power = len(effort) * (acceleration_noise / columns.length[0]) ** 2
    half = 0.5 * power / (1.0 + power * inverse[0, 0]) * plain[0] * inverse[0]
    normalized = plain + half
    std = coloured_std(columns.unit, effort - columns.unit @ normalized, columns.svd)
    return Estimate(normalized / columns.length, np.hypot(std, half) / columns.length)


def motion_noise(signals: Signals) -> tuple[float, float]:
    """Standard deviation of encoder noise in acceleration and velocity, spectra as f⁴ and f²."""
    acceleration = signals.acceleration_noise * float(np.std(signals.regressor[:, 0]))
    return acceleration, acceleration * np.sqrt(5.0 / 3.0) / (2.0 * np.pi * signals.cutoff_hz)


def _encoder_noise_bias(
    noise: tuple[float, float], columns: Columns, plain: Array
) -> tuple[Array, Array]:
    """Correction of the plain estimate for noise in its regressor, and its standard deviation.

    Noise of covariance S in N samples reduces the parameters β by (XᵀX)⁻¹·N·S·β. Where that is not
    small, the motion shows mostly noise: the correction is reduced, its standard deviation is not.
    """
    deviation = np.array([*noise, 0.0, 0.0])
    power = len(columns.values) * (deviation / columns.length) ** 2
    bias = columns.inverse @ (power * plain)
    share = float(np.diag(columns.inverse) @ power)
    return bias / (1.0 + share), (_NOISE_POWER_STD + share) * np.abs(bias)


def _reversal_bias(
    signals: Signals, noise: tuple[float, float], part: EstimationPart, plain: Array
) -> tuple[Array, Array]:
    """Correction of the plain estimate for reversals seen too early or late, and its deviation.

    Where the filtered velocity passes zero, the true one differs by what the filter removes, and
    until that passes zero too, Coulomb friction acts the other way. A filter of half the bandwidth
    shows about how much is removed. The part above the encoder's noise is corrected. The deviation
    is as large as the correction would be with all of it.
    """
    acceleration, velocity = signals.regressor[:, 0], signals.regressor[:, 1]
    length, samples = part.columns.length, part.samples
    turns = np.flatnonzero((velocity[1:] * velocity[:-1] <= 0.0) & signals.moving[1:])
    turns = turns[(turns >= samples[0]) & (turns <= samples[-1])]
    lost = lowpass(velocity, 0.5 * signals.cutoff_hz, signals.period_s)[turns] - velocity[turns]
    significant = 1.0 - np.minimum(1.0, (noise[1] / np.maximum(np.abs(lost), _TINY)) ** 2)
    early_s = lost / np.maximum(np.abs(acceleration[turns]), _TINY)
    early_s = np.clip(early_s, -1.0 / signals.cutoff_hz, 1.0 / signals.cutoff_hz)
    step = decimation(len(velocity), signals.cutoff_hz, signals.period_s)
    early = early_s / (step * signals.period_s)
    moved = (signals.regressor[turns] / length).T * (2.0 * plain[2] / length[2] * early)
    pulses = part.columns.inverse @ moved
    return pulses @ significant, np.linalg.norm(pulses, axis=1)

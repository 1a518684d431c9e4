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
from edge_ident.model.model import Array, Estimate
from edge_ident.signals import conditioning
from edge_ident.signals.filters import lowpass
from edge_ident.signals.metrics import dct2, transformable

_FEWEST_SAMPLES: Final = 12  # three for each parameter
# Relative deviation of the encoder noise's power from that predicted for white noise: at constant
# speed quantization makes tones, most of them outside the band.
_NOISE_POWER_STD: Final = 0.5
_TINY: Final = float(np.finfo(float).tiny)


# Columns of a linear model, decomposed once for all who ask of them.

_RANK: Final = 1e-10  # singular value over the largest that counts as zero


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
        self.unit, self.length = conditioning.unit_length(values)

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


def fit(signals: conditioning.Signals, part: EstimationPart) -> Estimate:
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


def estimation_part(signals: conditioning.Signals) -> EstimationPart:
    """Samples to estimate from: moving, and decimated to what the filter passes.

    Raises
    ------
    DataError
        Hardly any sample is left.
    """
    part = conditioning.decimated(len(signals.effort), signals.cutoff_hz, signals.period_s)
    moving: NDArray[np.intp] = part[signals.moving[part]]
    if len(moving) < _FEWEST_SAMPLES:
        raise DataError(
            f"only {len(moving)} independent samples show the axis in motion",
            "record a longer motion, or one with less time at rest, or with longer moves, or "
            f"sample faster: {1.0 / signals.recorded_period_s:.4g} Hz shows moves between rests "
            f"of {conditioning.shortest_move_s(signals.cutoff_hz):.2g} s, or more",
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


def motion_noise(signals: conditioning.Signals) -> tuple[float, float]:
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
    signals: conditioning.Signals, noise: tuple[float, float], part: EstimationPart, plain: Array
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
    step = conditioning.decimation(len(velocity), signals.cutoff_hz, signals.period_s)
    early = early_s / (step * signals.period_s)
    moved = (signals.regressor[turns] / length).T * (2.0 * plain[2] / length[2] * early)
    pulses = part.columns.inverse @ moved
    return pulses @ significant, np.linalg.norm(pulses, axis=1)


# Standard deviations of a least-squares estimate whose residuals are coloured.
#
# The residual's spectrum is unknown. At the few lowest frequencies, where a slow motion shows its
# parameters, it is hardly measured. So the method averages over spectra instead of estimating one:
#
# - The discrete cosine transform turns stationary noise into nearly independent coefficients. The
#   logarithm of their variance is a broken line over the logarithm of frequency. Its steps from
#   octave to octave are a random walk of unknown step size. Nothing more is assumed.
# - The likelihood is the restricted one (Patterson and Thompson 1971). It accounts for the part of
#   the noise that the fitted parameters removed from the residual.
# - The variance of every parameter follows from the spectrum. The uncertainty of its logarithm
#   widens the interval (Laplace's approximation), as Student's t does for white noise.
#
# The method combines known parts: Whittle's likelihood in the cosine domain, Gamma regression of a
# log-spectrum, and empirical Bayes over the step size.

Svd = tuple[Array, Array, Array]

_NORMAL_95: Final = 1.959964  # half a 95 % interval in standard deviations
# Sizes of the random walk that are averaged over, in natural logarithms of power: from white noise
# to the slope of a second-order low-pass, 2.8.
_STEPS: Final = (0.05, 0.2, 0.5, 1.0, 2.0)
_LOWEST_RESOLVED: Final = 8.0  # index of the cosine below which octaves are no longer told apart
# Cosines up to which each counts alone. Beyond, neighbours are taken together:
_ALONE: Final = 1 << 13
_TOGETHER: Final = 512  # groups in an octave, where the spectrum changes by a straight line
# Part of the cosines that the spectrum is fitted to; beyond, the low-pass filter cuts off.
_BAND: Final = 0.6
_LARGEST_ITERATIONS: Final = 10
_LARGEST_CHANGE: Final = 2.0  # largest change of a logarithm of power in one iteration
# Change of a logarithm of power, of which hardly anything is left in the next iteration.
_CONVERGED: Final = 0.05
"""Singular value over the largest that counts as zero."""
_ROUNDING: Final = 1e-14  # relative rounding error of a normal matrix


@dataclass(frozen=True)
class _Cosines:
    """Groups of neighbouring cosines, in which the noise has one power.

    Attributes
    ----------
    number : (N,) array
        Of cosines in each group.
    walk : (N, M) array
    products : (N, (K + 1)²) array
        Sums of the products of the residual and of the regressor's column space, in cosines; the
        residual comes last.
    of_columns : (K², N) array
        Of them, those without the residual.
    ridge : (K, K) array
        Keeps columns without content in the band from making their sum singular.
    """

    number: Array
    walk: Array
    products: Array
    of_columns: Array
    ridge: Array

    @classmethod
    def of(cls, basis: Array, noise: Array, walk: Array, starts: NDArray[np.intp]) -> "_Cosines":
        """Take cosines together, from each start to the next."""
        columns = np.concatenate([basis, noise[:, None]], axis=1)
        number = np.empty(len(starts))
        number[:-1], number[-1] = starts[1:] - starts[:-1], len(noise) - starts[-1]
        products = _sums(pair_products(columns), starts)
        of_columns = products.reshape(-1, columns.shape[1], columns.shape[1])[:, :-1, :-1]
        flat = of_columns.reshape(len(products), -1).T.copy()
        return cls(number, walk, products, flat, _RANK * np.eye(basis.shape[1]))


@dataclass(frozen=True)
class _Spectra:
    """Log-spectra of the noise, one for each size of the walk's steps.

    Attributes
    ----------
    coefficients : (S, M) array
        Of the walk's columns.
    covariance : (S, M, M) array
    share : (S,) array
        How probable each is.
    """

    coefficients: Array
    covariance: Array
    share: Array


def coloured_std(regressor: Array, residual: Array, svd: Svd | None = None) -> Array:
    """Standard deviation of each ordinary least-squares parameter.

    Scaled so that value ± 1.96 std is a 95 % interval, however few the samples.

    Parameters
    ----------
    regressor : (N, K) array, N > K
    residual : (N,) array
    svd : tuple of arrays, optional
        Reduced singular value decomposition of the regressor, where it is known already.

    Returns
    -------
    (K,) array
    """
    samples, count = transformable(len(regressor)), regressor.shape[1]
    if svd is None or samples < len(regressor):
        svd = np.linalg.svd(regressor[:samples], full_matrices=False)
    residual = residual[:samples]
    scale = float(np.sqrt(np.mean(residual**2)))
    if scale == 0.0:
        return np.zeros(count)
    left, singular, right = svd
    kept = singular > _RANK * singular[0]
    basis, noise = dct2(left[:, kept]), dct2(residual / scale)
    band = min(samples, max(int(_BAND * samples), count + 4))
    starts = _starts(samples, band)
    walk, fitted = _walk(starts, samples, band), starts[starts < band]
    cosines = _Cosines.of(basis[:band], noise[:band], walk[: len(fitted)], fitted)
    weights = basis @ (right[kept] / singular[kept, None])
    return scale * _std(_sums(weights**2, starts), walk, _fit(cosines))


def _std(weights: Array, walk: Array, spectra: _Spectra) -> Array:
    """Deviation of a sum of the noise's cosines with given (N, K) squared weights.

    A normal variable whose log-variance is itself normal with variance s² has its 97.5 % quantile
    at z·(1 + (z² - 1)/8·s²), to second order in s; within 2 % up to s = 2.
    """
    power = np.exp(spectra.coefficients @ walk.T)
    variance = np.maximum(power @ weights, _TINY)
    slope = (power[:, None, :] * weights.T) @ walk / variance[..., None]
    spread = np.sum((slope @ spectra.covariance) * slope, axis=2)
    mean = spectra.share @ np.log(variance)
    spread = spectra.share @ (spread + (np.log(variance) - mean) ** 2)
    return np.asarray(np.exp(0.5 * mean) * (1.0 + (_NORMAL_95**2 - 1.0) / 8.0 * spread))


def _starts(samples: int, band: int) -> NDArray[np.intp]:
    """First cosines of the groups; the band is made of whole groups."""
    if samples <= _ALONE:
        return np.arange(samples)
    octaves = np.log2(samples / _ALONE)
    beyond = _ALONE * 2.0 ** (np.arange(int(octaves * _TOGETHER) + 1) / _TOGETHER)
    starts = np.sort(np.concatenate([np.arange(_ALONE), beyond.astype(np.intp), [band]]))
    starts = starts[starts < samples]
    return np.asarray(starts[np.diff(starts, prepend=-1) > 0])


def _sums(values: Array, starts: NDArray[np.intp]) -> Array:
    """Sums of (N, ...) values by group."""
    return values if len(starts) == len(values) else np.add.reduceat(values, starts)


def _walk(starts: NDArray[np.intp], samples: int, band: int) -> Array:
    """Columns of a broken line at the middle of each group.

    They are its level, and steps of about an octave up to the band's end.
    """
    middle = 0.5 * (starts + np.append(starts[1:], samples) - 1.0)
    last = np.log2(1.0 + (band - 1) / _LOWEST_RESOLVED)
    place = np.log2(1.0 + middle / _LOWEST_RESOLVED) / last * max(1, round(last))
    walk = np.ones((len(starts), max(1, round(last)) + 1))
    walk[:, 1:] = np.minimum(np.maximum(place[:, None] - np.arange(walk.shape[1] - 1), 0.0), 1.0)
    return walk


def _fit(cosines: _Cosines) -> _Spectra:
    """Modes of the restricted posterior by Fisher scoring, all step sizes at once."""
    walk, squares = cosines.walk, pair_products(cosines.walk)
    sizes, columns = len(_STEPS), walk.shape[1]
    prior = np.outer(np.array(_STEPS) ** -2, np.arange(columns) > 0)
    ridge = prior[:, :, None] * np.eye(columns)
    current = np.tile(_start(cosines), (sizes, 1))
    for left in reversed(range(_LARGEST_ITERATIONS)):
        log_power = current @ walk.T
        chi2, free, normal = _restricted(cosines, log_power)
        gradient = 0.5 * (chi2 - free) @ walk - prior * current
        information = 0.5 * (free @ squares).reshape(ridge.shape) + ridge
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        change = _each(covariance, gradient)
        largest = np.abs(change @ walk.T).max(axis=1, keepdims=True)
        if largest.max() < _CONVERGED or left == 0:
            break
        current = current + change / np.maximum(1.0, largest / _LARGEST_CHANGE)
    evidence = -0.5 * (
        np.sum(cosines.number * log_power + chi2, axis=1)
        + np.linalg.slogdet(normal)[1]
        + np.linalg.slogdet(information)[1]
        + np.sum(prior * current**2, axis=1)
        - np.sum(np.log(prior[:, 1:]), axis=1)
    )
    share = np.exp(evidence - np.max(evidence))
    # from the mode to the mean: the third derivative of the likelihood is half of `free`
    spread = covariance.reshape(sizes, -1) @ squares.T
    shift = 0.25 * _each(covariance, (free * spread) @ walk)
    return _Spectra(current + shift, covariance, share / np.sum(share))


def _restricted(cosines: _Cosines, log_power: Array) -> tuple[Array, Array, Array]:
    """What (S, N) log-spectra leave of the noise once the parameters are fitted by them.

    Returns
    -------
    chi2 : (S, N) array
        Squares over their power.
    free : (S, N) array
        What these should be: one for each cosine, less the part that the parameters took.
    normal : (S, K, K) array
        Normal matrix of the parameters.
    """
    precision, columns = np.exp(-log_power), len(cosines.ridge)
    sums = (precision @ cosines.products).reshape(-1, columns + 1, columns + 1)
    normal = sums[:, :-1, :-1] + precision.sum() / precision.size * cosines.ridge
    inverse = np.linalg.inv(normal)
    left = np.ones(sums.shape[:2])
    left[:, :-1] = -_each(inverse, sums[:, :-1, -1])
    squares = pair_products(left) @ cosines.products.T
    taken = inverse.reshape(len(inverse), -1) @ cosines.of_columns
    chi2 = np.maximum(squares, 0.0) * precision
    return chi2, np.maximum(cosines.number - taken * precision, 0.0), normal


def _each(matrices: Array, vectors: Array) -> Array:
    """Products of (S, M, M) matrices with (S, M) vectors."""
    return (matrices @ vectors[..., None])[..., 0]


def pair_products(columns: Array) -> Array:
    """Products of every two of K columns (N, K), as (N, K²)."""
    return (columns[:, :, None] * columns[:, None, :]).reshape(len(columns), -1)


def _start(cosines: _Cosines) -> Array:
    """Least squares on the log-periodogram, whose mean lies 1.27 below the logarithm of power.

    That of a mean of n squares lies about 1/n of it below. Where the parameters took the noise out,
    it says little.
    """
    number, squares = cosines.number, cosines.products[:, :: len(cosines.ridge) + 2]
    free = np.maximum(number - np.sum(squares[:, :-1], axis=1), 1e-3 * number)
    logarithm = np.log(squares[:, -1] / free + 1e-9) + 1.27 / number
    weight = free / np.sqrt(number)
    rows = cosines.walk * weight[:, None]
    # normal equations take a quarter of the time, and this is only where the search begins
    normal = rows.T @ rows
    ridge = _ROUNDING * np.trace(normal) * np.eye(len(normal))
    return np.asarray(np.linalg.solve(normal + ridge, rows.T @ (logarithm * weight)))

"""The network's input: the outer product of two efforts, ψαᵀ, as an image."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.conditioning import Array, Signals
from edge_ident.signals.metrics import dct2, idct2, subsample

Normalization = Literal["effort-scale", "min-max"]


def effort_scale(measured_effort: Array, normalization: Normalization) -> Array:
    """What efforts are divided by before they make an image.

    An image shows guess and measurement only as a product, so the measurement's known scale is
    what tells them apart. "min-max" takes the peak, as the paper does. "effort-scale" takes √2
    times the root mean square (the peak of a sine): noise of 2 % of the effort raises the peak by
    4 % and the root mean square by 0.02 %, and the residuals err by as much.

    Parameters
    ----------
    measured_effort : (..., points) array

    Returns
    -------
    (...) array
    """
    if normalization == "min-max":
        return np.asarray(np.max(np.abs(measured_effort), axis=-1))
    return np.asarray(np.sqrt(2.0 * np.mean(measured_effort**2, axis=-1)))


def effort_image(
    model_effort: Array, measured_effort: Array, normalization: Normalization
) -> NDArray[np.float32]:
    """Image of guessed parameters against the measurement (M = ψαᵀ of the paper).

    Parameters
    ----------
    model_effort : (n, points) array
        Effort of the model at each of n guesses, over the measurement's `effort_scale`.
    measured_effort : (points,) or (n, points) array
        Measured effort over its own `effort_scale`.
    normalization : {"effort-scale", "min-max"}

    Returns
    -------
    (n, 1, points, points) float32 array
    """
    measured = np.broadcast_to(measured_effort, model_effort.shape)
    scale, offset = scale_and_offset(model_effort, measured, normalization)
    image = (scale[:, None] * model_effort)[:, :, None] * measured[:, None, :]
    return (image + offset[:, None, None])[:, None].astype(np.float32)


def scale_and_offset(
    model_effort: Array, measured_effort: Array, normalization: Normalization
) -> tuple[Array, Array]:
    """The normalization as an affine map of the image: scale·M + offset.

    "effort-scale" changes nothing, since the efforts come scaled. "min-max" maps each image to
    [0, 1] as the paper does, which hides the scale of both efforts.

    Parameters
    ----------
    model_effort, measured_effort : (n, points) arrays

    Returns
    -------
    scale, offset : (n,) arrays
    """
    if normalization == "effort-scale":
        return np.ones(len(model_effort)), np.zeros(len(model_effort))
    # the extremes of an outer product are products of the vectors' extremes
    model_ends = np.stack([model_effort.min(axis=1), model_effort.max(axis=1)])
    measured_ends = np.stack([measured_effort.min(axis=1), measured_effort.max(axis=1)])
    products = (model_ends[:, None] * measured_ends[None, :]).reshape(4, -1)
    low, high = products.min(axis=0), products.max(axis=0)
    scale = 1.0 / np.maximum(high - low, np.finfo(np.float32).tiny)
    return scale, -low * scale


# Bring a periodic recording to the phase and length that a network was trained for.
#
# A network knows one motion, started at one phase (docs/network.md). A recording of the same motion
# may start at any phase. It is averaged over its whole periods and rotated in time to the network's
# start, so one network serves the sine of one axis and the cosine of the other.

Complex = NDArray[np.complex128]

_MISSING_SHARE: Final = 0.002  # share of a period that a recording may lack at its end


@dataclass(frozen=True)
class Subsampled:
    """What the network's image is made of.

    Attributes
    ----------
    regressor : (L, 4) array
        Subsampled, SI.
    effort : (L,) array
    """

    regressor: Array
    effort: Array


def align(signals: Signals, velocity: Array, period_s: float) -> Subsampled | None:
    """Average, rotate and subsample one axis.

    Parameters
    ----------
    signals : Signals
    velocity : (L,) array
        Subsampled velocity of the motion the network was trained for.
    period_s : float
        Its period.

    Returns
    -------
    Subsampled or None
        None where the recording is shorter than one period, or a period has fewer samples than the
        network reads.
    """
    samples = round(period_s / signals.period_s)
    available = len(signals.effort)
    if available < samples * (1.0 - _MISSING_SHARE) or min(samples, available) < len(velocity):
        return None
    samples = min(samples, available)
    periods = available // samples
    # columns are large: none has a name that is not needed any more
    period = np.stack([*signals.regressor.T, signals.effort])[:, : periods * samples]
    period = period.reshape(len(period), periods, samples).mean(axis=1)
    shift = _circular_shift(period[1], _spectrum(tuple(velocity.tolist()), samples))
    period = np.roll(period, shift, axis=1)
    seen = subsample(period.T, len(velocity))
    return Subsampled(regressor=seen[:, :-1], effort=seen[:, -1])


def _circular_shift(signal: Array, reference: Complex) -> int:
    """Samples by which to roll a signal for the best match with the reference's spectrum."""
    product = reference * np.conj(np.fft.rfft(signal))
    return int(np.argmax(np.fft.irfft(product, len(signal))))


@lru_cache(maxsize=8)
def _spectrum(velocity: tuple[float, ...], samples: int) -> Complex:
    """Spectrum of a signal that `edge_ident.signals.metrics.subsample` made of so many samples.

    It had no higher coefficients. The network's motion is the same for every recording.
    """
    coefficients = np.zeros(samples)
    coefficients[: len(velocity)] = dct2(np.array(velocity))
    return np.fft.rfft(idct2(coefficients) * np.sqrt(samples / len(velocity)))

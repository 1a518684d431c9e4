"""The network's input: the outer product of two efforts, ψαᵀ, as an image."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
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

"""The paper's motion, as it is and as recordings show it."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.dct import subsample
from edge_ident.model import regressor
from edge_ident.signals import condition

Array = NDArray[np.float64]

PERIOD_S: Final = 0.0025
SAMPLES: Final = 8742
AMPLITUDE_RAD: Final = 2.0 * np.pi
RATE_RAD_S: Final = 0.2875
COUNT_RAD: Final = 2.0 * np.pi / 8400.0
"""One count of the encoder on the gearbox output."""
RISE_TIME_S: Final = 0.2
"""Of a soft controller."""


def column_scales() -> Array:
    """Peaks (4,) of the nominal acceleration, velocity, sign and one."""
    return np.array([AMPLITUDE_RAD * RATE_RAD_S**2, AMPLITUDE_RAD * RATE_RAD_S, 1.0, 1.0])


def motion_columns(
    amplitude: float, shift_s: float, *, measured: bool = False, lag_rad: float = 0.0
) -> Array:
    """Subsampled regressor of a motion near the nominal one.

    Parameters
    ----------
    amplitude : float
        Over the nominal one.
    shift_s : float
        Time by which the motion is ahead.
    measured : bool
        Quantize the position as the encoder does, then filter and differentiate it as a
        recording is; otherwise differentiate exactly.
    lag_rad : float
        Of a measured motion: distance by which friction lets a soft controller fall behind,
        so that the axis stands still after each reversal until the reference is that far ahead.

    Returns
    -------
    (100, 4) array
        In SI.
    """
    time = PERIOD_S * np.arange(SAMPLES)
    phase = RATE_RAD_S * (time + shift_s)
    position = amplitude * AMPLITUDE_RAD * np.sin(phase)
    if measured:
        counted = COUNT_RAD * np.round(_lagging(position, lag_rad) / COUNT_RAD)
        return subsample(condition(time, counted, np.zeros_like(time)).regressor)
    velocity = amplitude * AMPLITUDE_RAD * RATE_RAD_S * np.cos(phase)
    return subsample(regressor(velocity, -(RATE_RAD_S**2) * position))


def _lagging(reference: Array, lag_rad: float) -> Array:
    """Follow a periodic reference as far behind as friction makes it: the play operator, smoothed.

    The mean over the rise time of a soft controller stands for the speed that it takes up.
    """
    position, followed = float(reference[0]), []
    for wanted in np.tile(reference, 2).tolist():  # the first period settles
        position = min(max(position, wanted - lag_rad), wanted + lag_rad)
        followed.append(position)
    width = round(RISE_TIME_S / PERIOD_S)
    padded = np.pad(followed[len(reference) :], width // 2, mode="wrap")
    return np.convolve(padded, np.full(width + 1, 1.0 / (width + 1)), mode="valid")


def perturbed_motions(rng: np.random.Generator, count: int) -> Array:
    """Columns of recordings of the motion over `column_scales`, (count, 100, 4).

    Amplitude within 3 %, time within 20 ms; every second one as the encoder shows it, half of
    these with a friction lag of up to 0.08 rad (standstills of up to 0.8 s).
    """
    amplitudes = 1.0 + rng.uniform(-0.03, 0.03, count)
    shifts_s = rng.uniform(-0.02, 0.02, count)
    lags_rad = np.maximum(0.0, rng.uniform(-0.08, 0.08, count))
    columns = [
        motion_columns(amplitude, shift_s, measured=index % 2 == 1, lag_rad=lag_rad)
        for index, (amplitude, shift_s, lag_rad) in enumerate(
            zip(amplitudes, shifts_s, lags_rad, strict=True)
        )
    ]
    return np.stack(columns) / column_scales()

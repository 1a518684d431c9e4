"""The shift in time between effort and position.

A command that is held over the sample period acts half a period late. A current that is filtered,
or read before the encoder, adds its own share. So every recording of a digital controller has a
shift of up to about one period. It is no fault of the machine, and belongs to every model of it.

An effort that is recorded d late is effort(t - d), to first order effort - d·rate. The shift is
the coefficient of the model's rate beside the columns of the model. Encoder noise spoils this rate.
So the recorded effort's own rate, in a narrower band, serves as its instrument (Söderström and
Stoica 1983): noise of the rate then widens the interval and does not bias the shift. The rate has
the whole band: a part of it would leave the rest of the shift to the columns.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from edge_ident.model.motion import LARGEST_SHIFT, Array
from edge_ident.signals.filters import lowpass

# Bandwidth of the instrument, of the signals'. The controller answers the noise of its encoder, and
# this answer imitates a shift. Its power grows with the fifth power of the bandwidth.
_INSTRUMENT_BAND: Final = 1.0 / 3.0
REACH_S: Final = 0.25
"""Largest shift that is tried: no loop that is later can follow a motion at all."""
STEPS_PER_PERIOD: Final = 8
"""Shifts that are tried in a cut-off period."""
# Blocks of time whose scatter tells the deviation: longer than the memory of a residual.
_BLOCKS: Final = 40
CERTAIN: Final = 3.0
"""Standard deviations beyond the limit from which a shift is a delay: the usual three-sigma rule.
"""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Shift:
    """Time by which the effort is recorded late.

    Attributes
    ----------
    shift_s, std_s : float
        Within 1.5 sampling periods, with its standard deviation for coloured residuals. Where the
        recording says nothing the shift is zero, and the deviation that of an even distribution
        between the limits.
    unlimited_s, unlimited_std_s : float
        From the recording alone, without limits; zero and infinite where it says nothing.
    """

    shift_s: float
    std_s: float
    unlimited_s: float
    unlimited_std_s: float


def solve_shift(
    regressor: Array,
    rate: Array,
    effort: Array,
    instrument: Array,
    sampling_s: float,
    known_rate: Array | float = 0.0,
) -> Shift:
    """Solve for the shift, from signals at the samples that count.

    Parameters
    ----------
    regressor, rate : (n, P) arrays
        Columns of the model, and their time derivatives where these are signals.
    effort : (n,) array
    instrument : (n,) array
        Slow part of the effort's rate, negative: what a shift adds to the effort, per s.
    sampling_s : float
        Sampling period of the recording, which limits the shift.
    known_rate : (n,) array, optional
        Rate of what was taken out of the effort before, which is late as well.
    """
    if len(effort) <= 2 * regressor.shape[1]:
        return within_limits(0.0, np.inf, sampling_s)
    basis, residual, parameters = _projected(regressor, effort)
    column, instrument = (
        x - basis @ (basis.T @ x) for x in (-(rate @ parameters + known_rate), instrument)
    )
    gain = float(instrument @ column)
    if gain <= _TINY:
        return within_limits(0.0, np.inf, sampling_s)
    unlimited = float(instrument @ residual) / gain
    std = np.sqrt(_variance(instrument * (residual - unlimited * column))) / gain
    return within_limits(unlimited, float(std), sampling_s)


def within_limits(unlimited_s: float, std_s: float, sampling_s: float) -> Shift:
    """A shift that is known to lie within 1.5 sampling periods, whatever a recording says of it."""
    largest_s = LARGEST_SHIFT * sampling_s
    even = largest_s / np.sqrt(3.0)
    believed = 1.0 / (1.0 + (std_s / even) ** 2)
    # less certain than the limits, it says a direction at most
    said_s = np.clip(unlimited_s, -largest_s, largest_s) if std_s > largest_s else unlimited_s
    return Shift(
        shift_s=float(np.clip(said_s * believed, -largest_s, largest_s)),
        std_s=float(even * np.sqrt(1.0 - believed)),
        unlimited_s=unlimited_s,
        unlimited_std_s=std_s,
    )


def vertex(left: Sequence[float]) -> tuple[float, float]:
    """Where a parabola through 3 evenly spaced values is least, in steps from the middle one, and
    its bend: the second difference. It is the middle one where the parabola has no least value."""
    lower, middle, upper = left
    bend = lower + upper - 2.0 * middle
    return (0.5 * (lower - upper) / bend if bend > 0.0 else 0.0), bend


def smallest_at(left: Sequence[float], sampling_s: float) -> float:
    """The shift in s, within the limits, at which a model leaves least.

    Parameters
    ----------
    left : sequence of 3 floats
        What it leaves, squared, at the lower limit, at zero and at the upper limit. In between it
        is a parabola, as long as the limit is a small part of a period.
    sampling_s : float
    """
    largest_s, (place, bend) = LARGEST_SHIFT * sampling_s, vertex(left)
    if bend <= 0.0:
        return largest_s * (-1.0, 0.0, 1.0)[int(np.argmin(left))]
    return float(np.clip(place, -1.0, 1.0)) * largest_s


def beyond_limit(shift: Shift, sampling_s: float) -> bool:
    """Whether an effort is late, or early, by more than a controller's timing can be."""
    beyond = abs(shift.unlimited_s) - LARGEST_SHIFT * sampling_s
    return beyond > CERTAIN * shift.unlimited_std_s


def slow(effort: Array, cutoff_hz: float, period_s: float) -> Array:
    """Part of an effort (N,) that is slow enough for its rate to be signal, and hardly noise."""
    return lowpass(effort, _INSTRUMENT_BAND * cutoff_hz, period_s)


def _projected(regressor: Array, effort: Array) -> tuple[Array, Array, Array]:
    """Orthonormal basis (n, R) of a regressor; least-squares residual (n,) and parameters (P,)."""
    length = np.maximum(np.linalg.norm(regressor, axis=0), _TINY)
    left, singular, right = np.linalg.svd(regressor / length, full_matrices=False)
    kept = singular > 1e-9 * singular[0]
    basis = left[:, kept]
    seen = basis.T @ effort
    parameters = right[kept].T @ (seen / singular[kept]) / length
    return basis, effort - basis @ seen, parameters


def _variance(products: Array) -> float:
    """Variance of the sum of coloured products (n,), from the sums of blocks of time."""
    ends = np.linspace(0, len(products), min(_BLOCKS, len(products)), endpoint=False)
    sums = np.add.reduceat(products, ends.astype(np.intp))
    return float(sums @ sums)

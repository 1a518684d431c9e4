"""The input of every method: one axis, filtered and raw, the same for all."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation import least_squares
from edge_ident.estimation.least_squares import EstimationPart
from edge_ident.estimation.network import Network
from edge_ident.model.model import Estimate
from edge_ident.signals.conditioning import Signals, condition
from edge_ident.signals.recording import AxisRecord, Recording

Array = NDArray[np.float64]


def _silent(note: str) -> None:
    pass


@dataclass(frozen=True)
class Problem:
    """One axis to identify.

    Attributes
    ----------
    signals : Signals
        Filtered, on an even grid of N samples.
    part : EstimationPart
        The samples of it from which all methods estimate and on which all are scored.
    regressor, effort : (M, 4) and (M,) arrays
        Filtered, of those samples.
    time_s : (N,) array
        The even grid.
    axis : AxisRecord
        Unfiltered, on the same grid.
    effort_shift_s : float
        Time from a row's stamp to the middle of the interval in which its effort acted.
    network : Network or None
    tries : int
        Draws that random search has.
    seed : int
        Of all that is random.
    note : callable
        Takes a word on the progress of a method that is slow.
    """

    signals: Signals
    part: EstimationPart
    regressor: Array
    effort: Array
    time_s: Array
    axis: AxisRecord
    effort_shift_s: float
    network: Network | None = None
    tries: int = 8
    seed: int = 0
    note: Callable[[str], None] = _silent

    def with_noise_bias(self, estimate: Estimate, part: float = 1.0) -> Estimate:
        """Widen the inertia's deviation by the bias that noise in the acceleration causes.

        Parameters
        ----------
        estimate : Estimate
        part : float
            Of that noise's power which the method has not dealt with; one for methods that take
            the regressor for exact.
        """
        bias = part * self.signals.acceleration_noise**2 * abs(estimate.parameters[0])
        std = estimate.std.copy()
        std[0] = np.hypot(std[0], bias)
        return Estimate(estimate.parameters, std)


def pose(
    recording: Recording,
    name: str,
    *,
    network: Network | None = None,
    tries: int = 8,
    seed: int = 0,
    note: Callable[[str], None] = _silent,
) -> Problem:
    """Filter one axis of a recording and choose its samples.

    Raises
    ------
    DataError
        Hardly any sample shows the axis in motion.
    """
    axis, time_s = recording.axes[name], recording.time_s
    signals = condition(time_s, axis.position, axis.effort, effort_shift_s=recording.effort_shift_s)
    part = least_squares.estimation_part(signals)
    return Problem(
        signals=signals,
        part=part,
        regressor=part.columns.values,
        effort=signals.effort[part.samples],
        time_s=signals.grid.time_s,
        axis=signals.grid.axis(axis),
        effort_shift_s=recording.effort_shift_s,
        network=network,
        tries=tries,
        seed=seed,
        note=note,
    )


def fit(regressor: Array, effort: Array) -> Array:
    """Parameters of an ordinary least-squares fit, (4,), for methods that build on it."""
    return np.asarray(np.linalg.lstsq(regressor, effort, rcond=None)[0], dtype=np.float64)

"""What was measured in a diagnosis: fits, lines above the band, and signals over time."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.model import Estimate
from edge_ident.signals.metrics import Metric

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModelFit:
    """How well a model describes the valid samples of the recordings.

    Attributes
    ----------
    estimate : Estimate
        Base parameters with standard deviations.
    fitted, held_out : float
        Relative residual of the fit, and of five-fold cross-validation by blocks of time.
    metric : Metric
    effective : Estimate or None
        The same with friction as the line through the friction curve
        (`edge_ident.diagnosis.fit.deviations`); None where the curve is a line.
    motion_error : float or None
        Rms position error of the model in simulation (`edge_ident.diagnosis.motion_check`); None
        where it was not simulated.
    """

    estimate: Estimate
    fitted: float
    held_out: float
    metric: Metric
    effective: Estimate | None = None
    motion_error: float | None = None


@dataclass(frozen=True)
class Traces:
    """Signals over the N samples of a diagnosis, one recording after the other.

    Attributes
    ----------
    time_s, position, velocity, acceleration, effort : (N,) arrays
        Filtered alike; SI units.
    base_effort, extended_effort : (N,) arrays
        Predictions of the base model, fitted alone, and of the extended model.
    contributions : mapping of effect to (N,) array
        Contribution of each cause to the prediction of the extended model.
    since_reversal : (N,) array
        Distance travelled since the last reversal, or since the start before the first.
    valid : (N,) array of bool
        False where encoder quantization aliases into the band; those samples do not count.
    file : (N,) array of int
        Number of the recording, or of the part of one.
    recording : (N,) array of int
        Place of the recording among those given, the same for all axes.
    """

    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array
    effort: Array
    base_effort: Array
    extended_effort: Array
    contributions: Mapping[str, Array]
    since_reversal: Array
    valid: NDArray[np.bool_]
    file: NDArray[np.intp]
    recording: NDArray[np.intp]

    @property
    def several(self) -> bool:
        """Whether they are of more than one recording."""
        return bool(self.file[-1] > 0)


@dataclass(frozen=True)
class SpectralLine:
    """What stands out of the noise of the effort above the band of the comparison: a sinusoid, or
    what keeps no frequency.

    Attributes
    ----------
    order : float or None
        Periods per turn (rad) or per metre, for a sinusoid in position.
    frequency_hz : float or None
        For a sinusoid in time.
    amplitude, std : float
        In the unit of the effort, with its standard deviation; of a sinusoid as strong.
    frequency_range_hz : (float, float) or None
        For what keeps no frequency; `frequency_hz` is None then.
    """

    order: float | None
    frequency_hz: float | None
    amplitude: float
    std: float
    frequency_range_hz: tuple[float, float] | None = None


@dataclass(frozen=True)
class CarriedCause:
    """What another recording says of a cause (`edge_ident.diagnosis.validation`).

    Attributes
    ----------
    effect : str
    without : float or None
        Relative residual there of the model without it.
    gain : float or None
        Relative reduction of that residual by the cause.
    interval : (float, float) or None
        Of the gain, 95 %.
    carries_over : bool or None
        Whether the gain is certain; None where the effect is tied to the time of its recording,
        and the other figures are None as well.
    reason : str
    """

    effect: str
    without: float | None
    gain: float | None
    interval: tuple[float, float] | None
    carries_over: bool | None
    reason: str


@dataclass(frozen=True)
class Validation:
    """Relative residuals of one axis over the valid samples of a recording outside the fit.

    Attributes
    ----------
    base, extended : float
        Of the base model, and of the extended model with what carries over.
    as_found : float
        Of the extended model as the other recordings alone give it.
    friction_anew : (float, float)
        Of base and extended model with friction fitted to that recording, too: it changes with the
        temperature.
    causes : tuple of CarriedCause
        Of that model.
    """

    base: float
    extended: float
    as_found: float
    friction_anew: tuple[float, float]
    causes: tuple[CarriedCause, ...] = ()


# The smallest effect that is worth naming.


TOLERANCE: Final = 0.01
"""Share of the rms effort that is worth naming, unless the caller says otherwise. A judgement: a
hundredth of the effort moves no gain."""
OUTLIER: Final = 5.0
"""Standard deviations of a residual beyond which no noise explains it."""


def worth_naming(left: Array, effort: Array) -> bool:
    """Whether what a model leaves at some samples (m,) is the tolerance of all efforts (n,)."""
    return bool(left @ left >= TOLERANCE**2 * (effort @ effort))


# What a diagnosis says of an axis in one word.


class Verdict(StrEnum):
    """Whether the model of an axis is complete."""

    ADEQUATE = "adequate"
    """The residual of the base model is within the noise floor."""
    EXPLAINED = "explained"
    """The residual of the extended model is within the noise floor."""
    PARTLY_EXPLAINED = "partly_explained"
    """Causes or curves account for a part; the residual of the extended model has structure."""
    UNEXPLAINED = "unexplained"
    """The residual has structure, and nothing is known of it."""

    @property
    def complete(self) -> bool:
        """Whether the model leaves no more than noise."""
        return self in (Verdict.ADEQUATE, Verdict.EXPLAINED)

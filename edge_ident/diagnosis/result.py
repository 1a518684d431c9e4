"""The result of a diagnosis: verdict, causes with their alternatives, and the models compared.

Every residual, metric and share of a diagnosis is taken over the valid samples (`Traces.valid`) of
the recording that it belongs to, and relative to the measured effort at the same samples. So all
figures of one table have one denominator.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.model import AxisModel, Estimate, Model, Term
from edge_ident.signals.metrics import Metric
from edge_ident.support.readable import Readable

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import RenderableType

Array = NDArray[np.float64]


class Verdict(StrEnum):
    """Whether the model of an axis is complete."""

    ADEQUATE = "adequate"
    """The residual of the base model is within the noise floor."""
    EXPLAINED = "explained"
    """The residual of the extended model is within the noise floor."""
    UNEXPLAINED = "unexplained"
    """The residual has structure that no known effect accounts for."""


@dataclass(frozen=True)
class Alternative:
    """Another effect, tested in the place of a cause.

    Attributes
    ----------
    effect : str
    separable : bool
        Whether this motion distinguishes it from the cause.
    evidence : str
        One sentence with the numbers.
    experiment : str
        The motion that distinguishes the two.
    """

    effect: str
    separable: bool
    evidence: str
    experiment: str


@dataclass(frozen=True)
class Cause:
    """An effect that the data support.

    Attributes
    ----------
    term : Term
        The effect with its values and their standard deviations.
    held_out_gain : float
        Relative reduction of the held-out residual's rms, against the model with all other causes.
    held_out_gain_interval : (float, float)
        95 % interval of the block bootstrap.
    share : float
        Rms of its contribution over the rms of the effort.
    alternatives : tuple of Alternative
        The nearest first.
    evidence : str
        What sets the effect apart, and how much it explains, in one sentence.
    decision : str
        Why the acceptance rule accepts it (`edge_ident.diagnosis.select.acceptance`).
    """

    term: Term
    held_out_gain: float
    held_out_gain_interval: tuple[float, float]
    share: float
    alternatives: tuple[Alternative, ...]
    evidence: str
    decision: str


@dataclass(frozen=True)
class Refused:
    """An effect that entered the model, and that the acceptance rule then took out.

    Attributes
    ----------
    effect : str
    reason : str
        The decision in words.
    """

    effect: str
    reason: str


@dataclass(frozen=True)
class NotTestable:
    """An effect that this motion does not excite, and the motion that does."""

    effect: str
    reason: str
    experiment: str


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
    motion_error : float or None
        Rms position error of the model in simulation (`edge_ident.diagnosis.motion_check`); None
        where it was not simulated.
    """

    estimate: Estimate
    fitted: float
    held_out: float
    metric: Metric
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
        Number of the recording.
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


@dataclass(frozen=True)
class AxisDiagnosis:
    """The diagnosis of one axis.

    Attributes
    ----------
    causes : tuple of Cause
        Strongest first.
    refused : tuple of Refused
        Effects that entered the model and left it again.
    external_vibrations : tuple of Term
        Sinusoids in time (`edge_ident.model.external_vibration`), strongest first. They are no
        property of the axis: neither causes nor part of the model.
    converged : bool
        Whether backward elimination reached a model that it does not change. Otherwise the causes
        are those of its last round.
    noise_floor : float
        Relative residual that noise alone leaves.
    noise_floor_source : str
        How it was determined, in words.
    model : AxisModel
        The extended model; the base model where there is no cause.
    cutoff_hz : float
        Bandwidth of the comparison.
    knee_hz : float
        Frequency above which encoder noise dominates and the filter attenuates.

    Examples
    --------
    >>> import edge_ident
    >>> axis = edge_ident.diagnose([edge_ident.simulate()]).axes["x"]
    >>> axis.verdict.value, axis.causes
    ('adequate', ())
    """

    verdict: Verdict
    causes: tuple[Cause, ...]
    refused: tuple[Refused, ...]
    external_vibrations: tuple[Term, ...]
    converged: bool
    not_testable: tuple[NotTestable, ...]
    base: ModelFit
    extended: ModelFit
    noise_floor: float
    noise_floor_source: str
    model: AxisModel
    cutoff_hz: float
    knee_hz: float
    traces: Traces = field(repr=False)


@dataclass(frozen=True)
class DataFinding:
    """A defect of the data, to be read before any cause."""

    code: str
    axis: str
    message: str


@dataclass(frozen=True)
class Validation:
    """Relative residuals of one axis over the valid samples of a recording outside the fit."""

    base: float
    extended: float


@dataclass(frozen=True, repr=False)
class Diagnosis(Readable):
    """The diagnosis of all axes.

    Attributes
    ----------
    axes : mapping of axis name to AxisDiagnosis
    data_quality : tuple of DataFinding
    validation : mapping of axis name to Validation
        Empty without a validation recording.

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.diagnose([edge_ident.simulate()])
    >>> found.understood
    True
    >>> print(found)  # doctest: +ELLIPSIS
    axis x the base model is adequate: ...
    """

    axes: Mapping[str, AxisDiagnosis]
    data_quality: tuple[DataFinding, ...]
    validation: Mapping[str, Validation]

    @property
    def understood(self) -> bool:
        """Whether no axis has structure left that no known effect explains."""
        return all(axis.verdict is not Verdict.UNEXPLAINED for axis in self.axes.values())

    @property
    def model(self) -> Model:
        """The extended models of all axes as one model."""
        return Model({name: axis.model for name, axis in self.axes.items()})

    def __rich__(self) -> "RenderableType":
        from edge_ident.diagnosis.present.tables import diagnosis_view

        return diagnosis_view(self)

    def plot(self) -> "Figure":
        """Draw measured and modelled effort of every axis, and the residuals of both models.

        Raises
        ------
        DataError
            matplotlib is not installed.
        """
        from edge_ident.diagnosis.present.effort_figure import diagnosis_figure

        return diagnosis_figure(self)

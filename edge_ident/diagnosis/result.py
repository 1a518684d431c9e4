"""What a diagnosis says: verdict, causes with rivals, and the model before and after."""

from collections.abc import Mapping
from dataclasses import dataclass
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
    """How an axis stands."""

    ADEQUATE = "adequate"
    """The base model leaves nothing beyond the noise floor."""
    EXPLAINED = "explained"
    """With the causes, nothing is left beyond the noise floor."""
    UNEXPLAINED = "unexplained"
    """Structure is left that no known effect accounts for."""


@dataclass(frozen=True)
class Rival:
    """Another effect that might have been the cause.

    Attributes
    ----------
    effect : str
    separable : bool
        Whether this motion tells it from the cause.
    evidence : str
        One sentence with the numbers.
    experiment : str
        The motion that separates the two.
    """

    effect: str
    separable: bool
    evidence: str
    experiment: str


@dataclass(frozen=True)
class Cause:
    """An effect that was found.

    Attributes
    ----------
    term : Term
        The effect with its values and their standard deviations.
    held_out_gain : float
        Share of the held-out residual (rms) that it takes away from what the other causes leave.
    held_out_gain_interval : (float, float)
        95 % of block-bootstrap resamples.
    share : float
        Rms of its contribution over the rms of the effort.
    rivals : tuple of Rival
        The nearest first.
    evidence : str
        One sentence that a person understands.
    """

    term: Term
    held_out_gain: float
    held_out_gain_interval: tuple[float, float]
    share: float
    rivals: tuple[Rival, ...]
    evidence: str


@dataclass(frozen=True)
class NotTestable:
    """An effect that this motion cannot show, and the motion that would."""

    effect: str
    reason: str
    experiment: str


@dataclass(frozen=True)
class Fit:
    """How well a model describes the recordings.

    Attributes
    ----------
    estimate : Estimate
        Base parameters with standard deviations.
    fitted, held_out : float
        Relative residual where the model was fitted, and in stretches that were left out of it.
    metric : Metric
    motion_error : float or None
        Rms position error when the model is simulated through the recordings
        (`edge_ident.diagnosis.motion_check`); None where that was not done.
    """

    estimate: Estimate
    fitted: float
    held_out: float
    metric: Metric
    motion_error: float | None = None


@dataclass(frozen=True)
class Traces:
    """What a person would look at, over the N samples that the diagnosis used, file after file.

    Attributes
    ----------
    time_s, position, velocity, acceleration, effort : (N,) arrays
        Filtered alike.
    base_effort, extended_effort : (N,) arrays
        Of the base model fitted alone, and of the extended model.
    shares : mapping of effect to (N,) array
        What each cause contributes to the extended model's effort.
    since_reversal : (N,) array
        Distance travelled since the last reversal; since the start before the first.
    clear : (N,) array of bool
        Samples that were judged; at the others the encoder's counts beat with the sampling.
    file : (N,) array of int
        Number of the recording that a sample comes from.
    """

    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array
    effort: Array
    base_effort: Array
    extended_effort: Array
    shares: Mapping[str, Array]
    since_reversal: Array
    clear: NDArray[np.bool_]
    file: NDArray[np.intp]


@dataclass(frozen=True)
class AxisDiagnosis:
    """One axis.

    Attributes
    ----------
    causes : tuple of Cause
        Strongest first.
    vibrations : tuple of Term
        What shakes the axis from outside (`edge_ident.model.outside_vibration`), strongest first;
        no property of the axis, and so neither a cause nor part of the model.
    noise_floor : float
        Relative residual that noise alone would leave.
    noise_floor_source : str
        How it was found, in words.
    model : AxisModel
        The extended model; the base model where nothing was found.
    cutoff_hz : float
        Bandwidth of the comparison.
    knee_hz : float
        Frequency above which less and less is compared, because noise of the encoder prevails.

    Examples
    --------
    >>> import edge_ident
    >>> axis = edge_ident.diagnose([edge_ident.simulate()]).axes["x"]
    >>> axis.verdict.value, axis.causes
    ('adequate', ())
    """

    verdict: Verdict
    causes: tuple[Cause, ...]
    vibrations: tuple[Term, ...]
    not_testable: tuple[NotTestable, ...]
    base: Fit
    extended: Fit
    noise_floor: float
    noise_floor_source: str
    model: AxisModel
    cutoff_hz: float
    knee_hz: float
    traces: Traces


@dataclass(frozen=True)
class DataFinding:
    """Something about the data that matters before any physics does."""

    code: str
    axis: str
    message: str


@dataclass(frozen=True)
class Validation:
    """Relative residuals of one axis on a recording that the fit never saw."""

    base: float
    extended: float


@dataclass(frozen=True, repr=False)
class Diagnosis(Readable):
    """What the base model gets wrong about all axes.

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

"""The result of a diagnosis: verdict, causes with their alternatives, and the models compared.

Every residual, metric and share of a diagnosis is taken over the valid samples (`Traces.valid`) of
the recording that it belongs to, and relative to the measured effort at the same samples. So all
figures of one table have one denominator.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.error_budget import ABOVE_BAND, AgreeingCurve, ErrorBudget
from edge_ident.diagnosis.measures import (
    TOLERANCE,
    ModelFit,
    SpectralLine,
    Traces,
    Validation,
    Verdict,
)
from edge_ident.estimation.trust import Finding
from edge_ident.model.model import AxisModel, Model, Term
from edge_ident.model.motion import NO_SHIFT, Timing
from edge_ident.signals.metrics import rms
from edge_ident.support.rows import Drawable

Array = NDArray[np.float64]
Kind = Literal["supported", "suspected", "minor"]

_TINY: Final = float(np.finfo(float).tiny)


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
    term : Term or None
        It with the values that it has in the place of the cause; None where it was not fitted.
    """

    effect: str
    separable: bool
    evidence: str
    experiment: str
    term: Term | None = None


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
        95 % interval, over blocks of time.
    share : float
        Rms of the part of its contribution that the base model cannot express (orthogonal to its
        columns, timing included) over the rms of the effort.
    alternatives : tuple of Alternative
        The nearest first.
    evidence : str
        What sets the effect apart, and how much it explains, in one sentence.
    decision : str
        Why the acceptance rule accepts it (`edge_ident.diagnosis.select.acceptance`).
    shown_in : tuple of str
        Recordings in which it certainly reduces the residual.
    """

    term: Term
    held_out_gain: float
    held_out_gain_interval: tuple[float, float]
    share: float
    alternatives: tuple[Alternative, ...]
    evidence: str
    decision: str
    shown_in: tuple[str, ...] = ()

    @property
    def inseparable(self) -> tuple[Alternative, ...]:
        """Alternatives that the recordings do not tell it from."""
        return tuple(other for other in self.alternatives if not other.separable)


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
class OutsideVibration:
    """A sinusoid in time that shakes an axis during a recording (`model/rigid_body.py`).

    It is no property of the axis: neither a cause nor part of the model.

    Attributes
    ----------
    frequency_hz : float
    amplitude : float
        In the unit of the effort.
    recording : str
        Its source.
    """

    frequency_hz: float
    amplitude: float
    recording: str


@dataclass(frozen=True)
class AxisDiagnosis:
    """The diagnosis of one axis.

    Attributes
    ----------
    verdict : Verdict
        Adequate, explained, partly explained or unexplained.
    causes : tuple of Cause
        Strongest first.
    refused : tuple of Refused
        Effects that entered the model and left it again.
    external_vibrations : tuple of OutsideVibration
        Strongest first.
    converged : bool
        Whether backward elimination reached a model that it does not change. Otherwise the causes
        are those of its last round.
    not_testable : tuple of NotTestable
        Effects that no motion in the recordings excites.
    base, extended : ModelFit
        How the base model fits, and the extended one.
    noise_floor : float
        Relative residual that noise alone leaves.
    noise_floor_source : str
        How it was determined, in words.
    model : AxisModel
        The extended model; the base model where there is no cause.
    budget : ErrorBudget
        Where the effort lies that the base model misses.
    cutoff_hz : float
        Bandwidth of the comparison.
    knee_hz : float
        Frequency above which encoder noise dominates and the filter attenuates.
    suspected : tuple of Cause
        Causes that the acceptance rule does not support; outside the model. `decision` says why.
    curves : tuple of AgreeingCurve
        What no cause accounts for and yet comes back, as tables of the extended model, the largest
        first.
    minor : tuple of Cause
        Certain causes below the tolerance, and what the chain of a sound drive has as well.
    timing : Timing
    share_in_band : float
        Share of the variance of the recorded effort that lies in the band of the comparison.
    lines : tuple of SpectralLine
        Above the band, and explained by no cause.
    findings : tuple of Finding
        What speaks against any cause, or limits what the recording can show.

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
    external_vibrations: tuple[OutsideVibration, ...]
    converged: bool
    not_testable: tuple[NotTestable, ...]
    base: ModelFit
    extended: ModelFit
    noise_floor: float
    noise_floor_source: str
    model: AxisModel
    budget: ErrorBudget
    cutoff_hz: float
    knee_hz: float
    traces: Traces = field(repr=False)
    suspected: tuple[Cause, ...] = ()
    curves: tuple[AgreeingCurve, ...] = ()
    minor: tuple[Cause, ...] = ()
    timing: Timing = NO_SHIFT
    share_in_band: float = 1.0
    lines: tuple[SpectralLine, ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def by_kind(self) -> dict[Kind, tuple[Cause, ...]]:
        """Causes by how far the data support them."""
        return {"supported": self.causes, "suspected": self.suspected, "minor": self.minor}

    @property
    def minor_in_model(self) -> tuple[Cause, ...]:
        """Minor causes that the extended model has: what the chain of a sound drive has as well,
        and all of them if asked for."""
        has = {(term.effect, term.source_axis) for term in self.model.terms}
        return tuple(c for c in self.minor if (c.term.effect, c.term.source_axis) in has)

    @property
    def in_model(self) -> tuple[Cause, ...]:
        """Causes by which the extended model differs from the base model."""
        return (*self.causes, *self.minor_in_model)

    @property
    def explained_share(self) -> float:
        """Share of the mean square of what the base model misses that the extended model takes off;
        what lies above the band is missed, too."""
        if not self.traces.valid.any():
            return 0.0
        left = rms((self.traces.effort - self.traces.extended_effort)[self.traces.valid])
        in_band = 1.0 - self.budget.share(ABOVE_BAND)
        return max(in_band - (left / max(self.budget.missed, _TINY)) ** 2, 0.0)

    @property
    def extends_base(self) -> bool:
        """Whether the extended model is another one than the base model."""
        return bool(self.in_model or self.curves)

    @property
    def base_is_enough(self) -> bool:
        """Whether the base model is adequate by itself. Without the chain of a sound drive, which
        is no cause, it may leave more than is worth naming."""
        largest = max((cause.share for cause in self.in_model), default=0.0)
        return self.verdict is Verdict.ADEQUATE and largest < TOLERANCE


@dataclass(frozen=True)
class DataFinding:
    """A defect of the data, to be read before any cause."""

    code: str
    axis: str
    message: str


@dataclass(frozen=True, repr=False)
class Diagnosis(Drawable):
    """The diagnosis of all axes.

    `table` has a row for each parameter of each cause. `plot` draws measured and modelled effort of
    every axis, and the residuals of both models.

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
    axis x the base model is adequate
      the residual is ...
    """

    axes: Mapping[str, AxisDiagnosis]
    data_quality: tuple[DataFinding, ...]
    validation: Mapping[str, Validation]

    @property
    def understood(self) -> bool:
        """Whether no axis has structure left that no known effect explains."""
        return all(axis.verdict.complete for axis in self.axes.values())

    @property
    def budget(self) -> Mapping[str, ErrorBudget]:
        """Of each axis, where the effort lies that its base model misses."""
        return {name: axis.budget for name, axis in self.axes.items()}

    @property
    def conclusive(self) -> bool:
        """Whether nothing about the data forbids to name causes; a rest without a name does not."""
        return not any(finding.blocks for axis in self.axes.values() for finding in axis.findings)

    @property
    def model(self) -> Model:
        """The extended models of all axes as one model."""
        return Model({name: axis.model for name, axis in self.axes.items()})

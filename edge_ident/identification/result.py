"""What an identification says: parameters, whether to trust them, and a model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation.trust import OF_PARAMETERS, UNDETERMINED, Finding
from edge_ident.identification.adequacy import Adequacy
from edge_ident.model.model import NORMAL_95, PARAMETERS, AxisModel, Estimate, Model, effect_names
from edge_ident.model.motion import Timing
from edge_ident.signals.metrics import Metric
from edge_ident.support.rows import Drawable
from edge_ident.support.words import listed, spoken

if TYPE_CHECKING:
    from edge_ident.diagnosis.error_budget import ErrorBudget
    from edge_ident.diagnosis.result import AxisDiagnosis
    from edge_ident.identification.friction_curve import FrictionCurve


class ParameterSource(StrEnum):
    """Which estimate an answer is."""

    LEAST_SQUARES = "least_squares"
    WHITENED = "whitened_least_squares"
    NETWORK = "cnn"
    EXTENDED_MODEL = "extended_model"

    @property
    def spoken(self) -> str:
        """What people call it."""
        return "network" if self is ParameterSource.NETWORK else self.value.replace("_", " ")


@dataclass(frozen=True)
class EffortTrace:
    """What a plot shows of one axis: the samples that were estimated from.

    Attributes
    ----------
    time_s : (N,) array
        From the start of the recording.
    measured, modelled : (N,) arrays
        Filtered alike.
    """

    time_s: NDArray[np.float64]
    measured: NDArray[np.float64]
    modelled: NDArray[np.float64]


@dataclass(frozen=True)
class AxisIdentification:
    """What was found out about one axis.

    Attributes
    ----------
    estimate : Estimate
        What is reported and used; its deviations include the model error.
    line : Estimate or None
        The same with friction as the line through the friction curve, over the speeds that were
        visited; None where the model's friction is a line.
    source : ParameterSource
        Which of the estimates that is; `reason` says why.
    reason : str
    model_error : (4,) array
        Part of the deviations that is by error of the model.
    network : Estimate or None
        None where no network applies; `network_reason` says why, or how it ended.
    network_reason : str
    least_squares : Estimate
        Of the base model.
    whitened : Estimate
        The same with the filter and the masks of the diagnosis: noise is white.
    adequacy : Adequacy
        Of the base model.
    timing : Timing
    diagnosis : AxisDiagnosis or None
        Where the base model is not adequate.
    model : AxisModel
        `estimate` as the base term, and the effects that the effort is compensated for.
    metric : Metric
        Of `model`, on the filtered effort.
    units : tuple of str
    cutoff_hz : float
        Of the zero-phase filter.
    condition_number : float
        Of the regressor with columns of unit length.
    findings : tuple of Finding
    end_s : float
        End of what the model was made from, since the start of the first recording.
    trace : EffortTrace

    Examples
    --------
    >>> import edge_ident
    >>> axis = edge_ident.identify(edge_ident.simulate()).axes["x"]
    >>> axis.trusted
    True
    >>> axis.metric.relative_residual < 0.01
    True
    """

    estimate: Estimate
    line: Estimate | None
    source: ParameterSource
    reason: str
    model_error: NDArray[np.float64]
    network: Estimate | None
    network_reason: str
    least_squares: Estimate
    whitened: Estimate
    adequacy: Adequacy
    timing: Timing
    diagnosis: "AxisDiagnosis | None"
    model: AxisModel
    metric: Metric
    units: tuple[str, str, str, str]
    cutoff_hz: float
    condition_number: float
    findings: tuple[Finding, ...]
    end_s: float
    trace: EffortTrace = field(repr=False)

    @property
    def budget(self) -> "ErrorBudget | None":
        """Where the effort lies that the base model misses; None where that was not asked."""
        return None if self.diagnosis is None else self.diagnosis.budget

    @property
    def compensated_effects(self) -> tuple[str, ...]:
        """Names of the effects that the effort is compensated for."""
        return effect_names(self.model)

    @property
    def diagnosis_sentence(self) -> str:
        """What the diagnosis found, and which parameters follow from it, in one line."""
        if self.diagnosis is None:
            return self.adequacy.reason
        causes = (*self.diagnosis.causes, *self.diagnosis.minor)
        found = listed(dict.fromkeys(spoken(cause.term.effect) for cause in causes))
        return f"{self.diagnosis.verdict.value}: {found or 'no cause'}; {self.source.spoken} used"

    @property
    def effective(self) -> Estimate:
        """Inertia, and friction as a line: what holds over the speeds that were visited, however
        friction divides among the terms of the model."""
        return self.estimate if self.line is None else self.line

    @property
    def friction_curve(self) -> "FrictionCurve | None":
        """Friction over speed by direction, whatever laws it is made of; None where the model does
        not say at which speeds it was seen."""
        from edge_ident.identification.friction_curve import friction_curve

        extended = self.source is ParameterSource.EXTENDED_MODEL
        curves = self.diagnosis.curves if self.diagnosis and extended else ()
        return friction_curve(self.model, self.effective, curves)

    @property
    def trusted(self) -> bool:
        """Whether the data agree with themselves and every parameter is known; what the model does
        not explain is in the intervals."""
        return not self._blocking

    @property
    def consistent(self) -> bool:
        """Whether the data agree with themselves; if not, nothing follows from them."""
        return not any(finding.contradicts for finding in self.findings)

    @property
    def known(self) -> tuple[bool, ...]:
        """Whether each parameter is known: its interval is worth acting on. It says more than that
        there is one: its value is certainly not zero, or the offset smaller than the friction."""
        undetermined = (f for f in self.findings if f.code.startswith(UNDETERMINED))
        return self._known(self.estimate, [f.code for f in (*self._blocking, *undetermined)])

    @property
    def effective_known(self) -> tuple[bool, ...]:
        """The same of `effective`."""
        return self._known(self.effective, [f.code for f in self._blocking])

    @property
    def _blocking(self) -> tuple[Finding, ...]:
        return tuple(finding for finding in self.findings if finding.blocks)

    def _known(self, estimate: Estimate, codes: Sequence[str]) -> tuple[bool, ...]:
        doubted = [code for code in codes if code.startswith(OF_PARAMETERS)]
        # what is no doubt about single parameters is one about all
        sure = doubted == list(codes) and "inseparable" not in doubted
        return tuple(
            sure and narrow and not any(code.endswith(name) for code in doubted)
            for narrow, name in zip(worth_acting_on(estimate), PARAMETERS, strict=True)
        )


def worth_acting_on(estimate: Estimate) -> tuple[bool, ...]:
    """Whether each interval says more than that a parameter is there: it does not reach zero; that
    of the offset is smaller than the friction."""
    sizes = np.abs(estimate.parameters)
    sizes[-1] = sizes[-2]
    return tuple((NORMAL_95 * estimate.std < sizes).tolist())


def known_sentence(known: Sequence[str], unknown: Sequence[str]) -> str:
    """Which parameters are known, and which are not."""
    if not unknown:
        return "every parameter is known"
    said = f"known: {listed(map(spoken, known))}; " if known else ""
    return f"{said}not known: {listed(map(spoken, unknown))}"


@dataclass(frozen=True, repr=False)
class Identification(Drawable):
    """What was found out about all axes of a recording.

    `table` has a row for each parameter of each axis, effects included. `plot` draws measured and
    modelled effort of every axis, and the residual.

    Attributes
    ----------
    axes : mapping of axis name to AxisIdentification
    timing_ms : mapping of stage to milliseconds

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.identify(edge_ident.simulate())
    >>> list(found.axes)
    ['x', 'z']
    >>> print(found)  # doctest: +ELLIPSIS
    axis x
    ...
    """

    axes: Mapping[str, AxisIdentification]
    timing_ms: Mapping[str, float]

    @property
    def trusted(self) -> bool:
        """Whether every axis is."""
        return all(axis.trusted for axis in self.axes.values())

    @property
    def shows_something(self) -> bool:
        """Whether at least one parameter of every axis is known."""
        return all(any(axis.effective_known) for axis in self.axes.values())

    @property
    def consistent(self) -> bool:
        """Whether the data of every axis agree with themselves."""
        return all(axis.consistent for axis in self.axes.values())

    @property
    def model(self) -> Model:
        """The identified axes as a model, with the effects that were compensated."""
        return Model({name: axis.model for name, axis in self.axes.items()})

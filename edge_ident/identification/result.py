"""What an identification says: parameters, whether to trust them, and a model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation.trust import OF_PARAMETERS, UNDETERMINED, Finding
from edge_ident.identification.adequacy import Adequacy
from edge_ident.model.model import (
    NORMAL_90,
    NORMAL_95,
    PARAMETERS,
    AxisModel,
    Estimate,
    Model,
    SupportedRange,
    effect_names,
)
from edge_ident.model.motion import Array, Timing
from edge_ident.signals.metrics import Metric
from edge_ident.support.rows import Drawable
from edge_ident.support.words import listed, spoken

if TYPE_CHECKING:
    from edge_ident.diagnosis.error_budget import AgreeingCurve, ErrorBudget
    from edge_ident.diagnosis.result import AxisDiagnosis


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
    moved_up_to_hz : float
        Below it lie 99 % of the energy of the velocity: the model was seen up to there.
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
    moved_up_to_hz: float
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
        single = [c for c in codes if c.startswith(OF_PARAMETERS) and c.endswith(PARAMETERS)]
        sure = single == list(codes)  # what is no doubt about single parameters is one about all
        return tuple(
            sure and narrow and not any(code.endswith(name) for code in single)
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


# The friction of an axis over its speed, by direction, whatever laws it is made of.

_POINTS: Final = 21
_PLACES: Final = 16


@dataclass(frozen=True)
class FrictionCurve:
    """Effort at constant speeds, offset included, with 90 % bands.

    Attributes
    ----------
    speed : (P,) array
        From zero to the highest speed that was visited, in both directions if it went both ways;
        finer at low ones.
    forward, backward : (P,) arrays
        Effort in the positive and in the negative direction.
    deviation : (P,) array
        Half the width of the band of either.
    speed_unit, unit : str

    Examples
    --------
    >>> import edge_ident
    >>> curve = edge_ident.identify(edge_ident.simulate()).axes["x"].friction_curve
    >>> bool(curve.forward[-1] > curve.forward[0] > 0.0 > curve.backward[0])
    True
    """

    speed: Array
    forward: Array
    backward: Array
    deviation: Array
    speed_unit: str
    unit: str

    def table(self) -> dict[str, list[Any]]:
        """One row for each speed.

        Returns
        -------
        mapping of column name to list
            What a data frame takes.
        """
        return {
            "speed": self.speed.tolist(),
            "forward": self.forward.tolist(),
            "backward": self.backward.tolist(),
            "deviation": self.deviation.tolist(),
        }


def friction_curve(
    model: AxisModel, line: Estimate, curves: "Sequence[AgreeingCurve]" = ()
) -> FrictionCurve | None:
    """The friction curve of a model; None where it does not say at which speeds it was seen.

    Parameters
    ----------
    model : AxisModel
    line : Estimate
        With friction as the line through the curve; the band has its deviations.
    curves : sequence of AgreeingCurve
        Of the model; the band has theirs as well.
    """
    seen = model.terms[0].supported
    if seen is None:
        return None
    low, high = seen.speed
    both_ways = low < 0.0 < high
    top = min(-low, high) if both_ways else max(-low, high)
    speed = top * np.linspace(0.0, 1.0, _POINTS) ** 2
    _, viscous, coulomb, offset = line.std
    # deviations are taken to be independent: where they are not, the band is too wide
    variance = (speed * viscous) ** 2 + coulomb**2 + offset**2
    for curve in (one.curve for one in curves if one.curve.over == "speed"):
        half = np.interp(speed, curve.coordinate, 0.5 * (curve.high - curve.low))
        variance = variance + (half / NORMAL_90) ** 2
    forward, backward = (_at_constant(model, way * speed, way, seen) for way in (1.0, -1.0))
    position_unit, unit = model.units
    deviation = NORMAL_90 * np.sqrt(variance)
    return FrictionCurve(speed, forward, backward, deviation, f"{position_unit}/s", unit)


def _at_constant(model: AxisModel, velocity: Array, way: float, seen: SupportedRange) -> Array:
    """Effort (P,) at constant velocities in one direction, the mean over the stroke."""
    _, viscous, coulomb, offset = model.parameters
    base: Array = viscous * velocity + coulomb * way + offset
    return base if len(model.terms) == 1 else base + _of_terms(model, velocity, way, seen)


def _of_terms(model: AxisModel, velocity: Array, way: float, seen: SupportedRange) -> Array:
    """The same of terms that are friction and depend on place and speed alone."""
    from edge_ident.model.effects import named  # sound axes have no terms, and start faster
    from edge_ident.model.inverse import steady_effort

    place, pace = np.meshgrid(np.linspace(*seen.position, _PLACES), velocity)
    found = np.zeros(place.shape)
    for term in model.terms[1:]:
        effect = named(term.effect)
        elsewhere = effect.tied_to_time or effect.memory_size or effect.has_source(term.source_axis)
        if effect.search.shares_friction and not elsewhere:
            found = found + steady_effort(term, place, pace, way)
    mean: Array = found.mean(axis=1)
    return mean

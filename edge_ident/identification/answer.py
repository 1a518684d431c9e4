"""Which estimate is the answer, how far it may be off, and whether it may be acted on.

- The base model is adequate: least squares, on the signals of the identification or on those of the
  comparison, whichever expects the smaller error. The network confirms it.
- It is not, and the diagnosis supports causes: the base parameters of the extended model. A
  parameter that trades places with a cause has a wide interval. Where what they add is minor, the
  difference to the base model is model error. Where it is minor, or something is unexplained, the
  base model stays the answer if it fits better.
- It is not, and nobody diagnosed it: the network where one applies. Under an effect that the base
  model lacks it is closer than least squares, which balances the effect over all samples. Its
  interval reaches as far as least squares.

Every deviation includes the model error (`edge_ident.estimation.effort_checks`) and that of the
shift between effort and position.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from edge_ident.diagnosis.measures import Verdict
from edge_ident.errors import DataError
from edge_ident.estimation import trust
from edge_ident.estimation.compensated import CompensatedAxis
from edge_ident.estimation.compensation import compensate_effects
from edge_ident.estimation.effort_checks import UNRELATED, check_effort, regime_spread, regimes
from edge_ident.estimation.least_squares import Columns, EstimationPart
from edge_ident.identification.adequacy import Adequacy, ComparedSignals
from edge_ident.identification.result import AxisIdentification, EffortTrace, ParameterSource
from edge_ident.model import model
from edge_ident.model.motion import Array, Timing
from edge_ident.signals import metrics, scale_checks, tracking
from edge_ident.signals.conditioning import Signals, highest_hz
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.support.next_step import PAGE
from edge_ident.support.words import listed, spoken

if TYPE_CHECKING:
    from edge_ident.diagnosis.result import AxisDiagnosis


@dataclass(frozen=True)
class AxisEstimates:
    """All that is estimated of an axis before it is diagnosed.

    Attributes
    ----------
    recording : Recording
    name : str
        Of the axis.
    compensated : CompensatedAxis
        With its effort in step.
    part : EstimationPart
        What least squares estimates from.
    linear : Estimate
        Least squares; its deviations are those by noise.
    compared : ComparedSignals
    network : Estimate or None
    network_reason : str
    adequacy : Adequacy
    timing : Timing
    """

    recording: Recording
    name: str
    compensated: CompensatedAxis
    part: EstimationPart
    linear: model.Estimate
    compared: ComparedSignals
    network: model.Estimate | None
    network_reason: str
    adequacy: Adequacy
    timing: Timing


@dataclass(frozen=True)
class _Base:
    """An estimate of the base model; its deviations include those by model error and timing."""

    source: ParameterSource
    estimate: model.Estimate
    model_error: Array

    def expected_error(self, signals: Signals) -> float:
        """Error of the effort that the deviations let expect, for signals of this motion."""
        return float(np.linalg.norm(signals.regressor * self.estimate.std))


@dataclass(frozen=True)
class _Choice:
    """The estimate that is the answer.

    Attributes
    ----------
    compensated : CompensatedAxis
        For the effects of the model that the estimate belongs to.
    reason : str
        Why it is the answer.
    line : Estimate or None
        The same with friction as the line through the friction curve, where that bends.
    """

    source: ParameterSource
    estimate: model.Estimate
    model_error: Array
    compensated: CompensatedAxis
    reason: str
    line: model.Estimate | None = None

    def doubts(self, columns: Columns, measured: Array, left: float) -> list[trust.Finding]:
        """What speaks against the parameters, where the model leaves that share of the effort."""
        return trust.check_estimate(self.estimate, columns, measured, left, self.line)


def answer(
    estimates: AxisEstimates, outcome: "AxisDiagnosis | DataError | None"
) -> AxisIdentification:
    """Choose the answer for one axis, and check it.

    Parameters
    ----------
    estimates : AxisEstimates
    outcome : AxisDiagnosis, DataError or None
        Why there is no diagnosis, where the recording is too short for one. None where the base
        model is adequate, or no diagnosis is wanted.
    """
    diagnosed, samples = None if isinstance(outcome, DataError) else outcome, estimates.part.samples
    bases = _bases(estimates)
    linear, whitened = (base.estimate for base in bases)
    network = None if estimates.network is None else _widened(estimates.network, linear.std)
    chosen = _chosen(estimates, diagnosed, bases, network)
    columns, signals = estimates.part.columns, chosen.compensated.signals
    effects, times_s = chosen.compensated.effects_effort[samples], signals.times_s(samples)
    effort = signals.effort + chosen.compensated.effects_effort
    measured, modelled = effort[samples], columns.values @ chosen.estimate.parameters + effects
    axis, metric = estimates.recording.axes[estimates.name], metrics.compare(measured, modelled)
    seen = trust.range_of(signals, axis, samples, effort)
    doubts = chosen.doubts(columns, measured, metric.relative_residual)
    findings = _findings(estimates, outcome, seen, chosen, doubts)
    if network and estimates.adequacy.adequate:
        findings += trust.compare_estimators(network, linear)
    return AxisIdentification(
        estimate=chosen.estimate,
        line=chosen.line,
        source=chosen.source,
        reason=chosen.reason,
        model_error=chosen.model_error,
        network=network,
        network_reason=estimates.network_reason,
        least_squares=linear,
        whitened=whitened,
        adequacy=estimates.adequacy,
        timing=estimates.timing if diagnosed is None else diagnosed.timing,
        diagnosis=diagnosed,
        model=_model(chosen, axis, seen),
        metric=metric,
        units=axis.parameter_units,
        cutoff_hz=signals.cutoff_hz,
        moved_up_to_hz=highest_hz(signals.regressor[:, 1], signals.period_s),
        condition_number=columns.condition_number,
        findings=said_once(findings),
        end_s=_end_s(estimates.recording, float(times_s[-1]), diagnosed),
        trace=EffortTrace(times_s, measured, modelled),
    )


def _model(chosen: _Choice, axis: AxisRecord, seen: model.SupportedRange) -> model.AxisModel:
    base = model.base_axis(chosen.estimate, *axis.units, seen)
    return replace(base, terms=(*base.terms, *chosen.compensated.effects))


def _end_s(recording: Recording, last_s: float, diagnosed: "AxisDiagnosis | None") -> float:
    """End of the last recording that the answer comes from, since the start of the first."""
    diagnosed_s = float(diagnosed.traces.time_s[-1]) if diagnosed is not None else 0.0
    # a diagnosis may have pooled later recordings than this one
    return max(recording.begin_s + last_s, diagnosed_s)


def _bases(estimates: AxisEstimates) -> tuple[_Base, _Base]:
    """Least squares on the signals of the identification, and on those of the comparison."""
    compared = estimates.compared
    linear, whitened = estimates.linear, compared.fit()
    error = _model_error(estimates.compensated, estimates.part, linear.std)
    beside = compared.model_error(whitened.std)
    sampling_s = estimates.compensated.signals.recorded_period_s
    late = compared.timing_error(estimates.timing.std_samples * sampling_s)
    return (
        _Base(ParameterSource.LEAST_SQUARES, _widened(linear, np.hypot(error, late)), error),
        _Base(ParameterSource.WHITENED, _widened(whitened, np.hypot(beside, late)), beside),
    )


def _findings(
    estimates: AxisEstimates,
    outcome: "AxisDiagnosis | DataError | None",
    seen: model.SupportedRange,
    chosen: _Choice,
    doubts: list[trust.Finding],
) -> list[trust.Finding]:
    """Findings about the data, the known effects, the model and the parameters of the answer."""
    known, recording, name = estimates.compensated, estimates.recording, estimates.name
    findings = trust.describe_data(known.signals, recording.stamp_jitter, recording.lost_rows)
    findings += trust.departures(known.effects, seen, recording.axes[name])
    findings += trust.tied_to_time(known.tied_to_time)
    extended = chosen.source is ParameterSource.EXTENDED_MODEL
    findings += of_effort(known.signals, estimates.part, extended=extended)
    findings += describe_model(estimates.adequacy, outcome, extended=extended)
    findings += trust.with_timing(doubts, estimates.timing)
    findings += trust.check_tracking([recording], name)
    return findings + describe_scales(recording, name, chosen.estimate.parameters[0])


def _chosen(
    estimates: AxisEstimates,
    diagnosed: "AxisDiagnosis | None",
    bases: tuple[_Base, _Base],
    network: model.Estimate | None,
) -> _Choice:
    linear, known = bases[0], estimates.compensated
    if diagnosed is not None and len(diagnosed.model.terms) > 1 + len(known.effects):
        extended = _extended(estimates, diagnosed, bases)
        if diagnosed.verdict is Verdict.EXPLAINED or _fits(extended, estimates, linear):
            return extended
    found_adequate = diagnosed is not None and diagnosed.verdict is Verdict.ADEQUATE
    adequate = estimates.adequacy.adequate or found_adequate
    if network is None or adequate:
        # a model that is not enough is a compromise: over all samples, those of reversals too
        best = _best(bases, known.signals) if adequate else linear
        reason = _reason(network, best)
        line = _line_with_known(best.estimate, known)
        return _Choice(best.source, best.estimate, best.model_error, known, reason, line)
    # neither estimator knows the effect: how far they are apart is what it may do to both
    apart = network.parameters - linear.estimate.parameters
    estimate = _widened(network, apart)
    return _Choice(
        ParameterSource.NETWORK,
        estimate,
        np.hypot(linear.model_error, apart),
        known,
        "effects outside the base model change the network's result less than least squares",
        _line_with_known(estimate, known),
    )


def _line_with_known(estimate: model.Estimate, known: CompensatedAxis) -> model.Estimate | None:
    """An estimate beside known effects, with the line through all friction in place of its own;
    None where no known effect is friction. What the effects' values are off by, the estimate takes
    up, and the line does not move."""
    if known.friction_line is None:
        return None
    return model.Estimate(estimate.parameters + np.array([0.0, *known.friction_line]), estimate.std)


def _fits(extended: _Choice, estimates: AxisEstimates, base: _Base) -> bool:
    """Whether the extended model leaves no more than the base model, also near reversals."""
    samples, regressor = estimates.part.samples, estimates.part.columns.values
    left = extended.compensated.signals.effort[samples] - regressor @ extended.estimate.parameters
    of_base = estimates.compensated.signals.effort[samples] - regressor @ base.estimate.parameters
    return bool(np.linalg.norm(left) <= np.linalg.norm(of_base))


def _best(bases: tuple[_Base, _Base], signals: Signals) -> _Base:
    return min(bases, key=lambda base: base.expected_error(signals))


def _extended(
    estimates: AxisEstimates, diagnosed: "AxisDiagnosis", bases: tuple[_Base, _Base]
) -> _Choice:
    """The base parameters of the extended model."""
    name, known = estimates.name, estimates.compensated.signals
    compensated = compensate_effects(
        estimates.recording, name, model.Model({name: diagnosed.model}),
        late_s=diagnosed.timing.shift_s, of_motion=known,
    )  # fmt: skip
    estimate = diagnosed.model.estimate  # physical, as in a file, and no surer than that
    # how far parts of the motion disagree with effects taken off: what the diagnosis left
    error = _model_error(compensated, estimates.part, estimate.std)
    causes = listed(dict.fromkeys(map(spoken, model.effect_names(diagnosed.model))))
    reason = f"the base model is inadequate; the extended model has {causes}"
    if diagnosed.base_is_enough:
        base = _best(bases, known).estimate
        error = np.hypot(error, estimate.parameters - base.parameters)
        reason = f"what it adds to the base model is minor, and certain: {causes}"
    return _Choice(
        ParameterSource.EXTENDED_MODEL,
        _widened(estimate, error),
        error,
        compensated,
        reason,
        _line(estimates, diagnosed, compensated, bases),
    )


def _line(
    estimates: AxisEstimates,
    diagnosed: "AxisDiagnosis",
    compensated: CompensatedAxis,
    bases: tuple[_Base, _Base],
) -> model.Estimate | None:
    """The extended model with friction as a line. What parts of the motion move in friction, they
    move in its line as well: the two differ by a constant."""
    line = diagnosed.extended.effective
    if line is None:
        return None
    error = _model_error(compensated, estimates.part, line.std)
    if diagnosed.base_is_enough:
        base = _best(bases, estimates.compensated.signals).estimate
        error = np.hypot(error, line.parameters - base.parameters)
    return _widened(line, error)


def _widened(estimate: model.Estimate, by: Array) -> model.Estimate:
    # slow noise moves both answers alike, and the network's own figures know white noise alone;
    # errors of different origin are independent: they add in squares
    return model.Estimate(estimate.parameters, np.hypot(estimate.std, by))


def _model_error(axis: CompensatedAxis, part: EstimationPart, std: Array) -> Array:
    """Deviation (4,) by model error of least-squares parameters whose noise has deviations std."""
    regressor, samples = part.columns.values, part.samples
    divided = regimes(regressor, axis.position[samples], samples)
    return regime_spread(regressor, axis.signals.effort[samples], divided, std).model_error


def _reason(network: model.Estimate | None, base: _Base) -> str:
    """Why the parameters are those of the base model."""
    smaller = "its expected error is smaller than that of least squares on all samples; "
    why = smaller if base.source is ParameterSource.WHITENED else ""
    if network is None:
        return why + "no network result is available for this axis"
    apart = np.max(np.abs(network.parameters - base.estimate.parameters) / network.std)
    return (
        f"{why}its intervals hold under coloured noise; "
        f"the network agrees within {apart:.1f} standard deviations"
    )


# What the check of the base model and the diagnosis say about an answer.


def describe_model(
    adequacy: Adequacy, outcome: "AxisDiagnosis | DataError | None", *, extended: bool
) -> list[trust.Finding]:
    """Findings about the model that an answer belongs to.

    Parameters
    ----------
    adequacy : Adequacy
        Of the base model.
    outcome : AxisDiagnosis, DataError or None
        Of the diagnosis where the base model is not adequate, here or in another recording, or why
        there was none.
    extended : bool
        Whether the answer is that of the extended model.
    """
    if adequacy.adequate and outcome is None:
        return []
    if isinstance(outcome, DataError):
        return [
            trust.Finding(
                "not_diagnosed",
                f"{adequacy.reason}; this could not be diagnosed: {outcome.cause}",
                f"{outcome.next_step}; the intervals include what parts of the motion change",
            )
        ]
    if outcome is None:
        return [trust.Finding("base_inadequate", adequacy.reason, f"have it diagnosed: {PAGE}")]
    said = extended or not outcome.verdict.complete
    # what the base model alone hardly determines is no doubt about another model's parameters
    of_answer = [f for f in outcome.findings if not (extended and f.code == "undetermined")]
    chosen = _of_several_axes(outcome) if extended else []
    return [*(_verdict(outcome) if said else []), *chosen, *of_answer]


def _of_several_axes(diagnosed: "AxisDiagnosis") -> list[trust.Finding]:
    """Whether several axes act on this one by the same effect. Deviations are those of the model
    that was chosen, and many sums and senses of joints were tried."""
    terms = [cause.term for cause in (*diagnosed.causes, *diagnosed.minor)]
    effects = [term.effect for term in terms if term.source_axis is not None]
    several = [name for name in dict.fromkeys(effects) if effects.count(name) > 1]
    if not several:
        return []
    return [
        trust.Finding(
            "several_axes",
            f"several axes act on this one by {listed(map(spoken, several))}: which of them do was "
            "chosen among many, and the deviations do not know of that",
            "let another motion confirm it: edge-ident diagnose FILE --validate OTHER --output "
            "DIR, then edge-ident identify FILE --model DIR/model.json",
        )
    ]


def of_effort(signals: Signals, part: EstimationPart, *, extended: bool) -> list[trust.Finding]:
    """Findings against the effort; what the base model explains of it is no doubt about another."""
    return [f for f in check_effort(signals, part) if not (extended and f.code == UNRELATED)]


def describe_scales(recording: Recording, name: str, inertia: float) -> list[trust.Finding]:
    """Questions about units, from the recording and from the inertia that follows."""
    unit = recording.axes[name].parameter_units[0]
    asked = scale_checks.check_scale(recording, name)
    return [
        trust.Finding(question.code, question.message, question.next_step)
        for question in asked + scale_checks.check_inertia(name, inertia, unit)
    ]


def _verdict(diagnosed: "AxisDiagnosis") -> list[trust.Finding]:
    from edge_ident.diagnosis.wording import findings_sentence

    if not diagnosed.verdict.complete:
        return [
            trust.Finding(
                diagnosed.verdict.value,
                findings_sentence(diagnosed),
                f"see on its page what is left, and where: {PAGE}",
            )
        ]
    found = listed(
        dict.fromkeys(spoken(c.term.effect) for c in diagnosed.causes or diagnosed.minor)
    )
    if not found:
        return []
    return [
        trust.Finding(
            "extended_model",
            f"the base model lacks {found}; with it the model leaves "
            f"{diagnosed.extended.fitted:.2%} of the effort",
            f"read its page before you adjust the machine: {PAGE}",
        )
    ]


def said_once(findings: list[trust.Finding]) -> tuple[trust.Finding, ...]:
    """Findings, each said once: identification and diagnosis make some of the same checks.

    Both may find a negative parameter or a late effort, on other samples and so with other numbers.
    The one that blocks has the numbers of the answer, and is kept.
    """
    kept: dict[tuple[str, str], trust.Finding] = {}
    if any(finding.code == "effort_sign" for finding in findings):
        # what is negative then follows from the sign, and is no law of its own
        findings = [finding for finding in findings if not finding.code.startswith("negative_")]
    for finding in findings:
        numbers_differ = finding.code.startswith(("negative_", "effort_", tracking.OFF))
        same = (finding.code, "" if numbers_differ else finding.message)
        if same not in kept or finding.blocks:
            kept[same] = finding
    return tuple(kept.values())

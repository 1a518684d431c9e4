"""The sentences of a diagnosis, for the terminal and the page alike."""

import math
from collections.abc import Iterable, Mapping
from typing import Any, Final

from edge_ident.diagnosis.measures import ModelFit, SpectralLine, Validation, Verdict
from edge_ident.diagnosis.result import Alternative, AxisDiagnosis, Cause, Diagnosis, Refused
from edge_ident.diagnosis.select.thresholds import STRUCTURE
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Term, base_axis
from edge_ident.model.model_files import values_document
from edge_ident.model.motion import LARGEST_SHIFT, NO_SHIFT, Timing
from edge_ident.support.words import listed, spoken, with_deviation

_WHOLE: Final = 0.98
"""Share of the effort's variance from which on the band holds the effort."""


def percent(share: float) -> str:
    """A share in percent."""
    return f"{100 * share:.1f} %" if abs(share) >= 0.1 else f"{100 * share:.2f} %"


def verdict_sentence(axis: AxisDiagnosis) -> str:
    """The verdict, and by what."""
    said = _found(axis)
    if axis.verdict is Verdict.PARTLY_EXPLAINED:
        return f"partly explained, {said}"
    return f"{axis.verdict}: {said}" if axis.verdict is Verdict.UNEXPLAINED else said


def facts(axis: AxisDiagnosis) -> list[str]:
    """What else is known of an axis: the residual, what has no name, and what was not looked at."""
    said = [_residual(axis)]
    if not axis.verdict.complete and axis.lines and _leaves_noise(axis):
        said.append("what is left in the band is noise")
    elif not axis.verdict.complete and _understood(axis):
        said.append("what is left here is noise, but not what is left of the other recording")
    said += [
        f"no law of the catalogue describes {c}; the model has it as a curve" for c in axis.curves
    ]
    if axis.external_vibrations:
        said.append(f"an external vibration acts on it: {listed(spoken_vibrations(axis))}")
    if axis.lines:
        lines = listed(spoken_line(line, axis.model.effort_unit) for line in axis.lines[:3])
        said.append(f"above the band, no effect explains {lines}")
    if axis.share_in_band < _WHOLE:
        said.append(
            f"above {axis.cutoff_hz:.3g} Hz, where {percent(1.0 - axis.share_in_band)} of the "
            "effort's variance lies, nothing but sinusoids was looked for"
        )
    if not axis.converged:
        said.append("the selection of causes did not converge, so none is named")
    return said


def doubts(axis: AxisDiagnosis) -> list[str]:
    """What the recordings do not tell from the causes of an axis, and what is suspected."""
    said = []
    for cause in axis.causes:
        if others := [spoken(other.effect) for other in cause.inseparable]:
            this = spoken(cause.term.effect)
            said.append(f"the recordings do not tell {this} from {listed(others)}")
    if suspected := [spoken(cause.term.effect) for cause in axis.suspected]:
        said.append(f"suspected only: {listed(dict.fromkeys(suspected))}")
    return list(dict.fromkeys(said))  # two orders of ripple may have the same rivals


def findings_sentence(axis: AxisDiagnosis) -> str:
    """What was found of an axis, where its verdict is said already."""
    return "; ".join([_found(axis), *facts(axis)])


def only_elsewhere(name: str, diagnosis: Diagnosis) -> bool:
    """Whether a model leaves more than noise on the other recording alone."""
    axis = diagnosis.axes[name]
    leaves_more = not (axis.verdict.complete or axis.curves)
    return leaves_more and name in diagnosis.validation and _understood(axis)


def _understood(axis: AxisDiagnosis) -> bool:
    """Whether nothing is left in the recordings that the model was fitted to but noise."""
    blocked = any(finding.blocks for finding in axis.findings)
    return _leaves_noise(axis) and not (blocked or axis.lines or axis.external_vibrations)


def _leaves_noise(axis: AxisDiagnosis) -> bool:
    """Whether the model leaves nothing but noise of what it was fitted to, in the band."""
    return axis.extended.fitted <= STRUCTURE * axis.noise_floor


def spoken_line(line: SpectralLine, effort_unit: str) -> str:
    """Amplitude, and order or frequency, of a line."""
    return f"{line.amplitude:.3g} {effort_unit} at {spoken_place(line)}"


def spoken_place(line: SpectralLine) -> str:
    """Order or frequency of a line."""
    if line.order is not None:
        return f"order {line.order:.4g}"
    if line.frequency_range_hz is not None:
        lowest, highest = line.frequency_range_hz
        return f"frequencies between {lowest:.3g} and {highest:.3g} Hz"
    return f"{line.frequency_hz:.4g} Hz"


def spoken_vibrations(axis: AxisDiagnosis) -> list[str]:
    """Amplitude and frequency of each external vibration; of several recordings, which it is in."""
    several = axis.traces.several
    return [
        f"{one.amplitude:.3g} {axis.model.effort_unit} at {one.frequency_hz:.4g} Hz"
        f"{f' in {one.recording}' if several else ''}"
        for one in axis.external_vibrations
    ]


def recordings_of(cause: Cause, axis: AxisDiagnosis) -> str:
    """Of several recordings, those that show a cause; nothing where there is one alone."""
    return listed(cause.shown_in) if axis.traces.several else ""


def _found(axis: AxisDiagnosis) -> str:
    """By what an axis is explained, or that nothing explains it."""
    causes = dict.fromkeys(spoken(cause.term.effect) for cause in axis.causes)
    curves = {0: "", 1: "a curve without a name"}.get(len(axis.curves), "curves without a name")
    found = listed(filter(None, [*causes, curves]))
    minor = listed(dict.fromkeys(spoken(cause.term.effect) for cause in axis.minor_in_model))
    if axis.verdict is Verdict.ADEQUATE:
        return f"adequate but for {minor}" if minor else "the base model is adequate"
    if axis.verdict is Verdict.EXPLAINED:
        return f"explained by {found}"
    if axis.verdict is Verdict.PARTLY_EXPLAINED:
        share = f"{100.0 * axis.explained_share:.0f} %"
        return f"{share} of what the base model misses, by {found}"
    none = "no known effect is certain" if axis.suspected else "no known effect fits"
    return f"{none} beside {minor}" if minor else none


def _residual(axis: AxisDiagnosis) -> str:
    before, left = percent(axis.base.fitted), percent(axis.extended.fitted)
    falls = f"falls from {before} to {left}" if axis.extends_base else f"is {left}"
    return f"the residual {falls} of the effort; noise alone leaves {percent(axis.noise_floor)}"


def not_accepted(axis: AxisDiagnosis) -> list[str]:
    """One sentence for each suspected and each minor cause."""
    suspected = [f"suspected only: {_with_share(c)}, because {c.decision}" for c in axis.suspected]
    return suspected + [f"minor: {_with_share(c)}: {c.decision}" for c in axis.minor]


def _with_share(cause: Cause) -> str:
    return f"{spoken(cause.term.effect)} ({percent(cause.share)} of the effort)"


def timing_sentence(timing: Timing) -> str:
    """By how much the effort is recorded late or early."""
    if timing == NO_SHIFT:
        return "the delay in the model is all by which the effort is late"
    if timing.unknown:
        return (
            "the recording does not show by how much the effort is late; the intervals allow for "
            f"± {LARGEST_SHIFT:g} samples"
        )
    shift = f"{abs(timing.shift_samples):.2f}"
    if float(shift) == 0.0:
        return f"the effort is in step with the motion, ± {timing.std_samples:.2g} samples"
    way = "late" if timing.shift_samples >= 0.0 else "early"
    return (
        f"the effort is {way} by {shift} ± {timing.std_samples:.2f} samples "
        f"({1e3 * abs(timing.shift_s):.3g} ms), which every model here includes"
    )


def refused_sentence(refused: Refused) -> str:
    """Why an effect that entered the model is no cause."""
    return f"{spoken(refused.effect)} was refused: {refused.reason}"


def alternative_sentence(alternative: Alternative) -> str:
    """Whether the data distinguish an alternative from the cause."""
    if alternative.separable:
        return f"not {spoken(alternative.effect)}: {alternative.evidence}"
    return (
        f"this motion does not distinguish it from {spoken(alternative.effect)} "
        f"({alternative.evidence}); "
        f"record {alternative.experiment}"
    )


def not_testable(axis: AxisDiagnosis) -> Mapping[str, list[str]]:
    """Effects that are not testable, in words, by the motion that excites them."""
    found: dict[str, list[str]] = {}
    for effect in axis.not_testable:
        found.setdefault(effect.experiment, []).append(spoken(effect.effect))
    return found


def can_be_planned(axis: AxisDiagnosis, axes: int) -> bool:
    """Whether `edge-ident plan` designs a motion for some of what was not testable.

    Parameters
    ----------
    axes : int
        Number of axes in the recordings. With one, no motion shows what a second one does.
    """
    effects = [named(missing.effect) for missing in axis.not_testable]
    return any(not e.tied_to_time and (axes > 1 or not e.needs_source) for e in effects)


def gain(cause: Cause) -> tuple[str, str]:
    """Reduction of the held-out residual by a cause, and its interval."""
    low, high = (f"{100 * end:.0f}" for end in cause.held_out_gain_interval)
    return f"{100 * cause.held_out_gain:.0f} %", f"{low} to {high} %"


def values(term: Term, axis: AxisModel) -> list[str]:
    """Parameters of a term with standard deviations and units, one a line.

    Parameters that its form does not have are left out.
    """
    source = [] if term.source_axis is None else [f"from axis {term.source_axis}"]
    return source + [
        f"{spoken(name)} {_number(entry)} {entry['unit']}".removesuffix(" 1") + _turns(name, entry)
        for name, entry in values_document(term, axis).items()
        if entry["std"] is not None
    ]


def _turns(name: str, entry: Mapping[str, Any]) -> str:
    """A period of an angle as orders per turn."""
    if name != "period" or entry["unit"] != "rad":
        return ""
    return f" ({2.0 * math.pi / entry['value']:.4g} per turn)"


def before_and_after(
    axis: AxisDiagnosis, validation: Validation | None
) -> list[tuple[str, str, str]]:
    """Rows that compare the base and the extended model: label, base, extended."""
    there: list[tuple[float, ...]] = [(), ()]
    if validation is not None:
        residuals = validation.base, validation.extended
        there = list(zip(residuals, validation.friction_anew, strict=True))
    base = _described(axis.base, there[0], axis.model)
    extended = _described(axis.extended, there[1], axis.model)
    return [(label, cell, extended[label]) for label, cell in base.items()]


def _described(fit: ModelFit, validated: tuple[float, ...], axis: AxisModel) -> dict[str, str]:
    """Cells of one model by label; `validated` are its residuals on the validation recording."""
    cells = {
        "relative residual, fitted": percent(fit.fitted),
        "relative residual, held out": percent(fit.held_out),
    }
    labels = ("relative residual, validation", "the same, friction fitted to it")
    cells |= {label: percent(value) for label, value in zip(labels, validated, strict=False)}
    moved = "not simulated" if fit.motion_error is None else f"{fit.motion_error:.3g}"
    cells |= {
        "fit": f"{fit.metric.fit:.4f}",
        "time-spectral metric": f"{fit.metric.time_spectral:.4f}",
        f"error in simulated motion, rms ({axis.position_unit})": moved,
    }
    base = base_axis(fit.estimate, *axis.units)
    return cells | {
        f"{spoken(name)} ({entry['unit']})": _number(entry)
        for name, entry in values_document(base.terms[0], base).items()
    }


def _number(entry: Mapping[str, Any]) -> str:
    """A value, with its standard deviation where there is one."""
    return with_deviation(entry["value"], entry["std"])


def distinct_causes(causes: Iterable[Cause]) -> list[Cause]:
    """The strongest term of each effect."""
    first: dict[str, Cause] = {}
    for cause in causes:
        first.setdefault(cause.term.effect, cause)
    return list(first.values())


def in_words(causes: Iterable[Cause]) -> list[str]:
    """What each effect is, in everyday words."""
    return [named(cause.term.effect).advice.in_words for cause in distinct_causes(causes)]


def parts_of(causes: Iterable[Cause]) -> list[str]:
    """Parts of the machine to look at, each once."""
    return list(dict.fromkeys(named(cause.term.effect).advice.part for cause in causes))

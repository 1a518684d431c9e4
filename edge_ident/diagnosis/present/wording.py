"""The sentences of a diagnosis, the same on the terminal and on the page."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

from edge_ident.diagnosis.result import AxisDiagnosis, Cause, Fit, Rival, Validation, Verdict
from edge_ident.model.model import AxisModel, Term, base_axis
from edge_ident.model.model_files import values_document


def spoken(effect: str) -> str:
    """An effect's name in words."""
    return effect.replace("_", " ")


def listed(items: Iterable[str]) -> str:
    """a, b and c; nothing of nothing."""
    *first, last = list(items) or [""]
    return f"{', '.join(first)} and {last}" if first else last


def percent(share: float) -> str:
    """Of a residual or a gain."""
    return f"{100 * share:.1f} %" if abs(share) >= 0.1 else f"{100 * share:.2f} %"


def verdict_sentence(axis: AxisDiagnosis) -> str:
    """The verdict with its numbers, and what shakes the axis from outside."""
    shaken = [
        f"{amplitude:.3g} {axis.model.effort_unit} at {frequency_hz:.4g} Hz"
        for frequency_hz, amplitude in vibrations(axis)
    ]
    if not shaken:
        return _verdict(axis)
    return f"{_verdict(axis)}; it is shaken from outside, with the clock: {listed(shaken)}"


def vibrations(axis: AxisDiagnosis) -> list[tuple[float, float]]:
    """Frequency in Hz and amplitude, in the unit of the effort, of what shakes it from outside."""
    return [
        (float(term.values["frequency"]), math.hypot(term.values["cosine"], term.values["sine"]))
        for term in axis.vibrations
    ]


def _verdict(axis: AxisDiagnosis) -> str:
    floor = f"noise alone would leave {percent(axis.noise_floor)}"
    left = percent(axis.extended.fitted)
    if axis.verdict is Verdict.ADEQUATE:
        return f"the base model is adequate: it leaves {left} of the effort; {floor}"
    found = listed(dict.fromkeys(spoken(cause.term.effect) for cause in axis.causes))
    if axis.verdict is Verdict.EXPLAINED:
        before = percent(axis.base.fitted)
        return f"explained by {found}: what is left falls from {before} to {left}; {floor}"
    known = f"{found} found, but" if found else "no known effect fits:"
    return f"unexplained: {known} {left} of the effort is left; {floor}"


def rival_sentence(rival: Rival) -> str:
    """What became of a rival."""
    if rival.separable:
        return f"not {spoken(rival.effect)}: {rival.evidence}"
    return (
        f"{spoken(rival.effect)} cannot be told apart from it by this motion ({rival.evidence}); "
        f"record {rival.experiment}"
    )


def not_testable(axis: AxisDiagnosis) -> Mapping[str, list[str]]:
    """Effects, in words, by the motion that would show them."""
    found: dict[str, list[str]] = {}
    for effect in axis.not_testable:
        found.setdefault(effect.experiment, []).append(spoken(effect.effect))
    return found


def gain(cause: Cause) -> tuple[str, str]:
    """What a cause takes off the held-out residual, and its interval."""
    low, high = (f"{100 * end:.0f}" for end in cause.held_out_gain_interval)
    return f"{100 * cause.held_out_gain:.0f} %", f"{low} to {high} %"


def values(term: Term, axis: AxisModel) -> list[str]:
    """A term's parameters with standard deviations and units, one a line; those that were not
    estimated, because its form has none, are left out."""
    source = [] if term.source_axis is None else [f"from axis {term.source_axis}"]
    return source + [
        f"{spoken(name)} {_number(entry)} {entry['unit']}".removesuffix(" 1") + _turns(name, entry)
        for name, entry in values_document(term, axis).items()
        if entry["std"] is not None
    ]


def _turns(name: str, entry: Mapping[str, Any]) -> str:
    """A period of an angle as orders per turn, which is how people know them."""
    if name != "period" or entry["unit"] != "rad":
        return ""
    return f" ({2.0 * math.pi / entry['value']:.4g} per turn)"


def before_and_after(
    axis: AxisDiagnosis, validation: Validation | None
) -> list[tuple[str, str, str]]:
    """What is said about the base and the extended model: label, base, extended."""
    base = _described(axis.base, validation.base if validation else None, axis.model)
    extended = _described(axis.extended, validation.extended if validation else None, axis.model)
    return [(label, cell, extended[label]) for label, cell in base.items()]


def _described(fit: Fit, validated: float | None, axis: AxisModel) -> dict[str, str]:
    """One model by label; `validated` is its relative residual on the validation recording."""
    cells = {
        "relative residual, fitted": percent(fit.fitted),
        "relative residual, held out": percent(fit.held_out),
    }
    if validated is not None:
        cells["relative residual, validation"] = percent(validated)
    moved = "not simulated" if fit.motion_error is None else f"{fit.motion_error:.3g}"
    cells |= {
        "fit": f"{fit.metric.fit:.4f}",
        "time-spectral metric": f"{fit.metric.time_spectral:.4f}",
        f"error in simulated motion, rms ({axis.position_unit})": moved,
    }
    base = base_axis(fit.estimate, axis.position_unit, axis.effort_unit)
    return cells | {
        f"{spoken(name)} ({entry['unit']})": _number(entry)
        for name, entry in values_document(base.terms[0], base).items()
    }


def _number(entry: Mapping[str, Any]) -> str:
    """A value, with its standard deviation where that is known."""
    return f"{entry['value']:.4g}" + ("" if entry["std"] is None else f" ± {entry['std']:.2g}")

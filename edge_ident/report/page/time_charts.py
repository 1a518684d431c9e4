"""Charts over time: measured and modelled effort, and what the models miss."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.measures import Traces
from edge_ident.diagnosis.present.document import running_time
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.report.page.chart import Chart, Layer
from edge_ident.report.page.scale import Scale, across, around
from edge_ident.report.page.wording import digits, effort_word, unit_text
from edge_ident.signals.metrics import quantile

Array = NDArray[np.float64]

_DETAIL: Final = 0.08
"""Share of the samples in the detail."""
_GAP: Final = 2.0
"""Step of the time over its usual one from which samples are missing."""
_FEWEST: Final = 200
"""Samples of the detail."""


def effort_chart(key: str, axis: AxisDiagnosis, part: slice = slice(None)) -> Chart:
    """Measured effort and what the models say, over all of the time or a part of it."""
    traces, unit = axis.traces, axis.model.effort_unit
    time, effort = running_time(traces)[part], broken(traces, traces.effort)[part]
    layers = [Layer("line", "measured", time, effort, "measured")]
    layers += [
        Layer("line", style, time, broken(traces, signal)[part], label)
        for style, label, signal in models(axis)
    ]
    word = effort_word(unit)
    return Chart(
        key,
        f"Measured {word} and what the model says",
        f"From {digits(float(time[0]), 3)} s to {digits(float(time[-1]), 3)} s the measured {word} "
        f"goes from {_number(np.nanmin(effort), unit)} to {_number(np.nanmax(effort), unit)}. "
        f"{_missed(axis)}",
        ("time", "s"),
        (word, unit_text(unit)),
        across(time),
        around(np.concatenate([layer.y for layer in layers])),
        tuple(layers),
    )


def residual_chart(key: str, axis: AxisDiagnosis) -> Chart:
    """What both models miss over time, at the valid samples."""
    traces, unit = axis.traces, axis.model.effort_unit
    time = running_time(traces)
    valid = traces.valid
    missed = {
        style: (label, broken(traces, np.where(valid, traces.effort - signal, np.nan)))
        for style, label, signal in models(axis)
    }
    height = reach(np.concatenate([signal[valid] for _, signal in missed.values()]))
    layers = [noise_band(axis)]
    layers += [
        Layer("line", f"{style} thin", time, signal, label)
        for style, (label, signal) in missed.items()
    ]
    return Chart(
        key,
        "What the model misses",
        f"Difference between measured and modelled {effort_word(unit)}. {_missed(axis)} "
        f"Noise alone leaves {digits(100 * axis.noise_floor, 2)} %.",
        ("time", "s"),
        ("error of the model", unit_text(unit)),
        across(time),
        Scale(-height, height),
        tuple(layers),
        height=170,
        caption="The grey band is what noise alone leaves. Gaps are samples that do not count: the "
        "direction of motion is unknown there, or the encoder's steps are too coarse.",
    )


def busiest(axis: AxisDiagnosis) -> slice:
    """The part of the time in which the models differ most, or the effort is largest."""
    traces = axis.traces
    changed = traces.extended_effort if axis.extends_base else traces.effort
    samples = len(changed)
    width = min(samples - 1, max(_FEWEST, round(_DETAIL * samples)))
    energy = np.cumsum(np.where(traces.valid, changed - traces.base_effort, 0.0) ** 2)
    first = int(np.argmax(energy[width:] - energy[:-width]))
    return slice(first, first + width)


def models(axis: AxisDiagnosis) -> list[tuple[str, str, Array]]:
    """Style, label and prediction of each model."""
    base = ("base", "simple model", axis.traces.base_effort)
    extended = ("extended", "model with the causes", axis.traces.extended_effort)
    return [base, extended] if axis.extends_base else [base]


def noise_band(axis: AxisDiagnosis) -> Layer:
    """One standard deviation of the noise floor to either side of zero."""
    effort = axis.traces.effort[axis.traces.valid]
    rms = axis.noise_floor * float(np.sqrt(np.mean(effort**2))) if len(effort) else 0.0
    return Layer("band", "noise", np.zeros(2), np.array([rms, -rms]), "noise alone")


def reach(values: Array) -> float:
    """Half the height of a chart that shows all but the farthest values."""
    finite = np.abs(values[np.isfinite(values)])
    return 1.3 * quantile(np.append(finite, 0.0), 0.995) or 1.0


def broken(traces: Traces, signal: Array) -> Array:
    """A signal whose line breaks between recordings, and where samples are missing."""
    steps_s = np.diff(traces.time_s)
    ends = (np.diff(traces.file) != 0) | (steps_s > _GAP * np.median(steps_s))
    return np.where(np.append(False, ends), np.nan, signal)


def _missed(axis: AxisDiagnosis) -> str:
    missed = f"The simple model misses {digits(100 * axis.base.fitted, 2)} % of it (rms)"
    if not axis.extends_base:
        return f"{missed}."
    return f"{missed}, the model with the causes {digits(100 * axis.extended.fitted, 2)} %."


def _number(value: float, unit: str) -> str:
    return f"{digits(float(value), 3)} {unit_text(unit)}"

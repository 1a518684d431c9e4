"""Chart over frequency: effort and what the model misses, as amplitude densities."""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from edge_ident.diagnosis.measures import Traces
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.report.page.chart import Chart, Layer
from edge_ident.report.page.scale import Scale, across
from edge_ident.report.page.time_charts import models
from edge_ident.report.page.wording import digits, effort_word, unit_text
from edge_ident.signals.metrics import quantile

Array = NDArray[np.float64]

_SEGMENTS: Final = 8
"""Fewest segments over which a spectrum is averaged."""
_BAND: Final = 1.5
"""Highest frequency, over the bandwidth. Samples are 2.5 per period of the bandwidth at least, so
their spectrum ends at 1.25 times the bandwidth or above."""


def spectrum_chart(key: str, axis: AxisDiagnosis) -> Chart:
    """Densities of the effort and of both residuals, up to 1.5 times the bandwidth."""
    traces, unit = axis.traces, unit_text(axis.model.effort_unit)
    word = effort_word(axis.model.effort_unit)
    signals = [("measured", f"measured {word}", traces.effort)]
    signals += [
        (style, f"error, {label}", traces.effort - effort) for style, label, effort in models(axis)
    ]
    layers = []
    for style, label, signal in signals:
        frequency, density = _density(traces, signal)
        seen = (frequency > 0.0) & (frequency <= _BAND * axis.cutoff_hz) & (density > 0.0)
        layers.append(Layer("line", style, frequency[seen], density[seen], label))
    edge = np.array([axis.cutoff_hz])
    layers.append(Layer("bound", "edge", edge, edge, "end of the compared band"))
    every = np.concatenate([layer.y for layer in layers[:-1]])
    last = layers[len(signals) - 1]
    peak = float(last.x[np.argmax(last.y)]) if len(last.x) else 0.0
    return Chart(
        key,
        "Over frequency",
        f"What is left is largest near {digits(peak, 2)} Hz. Compared up to "
        f"{digits(axis.cutoff_hz, 3)} Hz.",
        ("frequency", "Hz"),
        ("density", f"{unit}/√Hz"),
        across(np.append(layers[0].x, 0.0)),
        Scale(float(np.min(every)), 1.5 * float(np.max(every)), "log"),
        tuple(layers),
        height=200,
        caption="A narrow peak is a resonance or a vibration in time.",
    )


def _density(traces: Traces, signal: Array) -> tuple[Array, Array]:
    """Frequencies in Hz, and the square root of the power density (Welch 1967)."""
    period_s = quantile(np.diff(traces.time_s), 0.5)
    length = max(16, 2 * len(signal) // _SEGMENTS)
    frequency, power = welch(signal, 1.0 / period_s, nperseg=min(length, len(signal)))
    return frequency, np.sqrt(power)

"""Charts of a run: tracking error with old and new gains, and the identified model over time."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.identification.result import AxisIdentification
from edge_ident.report.page.chart import Chart, Layer
from edge_ident.report.page.scale import Scale, across, around
from edge_ident.report.page.time_charts import reach
from edge_ident.report.page.wording import digits, effort_word, unit_text
from edge_ident.signals.metrics import quantile
from edge_ident.signals.recording import Recording

_INTERVALS: Final = 150
"""The tracking error is drawn as its maximum in each of so many intervals."""
_GAP: Final = 1.5
"""Sampling periods from which a line is broken: the axis stood still there."""


def tracking_chart(key: str, name: str, before: Recording, after: Recording | None) -> Chart | None:
    """Largest tracking error over time; None where the recording has no reference."""
    layers = [
        layer
        for style, label, recording in (
            ("base", "old gains", before),
            ("extended", "new gains", after),
        )
        if recording is not None and (layer := _largest(style, label, name, recording))
    ]
    if not layers:
        return None
    every = np.concatenate([layer.y for layer in layers])
    peaks = ", ".join(
        f"{layer.label} up to {digits(1e3 * float(np.max(layer.y)), 3)} mrad" for layer in layers
    )
    return Chart(
        key,
        "How far the axis is from its path",
        f"Largest tracking error in {_INTERVALS} intervals of time: {peaks}.",
        ("time", "s"),
        ("tracking error", before.axes[name].position_unit),
        across(np.concatenate([layer.x for layer in layers])),
        Scale(0.6 * float(np.min(every)), 1.3 * float(np.max(every)), "log"),
        tuple(layers),
        caption="Logarithmic scale: from one number to the next, the error is ten times larger.",
    )


def _largest(style: str, label: str, name: str, recording: Recording) -> Layer | None:
    axis = recording.axes.get(name)
    if axis is None or axis.reference is None:
        return None
    error = np.abs(axis.reference - axis.position)
    largest = np.array([np.max(part) for part in np.array_split(error, _INTERVALS)])
    time_s = np.linspace(0.0, recording.time_s[-1] - recording.time_s[0], _INTERVALS)
    seen = largest > 0.0
    return Layer("line", style, time_s[seen], largest[seen], label) if np.any(seen) else None


def identified_charts(key: str, axis: AxisIdentification) -> list[Chart]:
    """Measured effort with the identified model, and the difference."""
    trace, unit = axis.trace, axis.units[3]
    word, gaps = effort_word(unit), np.append(False, _gaps(trace.time_s))
    measured = np.where(gaps, np.nan, trace.measured)
    residual = measured - trace.modelled
    height = reach(residual)
    missed = f"The model misses {digits(100 * axis.metric.relative_residual, 2)} % of it (rms)."
    scale = across(trace.time_s)
    effort = (
        Layer("line", "measured", trace.time_s, measured, "measured"),
        Layer(
            "line",
            "extended",
            trace.time_s,
            np.where(gaps, np.nan, trace.modelled),
            "identified model",
        ),
    )
    return [
        Chart(
            f"{key}-effort", f"Measured {word} and what the model says",
            f"The measured {word} goes from {digits(float(np.min(trace.measured)), 3)} to "
            f"{digits(float(np.max(trace.measured)), 3)} {unit_text(unit)}. {missed}",
            ("time", "s"), (word, unit_text(unit)), scale, around(trace.measured), effort,
        ),
        Chart(
            f"{key}-residual", "What the model misses", missed,
            ("time", "s"), ("error of the model", unit_text(unit)), scale, Scale(-height, height),
            (Layer("line", "extended thin", trace.time_s, residual, "identified model"),),
            height=170,
        ),
    ]  # fmt: skip


def _gaps(time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    steps = np.diff(time_s)
    return np.asarray(steps > _GAP * quantile(steps, 0.5))

"""A cause that shows where the axis turns back, as a loop of effort against position."""

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.measures import Traces
from edge_ident.diagnosis.result import AxisDiagnosis, Cause
from edge_ident.report.page.chart import Chart, Layer
from edge_ident.report.page.scale import across, around
from edge_ident.report.page.time_charts import models
from edge_ident.report.page.wording import digits, effort_word, unit_text
from edge_ident.support.words import spoken

Array = NDArray[np.float64]


def loop_chart(key: str, axis: AxisDiagnosis, cause: Cause) -> Chart | None:
    """Effort against position, once to and fro: where the cause acts most.

    None where the recording has no two reversals one after the other.
    """
    traces = axis.traces
    part = traces.contributions[cause.term.effect]
    way = _to_and_fro(traces, part)
    if way is None:
        return None
    position, word = traces.position[way], effort_word(axis.model.effort_unit)
    layers = [Layer("line", "measured", position, traces.effort[way], "measured")]
    layers += [
        Layer("line", style, position, signal[way], label) for style, label, signal in models(axis)
    ]
    unit, acts = unit_text(axis.model.effort_unit), part[way]
    return Chart(
        key,
        f"{word.capitalize()} against position, once to and fro",
        f"The cause, {spoken(cause.term.effect)}, adds from {digits(float(np.min(acts)), 2)} to "
        f"{digits(float(np.max(acts)), 2)} {unit} here. It makes up "
        f"{digits(100 * cause.share, 2)} % of the {word}.",
        ("position", axis.model.position_unit),
        (word, unit),
        across(position),
        around(np.concatenate([layer.y for layer in layers])),
        tuple(layers),
        caption="The axis goes round the loop once. The cause shows at its ends, where the axis "
        "turns back: there the simple model leaves the measured line.",
    )


def _to_and_fro(traces: Traces, part: Array) -> slice | None:
    """From a reversal to the next but one, in one recording, where a contribution is largest."""
    turns = np.flatnonzero(np.diff(np.sign(traces.velocity)) != 0) + 1
    energy = np.append(0.0, np.cumsum(part**2))
    best, found = 0.0, None
    for first, last in zip(turns[:-2], turns[2:], strict=True):
        whole = traces.file[first] == traces.file[last]
        # a long way with the cause at both ends counts more than a small one
        size = (energy[last] - energy[first]) * np.ptp(traces.position[first : last + 1])
        if whole and last - first >= 8 and size > best:
            best, found = size, slice(int(first), int(last) + 1)
    return found

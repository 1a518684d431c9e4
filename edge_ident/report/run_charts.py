"""Charts of a run: effort and model over time, and tracking error with old and new gains."""

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from edge_ident.commissioning.identification_motions import CAPTURE_FILE
from edge_ident.commissioning.rounds import VERIFICATION_FILE
from edge_ident.errors import DataError
from edge_ident.identification.identify import identify
from edge_ident.report.chart import Chart, Layer, Scale, across, of_axes
from edge_ident.report.figure import drawn
from edge_ident.report.identification import identified_charts
from edge_ident.report.numbers import digits
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_INTERVALS: Final = 150  # the tracking error is drawn as its maximum in each of so many intervals


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


def draw_run(folder: Path) -> "Figure":
    """Draw effort against model, the residual, and tracking error before and after.

    Parameters
    ----------
    folder : Path
        Holds a capture and, where gains were written, a verification.

    Raises
    ------
    DataError
        There is no capture, or matplotlib is not installed.
    """
    if not (folder / CAPTURE_FILE).is_file():
        raise DataError(
            f"{folder} has no {CAPTURE_FILE}",
            "give the folder of a run or a capture that came to its end; edge-ident identify reads "
            "a part of a capture",
        )
    before = load_recording(folder / CAPTURE_FILE)
    verification = folder / VERIFICATION_FILE
    after = load_recording(verification) if verification.is_file() else None
    charts = {}
    for name, axis in identify(before).axes.items():
        tracking = tracking_chart("", name, before, after)
        charts[name] = [*identified_charts("", axis), *([tracking] if tracking else [])]
    return drawn(of_axes(charts))

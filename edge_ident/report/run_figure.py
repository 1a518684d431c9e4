"""What a run measured, as a figure: effort, residual, and tracking error before and after."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from edge_ident.commissioning.identification_motions import CAPTURE_FILE
from edge_ident.commissioning.rounds import VERIFICATION_FILE
from edge_ident.errors import DataError
from edge_ident.identification.identify import identify
from edge_ident.report.effort_figure import draw_effort
from edge_ident.report.figure import new_figure
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_INTERVALS: Final = 120  # the tracking error is drawn as its maximum in each of so many intervals


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
    figure = new_figure(10, 7)
    grid = figure.subplots(3, len(before.axes), sharex=True, squeeze=False)
    for (top, middle, bottom), (name, axis) in zip(
        grid.T, identify(before).axes.items(), strict=True
    ):
        draw_effort(top, middle, name, axis.trace, axis.units[3])
        _draw_tracking(bottom, name, before, after)
    return figure


def _draw_tracking(panel: Any, name: str, before: Recording, after: Recording | None) -> None:
    for label, recording in (("old gains", before), ("new gains", after)):
        axis = recording.axes.get(name) if recording else None
        if recording is None or axis is None or axis.reference is None:
            continue
        error = np.abs(axis.reference - axis.position)
        largest = [np.max(part) for part in np.array_split(error, _INTERVALS)]
        time_s = np.linspace(0.0, recording.time_s[-1] - recording.time_s[0], _INTERVALS)
        panel.semilogy(time_s, largest, label=label, linewidth=1)
    panel.set_ylabel(f"largest tracking error ({before.axes[name].position_unit})")
    panel.set_xlabel("time (s)")
    panel.legend(fontsize="small")

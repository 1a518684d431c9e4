"""Pictures of a run, for people who would rather look than read. Needs the `report` extra."""

from pathlib import Path
from typing import Any

import numpy as np

from edge_ident.commissioning.run import CAPTURE_FILE, VERIFICATION_FILE
from edge_ident.errors import DataError
from edge_ident.estimation import least_squares
from edge_ident.signals.conditioning import condition
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording
from edge_ident.support.atomic_files import atomic_write

_STRETCHES = 120
"""The tracking error is drawn as its largest value in each of so many stretches."""


def draw_run(folder: Path, picture: Path) -> Path:
    """Effort against model, what the model misses, and tracking before and after.

    Parameters
    ----------
    folder : Path
        Holds a capture and, where gains were written, a verification.
    picture : Path
        File to write, .png, .svg or .pdf.

    Returns
    -------
    Path
        The picture.

    Raises
    ------
    DataError
        No capture there, or matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise DataError(
            "drawing needs matplotlib", "install it with: pip install 'edge-ident[report]'"
        ) from error
    before = load_recording(folder / CAPTURE_FILE)
    verification = folder / VERIFICATION_FILE
    after = load_recording(verification) if verification.is_file() else None
    figure = Figure(figsize=(10, 7), layout="constrained")
    grid = figure.subplots(3, len(before.axes), sharex=True, squeeze=False)
    for column, (name, axis) in enumerate(before.axes.items()):
        _draw_effort(grid[0][column], grid[1][column], name, before, axis)
        _draw_tracking(grid[2][column], name, before, after)
    with atomic_write(picture) as partial:
        figure.savefig(partial, dpi=120)
    return picture


def _draw_effort(top: Any, middle: Any, name: str, recording: Recording, axis: AxisRecord) -> None:
    signals = condition(
        recording.time_s, axis.position, axis.effort, effort_shift_s=recording.effort_shift_s
    )
    part = least_squares.estimation_part(signals)
    found = least_squares.fit(signals, part)
    shown = slice(part[0], part[-1])
    time, effort = recording.time_s[shown], signals.effort[shown]
    model = signals.regressor[shown] @ found.parameters
    top.plot(time, effort, label="measured, filtered", linewidth=1.5)
    top.plot(time, model, "--", label="least-squares model", linewidth=1)
    top.set_title(f"axis {name}")
    top.set_ylabel(f"effort ({axis.effort_unit})")
    top.legend(fontsize="small")
    middle.plot(time, effort - model, color="tab:red", linewidth=1)
    middle.set_ylabel(f"missed ({axis.effort_unit})")


def _draw_tracking(bottom: Any, name: str, before: Recording, after: Recording | None) -> None:
    for label, recording in (("old gains", before), ("new gains", after)):
        axis = recording.axes.get(name) if recording else None
        if recording is None or axis is None or axis.reference is None:
            continue
        error = np.abs(axis.reference - axis.position)
        stretches = [np.max(part) for part in np.array_split(error, _STRETCHES)]
        time = np.linspace(recording.time_s[0], recording.time_s[-1], _STRETCHES)
        bottom.semilogy(time, stretches, label=label, linewidth=1)
    bottom.set_ylabel(f"largest tracking error ({before.axes[name].position_unit})")
    bottom.set_xlabel("time (s)")
    bottom.legend(fontsize="small")

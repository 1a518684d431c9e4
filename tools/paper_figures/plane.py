"""The path in the plane of both axes: a circle, as commanded and as the virtual board moves."""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from edge_ident.commissioning.identification_motions import CAPTURE_FILE, Plan
from edge_ident.commissioning.rounds import VERIFICATION_FILE
from edge_ident.commissioning.run import commission
from edge_ident.drive.description import load_drive
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording
from firmware_interface.board import Board
from firmware_interface.connection import open_link
from tools.paper_figures.page import Section, Sources, table

Array = NDArray[np.float64]

AXES: Final = ("x", "z")
SHOWN: Final = 0.12
"""Largest error in the picture, over the circle's radius."""
SEGMENTS: Final = 360
"""Number of segments; a figure shows the mean or the largest error of each."""


class _Silence:
    """An observer that has nothing to say."""

    def stage(self, title: str) -> None:
        pass

    def samples(self, in_hand: int, expected: int) -> None:
        pass

    def say(self, message: str) -> None:
        pass


@dataclass(frozen=True)
class Path2D:
    """A path in the plane.

    Attributes
    ----------
    gains : str
        With which the board moved.
    commanded, measured : (2, N) arrays
        x and z of the tables, m.
    """

    gains: str
    commanded: Array
    measured: Array

    @property
    def error(self) -> Array:
        """Distance (N,) from where the axes should be at that time, m."""
        return np.asarray(np.hypot(*(self.measured - self.commanded)))

    @property
    def means(self) -> tuple[Array, Array]:
        """Command and error (2, SEGMENTS), m: means over segments, to see past the counts."""

        def means(path: Array) -> Array:
            parts = np.array_split(path, SEGMENTS, axis=1)
            return np.stack([np.mean(part, axis=1) for part in parts], axis=1)

        return means(self.commanded), means(self.measured - self.commanded)

    @property
    def magnification(self) -> float:
        """Of the mean error in the picture: one digit and zeros."""
        commanded, error = self.means
        return float(f"{SHOWN * np.max(np.hypot(*commanded)) / np.max(np.hypot(*error)):.0e}")

    @property
    def radial(self) -> Array:
        """How far outside the circle the path runs, (N,), m."""
        return np.asarray(np.hypot(*self.measured) - np.hypot(*self.commanded))


def path_of(recording: Recording, gains: str) -> Path2D:
    """Both axes of a recording, at the screws."""
    drive = load_drive()
    leads = [drive.axes[axis].screw_lead_m_per_rad for axis in AXES]
    records = [recording.axes[axis] for axis in AXES]
    commanded, measured = (
        np.stack([lead * getattr(r, name) for lead, r in zip(leads, records, strict=True)])
        for name in ("reference", "position")
    )
    return Path2D(gains, commanded, measured)


def capture_paths() -> list[Path2D]:
    """Let the virtual board move with the gains of its start-up, then with those designed."""
    board = Board.connect(open_link("virtual"))
    try:
        with TemporaryDirectory() as name:
            folder = Path(name)
            commission(board, load_drive(), None, Plan(), folder, _Silence())
            return [
                path_of(load_recording(folder / CAPTURE_FILE), "start-up gains"),
                path_of(load_recording(folder / VERIFICATION_FILE), "designed gains"),
            ]
    finally:
        board.close()


def section(sources: Sources) -> Section:
    """The circle before and after."""
    paths = capture_paths()
    picture = sources.save(draw(paths), "plane", "Circle commanded and measured")
    rows = [
        [
            path.gains,
            f"{1e6 * np.sqrt(np.mean(path.error**2)):.1f} µm",
            f"{1e6 * np.max(path.error):.1f} µm",
            f"{1e6 * np.max(np.abs(path.radial)):.1f} µm",
        ]
        for path in paths
    ]
    x = load_drive().axes["x"]
    count_m = x.encoder_resolution_rad * x.screw_lead_m_per_rad
    heading = ["", "distance from command, rms", "largest", "off the circle, largest"]
    return Section(
        "The path in the plane",
        "It shows the path of its robot in the plane of x and z, commanded and measured: θ = "
        "2π·sin(0.2875 t), φ = 2π·cos(0.2875 t), a circle of 4 mm radius at the tables.",
        "The virtual board, captured over its registers; one count of the encoder is "
        f"{1e6 * count_m:.2f} µm.\n\n{table(heading, rows)}\n\n{picture}",
        "The board is a flexible simulation with catalogue-like parts ([virtual "
        "board](virtual_board.md)), not the paper's robot, which moves with one controller. Here "
        "`edge-ident run` identifies the drive on the first circle and writes gains; the second "
        "verifies them. The corners are friction that holds each axis back behind soft gains.",
    )


def draw(paths: list[Path2D]) -> Figure:
    """Path above with its error magnified, distance from the command below."""
    figure = Figure(figsize=(10, 7.6), layout="constrained")
    grid = figure.subplots(2, len(paths), height_ratios=[3, 1], squeeze=False)
    for (top, bottom), path in zip(grid.T, paths, strict=True):
        _draw_path(top, path)
        largest = [np.max(part) for part in np.array_split(path.error, SEGMENTS)]
        turn = np.linspace(0.0, 360.0, SEGMENTS)
        bottom.plot(turn, 1e6 * np.array(largest), color="tab:red", linewidth=1.0)
        bottom.set_xlabel("along the circle (°)")
        bottom.set_ylabel("largest error (µm)")
        bottom.set_xlim(0, 360)
        bottom.set_ylim(bottom=0)
        bottom.set_xticks(range(0, 361, 90))
        bottom.grid(alpha=0.3)
    return figure


def _draw_path(panel: Any, path: Path2D) -> None:
    commanded, error = path.means
    shown = commanded + path.magnification * error
    panel.plot(*(1e3 * path.commanded), color="k", linewidth=1.0, label="commanded")
    panel.plot(*(1e3 * path.measured), "--", linewidth=1.0, label="measured")
    label = f"measured, mean error × {path.magnification:.0f}"
    panel.plot(*(1e3 * shown), color="tab:red", linewidth=0.9, label=label)
    panel.set_aspect("equal")
    panel.set_xlim(-4.8, 4.8)
    panel.set_ylim(-4.8, 4.8)
    panel.set_title(path.gains)
    panel.set_xlabel("x (mm)")
    panel.set_ylabel("z (mm)")
    panel.legend(loc="center")

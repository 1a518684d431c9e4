"""Loss curves of training and test, for the paper's recipe and for the improved one."""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from edge_ident.errors import DataError
from export.configuration import IMPROVED, PAPER, Configuration
from export.data import Batches
from export.motion import paper_motion
from export.train import TEST_EXAMPLES
from tools.paper_figures.page import Section, Sources, table

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """Losses of one training run, in order.

    Attributes
    ----------
    stages : tuple of str
        One a point.
    step : (n,) array
        Of its stage.
    train, test : (n,) arrays
    """

    stages: tuple[str, ...]
    step: Array
    train: Array
    test: Array

    def of(self, stage: str) -> "Curve":
        """The points of one stage."""
        chosen = np.array([name == stage for name in self.stages])
        names = tuple(name for name in self.stages if name == stage)
        return Curve(names, self.step[chosen], self.train[chosen], self.test[chosen])


def read_curve(path: Path) -> Curve:
    """Read a run's losses.csv: stage, step, train, test.

    Raises
    ------
    DataError
        The file is missing, or is no such table.
    """
    advice = "train with that configuration, and name the run's losses.csv with --losses"
    try:
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        numbers = np.array([[float(row[n]) for n in ("step", "train", "test")] for row in rows])
        stages = tuple(row["stage"] for row in rows)
    except FileNotFoundError as error:
        raise DataError(f"{path}: there are no losses", advice) from error
    except (KeyError, TypeError, ValueError) as error:
        raise DataError(f"{path}: no table of losses ({error})", advice) from error
    if not rows:
        raise DataError(f"{path}: a table of losses without rows", advice)
    return Curve(stages, *numbers.T)


def section(sources: Sources) -> Section:
    """Both runs' curves side by side."""
    curves = {
        name: read_curve(path)
        for name, path in zip((PAPER.name, IMPROVED.name), sources.losses, strict=True)
    }
    constant = constant_loss(PAPER)
    picture = sources.save(draw(curves, constant), "losses", "Loss curves of both configurations")
    rows = [
        [f"{name}, {stage}", f"{part.step[-1]:,.0f}", *_ends(part.train), *_ends(part.test)]
        for name, curve in curves.items()
        for stage in dict.fromkeys(curve.stages)
        for part in [curve.of(stage)]
    ]
    heading = ["run, stage", "steps", "train, first", "train, last", "test, first", "test, last"]
    return Section(
        "Loss curves",
        "It shows the loss over 0.1·10⁶ iterations of plain back propagation at rate 0.14, for "
        "the training and for the test part of its data.",
        "Mean training loss since the point before, and loss of 512 drives that training never "
        f"sees.\n\n{table(heading, rows)}\n\n{picture}",
        "The loss of *paper* is half the squared error of the sigmoids (reconstruction). An "
        f"answer that is always the same has {constant:.3g} on its test drives. Min-max images "
        "hide the scale, and turned ones keep a label that is not theirs. The loss of *improved* "
        "is the mean absolute error of the residual; [its stages train different "
        "things](network.md#the-training-recipe). Levels compare within a panel.",
    )


def constant_loss(configuration: Configuration) -> float:
    """Test loss of the best constant answer, for the sigmoid's loss.

    Parameters
    ----------
    configuration : Configuration
        With drives in the paper's halves.
    """
    held_out = Batches(configuration, paper_motion(), held_out=True)
    target = 1.0 / (1.0 + np.exp(-held_out.batch("test", 0, TEST_EXAMPLES).residual))
    return float(0.5 * np.sum(np.var(target, axis=0)))


def draw(curves: dict[str, Curve], constant: float) -> Figure:
    """A panel for each run; stages one after the other along its axis.

    Parameters
    ----------
    curves : mapping of configuration to Curve
    constant : float
        Loss of a constant answer to the paper's test drives.
    """
    figure = Figure(figsize=(11, 4), layout="constrained")
    for panel, (name, curve) in zip(figure.subplots(1, len(curves)), curves.items(), strict=True):
        start = 0.0
        stages = list(dict.fromkeys(curve.stages))
        for number, stage in enumerate(stages):
            part = curve.of(stage)
            _draw_stage(panel, part, start, labelled=number == 0)
            if len(stages) > 1:
                panel.axvspan(start, start + part.step[-1], alpha=0.06 * (number % 2), color="k")
                middle = start + 0.5 * part.step[-1]
                panel.text(middle, 0.97, stage, transform=panel.get_xaxis_transform(),
                           ha="center", va="top")  # fmt: skip
            start += part.step[-1]
        if name == PAPER.name:
            panel.axhline(constant, color="k", linestyle=":", label="constant answer")
        panel.set_title(f"configuration {name}")
        panel.set_xlabel("gradient steps")
        panel.set_ylabel("loss")
        panel.set_xlim(0, start)
        panel.set_ylim(bottom=0.0)
        panel.legend(loc="lower left")
        panel.grid(alpha=0.3)
    return figure


def _draw_stage(panel: Any, part: Curve, start: float, *, labelled: bool) -> None:
    for values, label, colour, style in (
        (part.train, "train", "tab:blue", "-"),
        (part.test, "test", "tab:orange", "--"),
    ):
        name = label if labelled else None
        panel.plot(start + part.step, values, style, color=colour, label=name, linewidth=1.3)


def _ends(values: Array) -> list[str]:
    return [f"{values[0]:.3g}", f"{values[-1]:.3g}"]

"""This project beside what a user would take instead, on a real ball screw.

EMPS is cut in half. Every contestant is fitted to one half and scored on the other, both ways: from
the position, the filtered velocity and acceleration and the direction it predicts the force. Band,
samples and score are the same for all; each has its own offset, which is not fitted again.

    python -m tools.arena                       all that are installed
    python -m tools.arena --only base,pysindy   some of them, by parts of their names
    python -m tools.arena --repeats 1           processor time of one fit, not the median of three

The other packages stand in tools/arena/requirements.lock, and belong into an environment of their
own, which runs this project as well:

    python3.11 -m venv ENVIRONMENT
    ENVIRONMENT/bin/pip install -r tools/arena/requirements.lock
    ENVIRONMENT/bin/python -m tools.arena
"""

import os

# one thread for each process; before numpy is loaded
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import contextlib
import io
import sys
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median
from typing import Final

from rich.console import Console
from rich.table import Table

from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording
from tools.arena.others import jax_sysid_network, mujoco_sysid, pysindy_inverse, sysidentpy_nfir
from tools.arena.ours import base_model, by_direction, curves, diagnosed
from tools.arena.signals import Fit, Half, both_ways

_FILE: Final = "emps_train.csv"
_LOCK: Final = "tools/arena/requirements.lock"


@dataclass(frozen=True)
class Contestant:
    """What fits a model to a half.

    Attributes
    ----------
    name : str
    fit : callable
    package : str
        That it needs; none for what this project and numpy do.
    """

    name: str
    fit: Fit
    package: str = ""

    @property
    def installed(self) -> str | None:
        """Version of its package; None where it is missing."""
        try:
            return version(self.package) if self.package else ""
        except PackageNotFoundError:
            return None


CONTESTANTS: Final = (
    Contestant("edge-ident, diagnosis", diagnosed),
    Contestant("edge-ident, curves of the error budget alone", curves),
    Contestant("friction by direction, by hand", by_direction),
    Contestant("base model, least squares", base_model),
    Contestant("sysidentpy, NFIR of degree 2", sysidentpy_nfir(2), "sysidentpy"),
    Contestant("sysidentpy, NFIR of degree 3", sysidentpy_nfir(3), "sysidentpy"),
    Contestant("pysindy, polynomial", pysindy_inverse, "pysindy"),
    Contestant("jax-sysid, network", jax_sysid_network, "jax-sysid"),
    Contestant("mujoco.sysid, slide", mujoco_sysid, "mujoco"),
)


@dataclass(frozen=True)
class Result:
    """How a contestant did.

    Attributes
    ----------
    contestant : Contestant
    left : sequence of float
        Relative residual on the half that was not fitted, both ways.
    processor_s : float
        Of fitting a half: median of the repeats, mean of both ways.
    """

    contestant: Contestant
    left: Sequence[float]
    processor_s: float


def main() -> int:
    """Run the contestants that are installed; 0."""
    given = _arguments()
    console = Console(width=120, highlight=False)
    wanted = [c for c in CONTESTANTS if any(part in c.name for part in given.only)]
    recording = load_recording(given.folder / _FILE)
    table = _table()
    for contestant in wanted:
        if contestant.installed is not None:
            print(contestant.name, file=sys.stderr)
            result = compete(contestant, recording, given.repeats)
            table.add_row(*_cells(result))
    console.print(table)
    if missing := dict.fromkeys(c.package for c in wanted if c.installed is None):
        console.print(f"not installed: {', '.join(missing)}; pip install -r {_LOCK} has them all")
    return 0


def compete(contestant: Contestant, recording: Recording, repeats: int) -> Result:
    """Fit a contestant to each half, and score it on the other.

    Parameters
    ----------
    contestant : Contestant
    recording : Recording
        Its first axis counts.
    repeats : int
        Fits of each half.
    """
    axis, *_ = recording.axes
    left, times = [], []
    for fitted, other in both_ways(recording, axis):
        share, spent_s = _scored(contestant.fit, fitted, other, repeats)
        left.append(share)
        times.append(spent_s)
    return Result(contestant, left, sum(times) / len(times))


def _scored(fit: Fit, fitted: Half, other: Half, repeats: int) -> tuple[float, float]:
    """Relative residual on the other half, and processor time of a fit."""
    times = []
    # packages warn and print while they fit
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        for _ in range(repeats):
            begin_s = time.process_time()
            model = fit(fitted)
            times.append(time.process_time() - begin_s)
        return other.left(model(other)), median(times)


def _table() -> Table:
    table = Table(title=f"{_FILE}: what a model leaves of the other half", title_justify="left")
    table.add_column("")
    for column in ("version", "1 to 2", "2 to 1", "mean", "processor time, s"):
        table.add_column(column, justify="right")
    return table


def _cells(result: Result) -> tuple[str, ...]:
    contestant, left = result.contestant, result.left
    shares = (f"{share:.2%}" for share in (*left, sum(left) / len(left)))
    return contestant.name, contestant.installed or "", *shares, f"{result.processor_s:.2g}"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "folder", nargs="?", type=Path, default=os.environ.get("EDGE_IDENT_DATA"), help="recordings"
    )
    parser.add_argument("--only", type=lambda text: text.split(","), metavar="A,B", default=("",))
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    if not given.folder:
        parser.error(f"name the folder that holds {_FILE}, or set EDGE_IDENT_DATA")
    return given


if __name__ == "__main__":
    sys.exit(main())

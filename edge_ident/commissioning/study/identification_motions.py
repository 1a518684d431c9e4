"""The motions that a run identifies from: captured, saved, and identified."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Final, TypeVar

import numpy as np

from edge_ident.commissioning.motion.capture import Capture, Enough, capture_motion
from edge_ident.commissioning.motion.homing import move_to
from edge_ident.commissioning.motion.observer import Observer
from edge_ident.commissioning.study.computing import Budget, Progress, computed
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.drive.description import Drive
from edge_ident.errors import DataError
from edge_ident.estimation.network import Network
from edge_ident.experiment.result import MotionPlan
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.model.model import Model, regressor
from edge_ident.signals.data_checks import check_recording
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.support.memory import give_back
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board import Board
from firmware_interface.motion import Staircase, Trajectory, reference

log = logging.getLogger(__name__)

_T = TypeVar("_T")

CAPTURE_FILE: Final = "capture.npz"
_REHEARSED_NOISE: Final = 0.02
"""Noise over the rms effort: with it, bandwidths are about those of a drive."""


def capture_file(number: int) -> str:
    """Name of the file of an identification motion; the first is number 1."""
    return CAPTURE_FILE if number == 1 else CAPTURE_FILE.replace(".", f"_{number}.")


@dataclass(frozen=True)
class Study:
    """What is identified, with what, and how far it may go.

    Attributes
    ----------
    board : Board
        At rest, enabled, within `edge_ident.commissioning.motion.safety.left_safe`.
    drive : Drive
    folder : Path
        For the captures.
    observer : Observer
    watch : Stopwatch
    network : Network or None
    model : Model or None
        Effects that are known of the drive.
    seed : int
    diagnose : bool
        Whether an axis whose base model is not enough is diagnosed.
    most_motions : int
        Identification motions in all.
    most_s : float
        Their duration in all, as designed, lead-ins included.
    budget : Budget
        Computing time of the diagnosis.
    """

    board: Board
    drive: Drive
    folder: Path
    observer: Observer
    watch: Stopwatch
    network: Network | None = None
    model: Model | None = None
    seed: int = 0
    diagnose: bool = True
    most_motions: int = 1
    most_s: float = inf
    budget: Budget = field(default_factory=Budget)

    def computed(self, work: Callable[[Progress], _T]) -> _T:
        """Diagnose, or design a motion, within the budget; see `computing`."""
        with self.watch.stage("diagnosis"):
            return computed(work, self.budget, progress_on(self))

    def tell(self, line: str) -> None:
        """Say something to the person at the machine, and to the log."""
        self.observer.say(line)
        log.info(line)

    def unload_network(self) -> None:
        """Give the network's memory to what follows: it is hardly ever asked again, but can be."""
        if self.network is not None:
            self.network.unload()
        give_back()


@dataclass(frozen=True)
class IdentificationMotion:
    """A motion, and what is known of the machine once it is recorded.

    Attributes
    ----------
    file : str
        Name of its capture in the folder of the run.
    trajectory : Trajectory
    capture : Capture
    found : Identification
        From this motion and those before it.
    plan : MotionPlan or None
        What it was designed for; None for the first, and for one of the drive's own.
    ruled_out : mapping of axis name to tuple of str
        Effects that were possible causes before it, and are not any more.
    sought : mapping of axis name to tuple of str
        What motions before could not show, where it is one of the drive's own.
    """

    file: str
    trajectory: Trajectory
    capture: Capture
    found: Identification
    plan: MotionPlan | None = None
    ruled_out: Mapping[str, tuple[str, ...]] | None = None
    sought: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def recording(self) -> Recording:
        """The recording, under the name of its file."""
        return replace(self.capture.recording, source=self.file)

    @property
    def duration_s(self) -> float:
        """Duration, lead-in included."""
        return duration_s(self.trajectory)


def duration_s(trajectory: Trajectory) -> float:
    """How long a motion takes, lead-in included."""
    return trajectory.lead_in_s + trajectory.duration_s


def captured(
    study: Study,
    trajectory: Trajectory,
    number: int,
    after: Capture | None = None,
    enough: Enough | None = None,
) -> Capture:
    """An identification motion, saved as soon as its last sample arrives.

    A staircase begins where the axes stand. One that was designed counts from zero. Its time goes
    on from the motion `after` which it comes. It ends where what is captured is `enough`.
    """
    if number > 1 and any(isinstance(of, Staircase) for of in trajectory.axes.values()):
        move_to(study.board, dict.fromkeys(study.board.axes, 0.0), study.observer)
    study.observer.stage("identification motion" + (f" {number}" if number > 1 else ""))
    file = study.folder / capture_file(number)
    with study.watch.stage("motion"):
        return capture_motion(
            study.board, trajectory, study.observer.samples, file, study.observer.say, after,
            enough,
        )  # fmt: skip


def rehearse(study: Study, trajectory: Trajectory) -> None:
    """Identify a recording as long as the one to come, before the motion.

    The first identification of a process takes a fifth longer than the next: the processor has
    not met its code, memory is asked for, and what depends on the length alone is computed. The
    position is the reference, rounded to counts, and every parameter of the effort is one. What is
    found counts for nothing.

    Raises
    ------
    ModelError
        The model of the drive does not fit its board.
    """
    period_s = study.board.identity.sample_period_s
    count = 2.0 * np.pi / study.board.identity.counts_per_turn
    time_s = period_s * np.arange(round(trajectory.duration_s / period_s), dtype=np.float64)
    axes, rng = {}, np.random.default_rng(0)
    for name, motion in trajectory.axes.items():
        along = reference(motion, time_s, trajectory.lead_in_s, 0.0)
        effort = regressor(along.velocity_rad_s, along.acceleration_rad_s2).sum(axis=1)
        effort += _REHEARSED_NOISE * np.std(effort) * rng.standard_normal(len(effort))
        axes[name] = AxisRecord(count * np.round(along.position_rad / count), effort, "rad", "N*m")
    try:
        made_up = Recording(time_s, axes, "rehearsal")
        identify(made_up, study.network, model=study.model, diagnose=False)
    except DataError as error:  # too short, or at rest: the recording itself will tell
        log.info("rehearsal: %s", error.cause)


def identified(study: Study, recording: Recording) -> Identification:
    """Identify what was captured, by the base model and effects that are known."""
    study.observer.stage("identification")
    check_recording(recording)
    return identify(recording, study.network, model=study.model, seed=study.seed, diagnose=False)


def with_diagnoses(
    study: Study, recording: Recording, diagnosed: Mapping[str, AxisDiagnosis]
) -> Identification:
    """Identify what was captured with what a diagnosis found, and say that."""
    found = identify(
        recording,
        study.network,
        model=study.model,
        seed=study.seed,
        diagnose=False,
        diagnosed=diagnosed,
    )
    for name, axis in found.axes.items():
        if axis.diagnosis is not None:
            study.tell(f"axis {name}: {axis.diagnosis_sentence}")
    return found


def progress_on(study: Study) -> Progress:
    """A function that shows progress."""
    shown = ""

    def show(stage: str, done: int, total: int) -> None:
        nonlocal shown
        if stage != shown:
            shown = stage
            study.observer.stage(stage)
        study.observer.samples(done, total)

    return show

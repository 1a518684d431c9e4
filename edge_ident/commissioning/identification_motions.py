"""The motions that a run identifies from: captured, saved, and identified."""

import logging
import math
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Final, TypeVar

import numpy as np

from edge_ident.commissioning.capture import Capture, Enough, Observer, capture_motion
from edge_ident.commissioning.homing import move_to
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import MotionName
from edge_ident.errors import DataError, EdgeIdentError
from edge_ident.estimation.network import Network
from edge_ident.experiment.result import MotionPlan
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.model.model import NORMAL_95, PARAMETERS, Model, regressor
from edge_ident.signals.data_checks import check_recording
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.support.stopwatch import Stopwatch, give_back
from firmware_interface.board import Board
from firmware_interface.motion import Multisine, Staircase, Trajectory, reference

_T = TypeVar("_T")
log = logging.getLogger(__name__)


# Long computations beside a board: Ctrl-C works at any time, and they end when time is up.
#
# The work runs in a thread of its own. A computation that is out of time or interrupted ends where
# it next tells its progress.

Progress = Callable[[str, int, int], None]

_LOOK_S: Final = 0.1  # between two looks at the time


class OutOfTimeError(EdgeIdentError):
    """A computation took longer than the user allowed."""


class _EndedError(Exception):
    """Nobody waits for this computation any more."""


@dataclass
class Budget:
    """Computing time that is left, s."""

    left_s: float = math.inf
    whole_s: float = math.inf

    def __post_init__(self) -> None:
        self.whole_s = self.left_s


def computed(work: Callable[[Progress], _T], budget: Budget, on_progress: Progress) -> _T:
    """Compute within a budget.

    Parameters
    ----------
    work : callable
        Gets what it is to tell its progress.
    budget : Budget
        From which the time is taken.
    on_progress : callable

    Raises
    ------
    OutOfTimeError
    """
    ended, began_s = threading.Event(), time.monotonic()
    found: list[_T] = []
    failed: list[BaseException] = []

    def told(stage: str, done: int, total: int) -> None:
        if ended.is_set():
            raise _EndedError
        on_progress(stage, done, total)

    def run() -> None:
        try:
            found.append(work(told))
        except BaseException as error:  # raised again where it is asked for
            failed.append(error)

    thread = threading.Thread(target=run, daemon=True)  # a stop does not wait for it
    thread.start()
    try:
        while thread.is_alive():
            thread.join(_LOOK_S)
            if thread.is_alive() and time.monotonic() - began_s > budget.left_s:
                raise OutOfTimeError(
                    f"the diagnosis was not done within {budget.whole_s:g} s",
                    "allow more time with --diagnose-within, or diagnose the captures of the run "
                    "with edge-ident diagnose",
                )
    finally:
        ended.set()
        budget.left_s -= time.monotonic() - began_s
    if failed:
        raise failed[0]
    return found[0]


CAPTURE_FILE: Final = "capture.npz"
# Noise over the rms effort: with it, bandwidths are about those of a drive.
_REHEARSED_NOISE: Final = 0.02


def capture_file(number: int) -> str:
    """Name of the file of an identification motion; the first is number 1."""
    return CAPTURE_FILE if number == 1 else CAPTURE_FILE.replace(".", f"_{number}.")


@dataclass(frozen=True)
class Plan:
    """What the user wants.

    Attributes
    ----------
    motion : {"sinusoid", "multisine", "staircase"}
    cycles : int or None
        Periods of the identification motion; None takes the drive description's.
    bandwidth_rad_s : float or None
        Of the closed loop's poles; None takes the highest that keeps the margins.
    write : bool
        False for a dry run: everything up to the forecast on the motion of the identification.
    store : bool
        Keep confirmed gains over a power cycle.
    seed : int
    model : Model or None
        Effects that are known of the drive.
    diagnose : bool
        Whether an axis whose base model is not enough is diagnosed.
    diagnose_first : bool
        Before any gains are written, and not after.
    diagnose_within_s : float
        Computing time of the diagnosis, of all axes together.
    most_motions : int
        Identification motions in all: where a diagnosis leaves several explanations, others are
        designed that separate them.
    most_s : float
        Duration of these motions in all, lead-ins included.
    until : float or None
        Relative half-width of all intervals at which the first motion ends (`early_answer`).
    """

    motion: MotionName = "sinusoid"
    cycles: int | None = None
    bandwidth_rad_s: float | None = None
    write: bool = True
    store: bool = False
    seed: int = 0
    model: Model | None = None
    diagnose: bool = True
    diagnose_first: bool = False
    diagnose_within_s: float = 60.0
    most_motions: int = 3
    most_s: float = math.inf
    until: float | None = None


@dataclass(frozen=True)
class Study:
    """What is identified, with what, and how far it may go.

    Attributes
    ----------
    plan : Plan
    board : Board
        At rest, enabled, within `edge_ident.commissioning.safety.left_safe`.
    drive : Drive
    network : Network or None
    folder : Path
        For the captures.
    observer : Observer
    watch : Stopwatch
    """

    plan: Plan
    board: Board
    drive: Drive
    network: Network | None
    folder: Path
    observer: Observer
    watch: Stopwatch = field(default_factory=Stopwatch)

    @cached_property
    def budget(self) -> Budget:
        """Computing time of the diagnosis."""
        return Budget(self.plan.diagnose_within_s)

    def identify(
        self, recording: Recording, diagnosed: Mapping[str, AxisDiagnosis] | None = None
    ) -> Identification:
        """By the base model, effects that are known, and what a diagnosis found."""
        plan = self.plan
        return identify(
            recording, self.network, model=plan.model, seed=plan.seed, diagnose=False,
            diagnosed=diagnosed,
        )  # fmt: skip

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
        study.identify(made_up)
    except DataError as error:  # too short, or at rest: the recording itself will tell
        log.info("rehearsal: %s", error.cause)


def identified(study: Study, recording: Recording) -> Identification:
    """Identify what was captured, by the base model and effects that are known."""
    study.observer.stage("identification")
    check_recording(recording)
    return study.identify(recording)


def with_diagnoses(
    study: Study, recording: Recording, diagnosed: Mapping[str, AxisDiagnosis]
) -> Identification:
    """Identify what was captured with what a diagnosis found, and say that."""
    found = study.identify(recording, diagnosed)
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


# Ends the identification motion as soon as its parameters are known well enough.
#
# Every twentieth of a period, what is captured so far is identified as it will be in the end. The
# motion ends where, twice in a row, the base model is adequate, every axis is trusted, and every
# interval is narrow enough. Each is a 95 % interval that holds model error. Half of its width is
# compared with the value of the parameter; that of the offset with the Coulomb friction, for the
# offset of a level axis is nothing.
#
# No look comes before half a period, nor before every axis has gone both ways at half of the
# highest speed that the motion asks for in that direction: friction at speeds that were not seen
# would be extrapolated.

_LOOKS_PER_PERIOD: Final = 20
_IN_A_ROW: Final = 2
_LEAST_PERIODS: Final = 0.5
_SPEED_SHARE: Final = 0.5  # share of the highest speed in each direction that must have been seen
# Share of the motion's time that looks may take: the link must keep up with the pages.
_TIME_SHARE: Final = 0.25
_COULOMB, _OFFSET = PARAMETERS.index("coulomb_friction"), PARAMETERS.index("offset")


@dataclass(frozen=True)
class Widest:
    """The widest interval of all axes.

    Attributes
    ----------
    axis, parameter : str
    half_width : float
        Of the 95 % interval, over the parameter's value; of the offset, over the Coulomb friction.
    """

    axis: str
    parameter: str
    half_width: float

    @classmethod
    def of(cls, found: Identification) -> "Widest":
        """The widest of what was identified."""
        widths = []
        for name, axis in found.axes.items():
            values = np.abs(axis.estimate.parameters)
            values[_OFFSET] = values[_COULOMB]
            with np.errstate(divide="ignore"):
                halves = NORMAL_95 * axis.estimate.std / values
            widths += [
                cls(name, *pair) for pair in zip(PARAMETERS, map(float, halves), strict=True)
            ]
        return max(widths, key=lambda one: one.half_width)

    def __str__(self) -> str:
        return f"{self.parameter.replace('_', ' ')} of axis {self.axis}, ±{self.half_width:.1%}"


@dataclass(frozen=True)
class EarlyAnswer:
    """Whether the parameters were known well enough before the motion was over.

    Attributes
    ----------
    asked : float
        Largest half-width of an interval, as in `Widest`.
    reached : bool
        The motion ended early.
    share : float
        Of the motion that was captured.
    widest : Widest
        Of what was identified from that part.
    sentence : str
    """

    asked: float
    reached: bool
    share: float
    widest: Widest
    sentence: str


class Looks:
    """Looks at a motion while it lasts.

    Parameters
    ----------
    study : Study
    trajectory : Trajectory
    asked : float
        Largest half-width of an interval, as in `Widest`.
    """

    def __init__(self, study: Study, trajectory: Trajectory, asked: float) -> None:
        self._study, self._asked = study, asked
        sampling_s = study.board.identity.sample_period_s
        self._whole = round(trajectory.duration_s / sampling_s)
        self._every = max(round(period_s(trajectory) / sampling_s / _LOOKS_PER_PERIOD), 1)
        self._next = earliest_s(trajectory, sampling_s) / sampling_s
        self._good = 0
        self._found: Identification | None = None

    def enough(self, samples: int, in_hand: Callable[[], Recording]) -> bool:
        """Look, where it is time; see `edge_ident.commissioning.capture.Enough`.

        There is no look where the motion is over before the next: nothing would be gained.
        """
        if samples < self._next or samples + self._every > self._whole:
            return False
        began_s = time.thread_time()
        self._good = self._good + 1 if self._ok(in_hand()) else 0
        took_s = time.thread_time() - began_s
        pause = took_s / _TIME_SHARE / self._study.board.identity.sample_period_s
        self._next = samples + max(self._every, pause)
        return self._good >= _IN_A_ROW

    def identified(self, capture: Capture) -> Identification:
        """What the last look found, where the motion ended with it; else what the capture shows."""
        if capture.ended_early and self._found is not None:
            return self._found
        return identified(self._study, capture.recording)

    def answer(self, capture: Capture, found: Identification) -> EarlyAnswer:
        """What became of it; the person at the machine is told.

        Parameters
        ----------
        capture : Capture
            Of the motion.
        found : Identification
            From it.
        """
        share, widest = len(capture.recording.time_s) / self._whole, Widest.of(found)
        reached = capture.ended_early
        if reached:
            sentence = (
                f"{share:.0%} of the motion was enough to know every parameter to {self._bound}"
            )
        else:
            sentence = f"the whole motion was needed: {self._why_not(found, widest)}"
        sentence = f"{sentence}; widest interval: {widest}"
        self._study.tell(sentence)
        return EarlyAnswer(self._asked, reached, share, widest, sentence)

    @property
    def _bound(self) -> str:
        return f"{100.0 * self._asked:g}%"

    def _why_not(self, found: Identification, widest: Widest) -> str:
        inadequate = [name for name, axis in found.axes.items() if not axis.adequacy.adequate]
        if inadequate:
            return f"the base model is not enough for axis {', '.join(inadequate)}"
        if not found.trusted:
            return "not every axis is trusted"
        if widest.half_width > self._asked:
            return f"not every parameter is known to {self._bound}"
        return f"every parameter is known to {self._bound}, but not until its end"

    def _ok(self, recording: Recording) -> bool:
        try:
            check_recording(recording)
            found = self._study.identify(recording)
        except DataError as error:
            log.info("look at %d samples: %s", len(recording.time_s), error.cause)
            return False
        self._found, widest = found, Widest.of(found)
        log.info("look at %d samples: %s", len(recording.time_s), widest)
        adequate = all(axis.adequacy.adequate for axis in found.axes.values())
        return adequate and found.trusted and widest.half_width <= self._asked


def period_s(trajectory: Trajectory) -> float:
    """Period of the slowest sine; the duration of a motion that does not repeat."""
    rates = [
        sine.angular_frequency_rad_s
        for motion in trajectory.axes.values()
        if isinstance(motion, Multisine)
        for sine in motion.components
    ]
    return 2.0 * math.pi / min(rates) if rates else trajectory.duration_s


def earliest_s(trajectory: Trajectory, sampling_s: float) -> float:
    """When the captured part has seen enough speeds for a first look; inf where it never does."""
    times_s = np.arange(0.0, min(period_s(trajectory), trajectory.duration_s), sampling_s)
    earliest = _LEAST_PERIODS * period_s(trajectory)
    for motion in trajectory.axes.values():
        velocity = reference(motion, times_s, trajectory.lead_in_s, 0.0).velocity_rad_s
        for way in (velocity, -velocity):
            if np.max(way) <= 0.0:
                return math.inf
            earliest = max(earliest, float(times_s[np.argmax(way >= _SPEED_SHARE * np.max(way))]))
    return earliest

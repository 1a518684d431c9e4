"""New gains on trial: what they promise, and what two motions say of that.

The order is: forecast on the motion that was made with the gains in force; the second motion with
them, unless it was made; forecast on that one too; write; both motions with the new gains; verdict.
So everything that judges the new gains is in hand, or promised, before they are written. What the
motions with the new gains measured decides, not what was promised.
"""

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Self

import numpy as np

from edge_ident.commissioning.capture import Capture, Observer, capture_motion
from edge_ident.commissioning.drawn_loads import Grounds, RecordedMotion, beginning
from edge_ident.commissioning.further_motions import (
    NamedMotion,
    inside_window,
    second_motion,
    within_limits,
)
from edge_ident.commissioning.gain_transfer import confirm_window_s, write_gains
from edge_ident.commissioning.promise import Errors, Promise, promised
from edge_ident.commissioning.tracking_forecast import of_motor
from edge_ident.commissioning.verification import (
    GainChange,
    Verification,
    compare_motions,
    verification_motion,
)
from edge_ident.control.compensation import plant_of
from edge_ident.control.gain_design import QUANTIZATION_SHARE
from edge_ident.control.position_loop import LoopHardware, law_response, open_loop
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import MotionName, named_trajectory
from edge_ident.identification.result import Identification
from edge_ident.model.model import AxisModel
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board import Board
from firmware_interface.board_gains import RunningCommit
from firmware_interface.gains import AxisGains, Bank

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Recorded:
    """A motion that was made with the gains in force.

    Attributes
    ----------
    motion : NamedMotion
    capture : Capture
    file : str
        Name of its file in the folder of the run; empty where it was not saved.
    """

    motion: NamedMotion
    capture: Capture
    file: str

    @property
    def recording(self) -> Recording:
        """What was recorded of it."""
        return self.capture.recording


@dataclass(frozen=True)
class MotionBefore:
    """A motion with the gains in force, and what is known from it; new gains must measure up to it.

    Attributes
    ----------
    capture : Capture
        Whole cycles of it, or less than one.
    first : NamedMotion
        One cycle of it, or as much as was captured, with which new gains are verified.
    second : NamedMotion
        The motion beside it.
    grounds : Grounds
        From which the new gains follow.
    recorded : Recorded or None
        The second motion, where it was made already.
    """

    capture: Capture
    first: NamedMotion
    second: NamedMotion
    grounds: Grounds
    recorded: Recorded | None = None

    @classmethod
    def of(
        cls,
        drive: Drive,
        name: MotionName,
        capture: Capture,
        found: Identification,
    ) -> Self:
        """A named motion of a drive, and what was identified from it.

        Where it ended early, new gains are verified on as much of the cycle as was captured.
        """
        cycle, recording = named_trajectory(drive, name, 1), capture.recording
        samples, sampling_s = len(recording.time_s), drive.sampling_period_s
        whole = int((samples + 1) * sampling_s / cycle.duration_s)
        if whole:
            samples = min(round(whole * cycle.duration_s / sampling_s), samples)
            capture = replace(capture, recording=beginning(recording, samples))
        else:
            cycle = replace(cycle, duration_s=samples * sampling_s)
        first, second = NamedMotion(name, cycle), second_motion(drive, name)
        return cls(capture, first, second, Grounds.of(found))


class Trial:
    """One trial of new gains, step by step.

    The second motion with the old gains may be left to come to rest by itself, so that the write
    need not wait for it: `edge_ident.commissioning.gain_change.concluded` settles that.

    Parameters
    ----------
    board : Board
        At rest, enabled.
    wanted : mapping of axis name to AxisGains
    before : MotionBefore
    observer : Observer
    file : Path or None
        For the recording of the first verification motion.
    watch : Stopwatch
    disbelief : float
        Logarithm by which forecasts for this machine were off before.

    Attributes
    ----------
    active, wanted : mapping of axis name to AxisGains
        In force before, and on trial.
    promise : Promise
        Of the motions that were done with the old gains so far.
    second : Recorded or None
        The second motion with the old gains, once it was made.
    after : dict of motion to Recorded
        Motions with the new gains.
    """

    def __init__(
        self,
        board: Board,
        wanted: Bank,
        before: MotionBefore,
        observer: Observer,
        file: Path | None,
        watch: Stopwatch,
        disbelief: float = 0.0,
    ) -> None:
        self._disbelief = disbelief
        self._board, self.wanted, self._before = board, wanted, before
        self._observer, self._file, self._watch = observer, file, watch
        self.active, self._limits = board.active_gains(), board.limits()
        self._hardware = LoopHardware.of_axes(board.identity, self._limits)
        self._motions = [before.first]
        self._recorded: dict[str, Recording] = {before.first.name: before.capture.recording}
        self.promise = Promise({})
        self.second = before.recorded
        self.after: dict[str, Recorded] = {}
        self._running: RunningCommit | None = None
        self._forecast(before.first)

    def forecast_all(self) -> Promise:
        """The promise on all motions that were made with the gains in force."""
        if self.second is not None and self.second.motion.name not in self.promise.motions:
            self._motions.append(self.second.motion)
            self._recorded[self.second.motion.name] = self.second.capture.recording
            self._forecast(self.second.motion)
        return self.promise

    def worth_a_write(self) -> bool:
        """Whether the forecast is worth a write, on the second motion too.

        Raises
        ------
        BoardError
            The board's window to confirm is too short for both motions.
        """
        if not self.promise.worth_a_write:
            return False
        self.move_second()
        return self.forecast_all().worth_a_write

    def write(self) -> None:
        """Put the new gains in force, unconfirmed."""
        with self._watch.stage("last_sample_to_verified"):
            self._running = write_gains(self._board, self.wanted, self._observer.say)
        self._board.settle()

    def verify(self) -> GainChange:
        """Move with the new gains and judge; a motion that goes wrong is the last.

        Raises
        ------
        BoardError
            A motion did not get to its end.
        """
        found: dict[str, Verification] = {}
        errors: dict[str, dict[str, Errors]] = {}
        tracking: dict[str, float] = {}
        for motion in self._motions:
            capture, file = self._verified(motion)
            self.after[motion.name] = Recorded(motion, capture, file)
            tracking = tracking or capture.tracking_rms_rad
            trajectory = motion.trajectory
            before = of_motor(self._recorded[motion.name], self.active, trajectory)
            after = of_motor(capture.recording, self.wanted, trajectory)
            found[motion.name] = self._compared(before, after)
            moved = RecordedMotion.along(after, trajectory)
            errors[motion.name] = {axis: Errors.of(moved.errors(axis)) for axis in moved.references}
            self.promise = self.promise.measured(errors)
            if not found[motion.name].keeps:
                break
        first, *others = found.items()
        return GainChange(
            confirmed=all(of.keeps for of in found.values()),
            verification=first[1],
            tracking_after_rad=tracking,
            others=dict(others),
            promise=self.promise,
            diagnosed=self._before.grounds.diagnosed,
            running=self._running,
        )

    def _compared(self, before: Recording, after: Recording) -> Verification:
        """A motion with the old gains and with the new ones, of which none may be too lively."""
        found = compare_motions(before, after, self._board.identity.encoder_resolution_rad)
        model = self._before.grounds.model
        lively = {
            axis: liveliness(record, self.wanted[axis], model.axes[axis], self._hardware[axis])
            for axis, record in after.axes.items()
        }
        return found.with_liveliness(lively)

    def _forecast(self, motion: NamedMotion) -> None:
        """Add what is promised on a motion that was done with the old gains."""
        with self._watch.stage("last_sample_to_verified"), self._watch.stage("forecast"):
            moved = RecordedMotion.along(self._recorded[motion.name], motion.trajectory)
            led = of_motor(moved.recording, self.active, motion.trajectory)
            moved = replace(moved, recording=led)
            banks = self.active, self.wanted
            axes = promised(moved, self._before.grounds, self._hardware, *banks, self._disbelief)
            self.promise = self.promise.with_motion(motion.name, axes)
        for axis, of_axis in axes.items():
            log.info("axis %s on the %s: %s", axis, motion.name, of_axis)

    def move_second(self) -> Recorded:
        """The second motion with the old gains, made where it was not made yet."""
        if self.second is None:
            self.second = self._moved_second()
        return self.second

    def _moved_second(self) -> Recorded:
        before, board = self._before, self._board
        model, limits = before.grounds.model, self._limits
        fitting = within_limits(before.second, model, self.active, limits)
        second = inside_window(before.first, fitting, confirm_window_s(board))
        self._observer.stage("second motion, old gains")
        file = self._beside("capture", second)
        with self._watch.stage("second_motion"):
            capture = capture_motion(
                board, second.trajectory, self._observer.samples, file, self._observer.say,
                self._before.capture,
            )  # fmt: skip
            board.leave_to_rest()
        return Recorded(second, capture, "" if file is None else file.name)

    def _verified(self, motion: NamedMotion) -> tuple[Capture, str]:
        """A motion with the new gains, and the name of its file."""
        first = motion is self._motions[0]
        self._observer.stage("verification motion" if first else "second verification motion")
        file = self._file if first else self._beside("verification", motion)
        with self._watch.stage("verification"):
            capture = verification_motion(self._board, motion, self._observer, file)
        return capture, "" if file is None else file.name

    def _beside(self, kind: str, motion: NamedMotion) -> Path | None:
        """Where a recording of the second motion goes."""
        if self._file is None:
            return None
        stem = self._file.stem if kind == "verification" else kind
        return self._file.with_name(f"{stem}_{motion.name}.npz")


# Whether a loop is livelier than noise explains: the first sign of one that will oscillate.
#
# A loop that is well damped answers, above its bandwidth, the rounding of its encoder and little
# else. The power of that follows from the law and the axis. One that is too stiff for what it moves
# (a soft chain, play) has more. It is asked of the feedback's effort and of the speed, above the
# frequency at which the opened loop has fallen to one. A motion is taken in stretches, and their
# median counts: a reversal, which is no noise, lasts for a few.
#
# Source: Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Trans.
# Audio and Electroacoustics 15 (1967).

_STRETCH: Final = 256  # samples of a stretch; neighbours overlap by half
# Amplitude over that of the noise from which it is no noise: a sensitivity of up to 2 is sound.
_BEYOND_NOISE: Final = 3.0
# Amplitude in encoder counts, rms, that is no oscillation worth the name.
_LIVELY_COUNTS: Final = 2.0


def liveliness(
    record: AxisRecord, gains: AxisGains, axis: AxisModel, hardware: LoopHardware
) -> float:
    """What an axis answers above its bandwidth, over the most that is harmless; above one, the loop
    is too lively.

    Parameters
    ----------
    record : AxisRecord
        Of a motion with these gains.
    gains : AxisGains
    axis : AxisModel
    hardware : LoopHardware
    """
    assert record.reference is not None
    error = record.reference - record.position
    if len(error) < 2 * _STRETCH:
        return 0.0
    window = np.hanning(_STRETCH)
    starts = range(0, len(error) - _STRETCH + 1, _STRETCH // 2)
    stretches = np.stack([window * error[at : at + _STRETCH] for at in starts])
    power = np.abs(np.fft.rfft(stretches)) ** 2 / (np.sum(window**2) * _STRETCH) * 2.0
    omega = np.asarray(
        2.0 * np.pi * np.fft.rfftfreq(_STRETCH, hardware.sample_period_s), dtype=np.float64
    )
    above = omega > _crossover(gains, axis, hardware)
    if not np.any(above):
        return 0.0
    law = np.abs(law_response(gains, omega[above], hardware.sample_period_s)) ** 2
    # position and reference are both rounded, to one twelfth of a count squared
    noise = hardware.encoder_resolution_rad**2 / 6.0 / (_STRETCH / 2)
    allowed_nm = QUANTIZATION_SHARE * hardware.effort_limit_nm
    found = []
    for weight, harmless in (
        (law, allowed_nm**2),
        (np.ones_like(law), (_LIVELY_COUNTS * hardware.encoder_resolution_rad) ** 2),
    ):
        # the median, of which numpy's own loads numpy.ma
        seen = float(np.sort(power[:, above] @ weight)[len(power) // 2])
        most = max(_BEYOND_NOISE**2 * noise * float(np.sum(weight)), harmless)
        found.append(np.sqrt(seen / most))
    return float(min(found))


def _crossover(gains: AxisGains, axis: AxisModel, hardware: LoopHardware) -> float:
    """Highest frequency at which the opened loop has a gain of one, rad/s."""
    omega, response = open_loop(gains, plant_of(axis), hardware)
    louder = omega[np.abs(response) >= 1.0]
    return float(louder[-1]) if len(louder) else 0.0

"""From gains in force to others: checked, forecast, committed, verified by motions, kept or not.

`run` and `gains commit` go the same way: a motion with the gains in force, then a `Trial` of the
new ones, which `concluded` keeps or takes back.

How large a step may be: the board's own limits hold for everybody. Beyond them, feedback from a
file may grow or shrink five times at once and not to or from zero, unless the user says
`--large-steps`: nobody knows where a file comes from. `run` may take any step that the board
allows, for its gains are designed with margins from a motion of this very drive that it has just
identified and trusts; soft start-up gains are left by a step of four times, and by feed-forward
from nothing. Either way a motion decides, and the board rolls back by itself.
"""

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from edge_ident.commissioning import gain_transfer, safety
from edge_ident.commissioning.capture import Capture, Observer, capture_motion, check_drive
from edge_ident.commissioning.drawn_loads import Grounds, RecordedMotion, beginning
from edge_ident.commissioning.further_motions import (
    NamedMotion,
    inside_window,
    second_motion,
    within_limits,
)
from edge_ident.commissioning.promise import Errors, Promise, promised
from edge_ident.commissioning.tracking_forecast import of_motor
from edge_ident.commissioning.verification import (
    GainChange,
    Verification,
    compare_motions,
    liveliness,
    verification_motion,
)
from edge_ident.control.position_loop import LoopHardware
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import MotionName, named_trajectory
from edge_ident.errors import BoardError, DataError
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.model.model import Model
from edge_ident.signals.recording import Recording
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board import Board
from firmware_interface.board_gains import RunningCommit
from firmware_interface.errors import BusyError, NoReplyError
from firmware_interface.gains import AxisGains, Bank

log = logging.getLogger(__name__)

# New gains on trial: what they promise, and what two motions say of that.
#
# The order is: forecast on the motion that was made with the gains in force; the second motion with
# them, unless it was made; forecast on that one too; write; both motions with the new gains;
# verdict. So everything that judges the new gains is in hand, or promised, before they are written.
# What the motions with the new gains measured decides, not what was promised.


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
            self._running = gain_transfer.write_gains(self._board, self.wanted, self._observer.say)
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
            now_rad, then_rad = of_axis.now.rms_rad, of_axis.after.rms.middle_rad
            said = "axis %s on the %s: rms error %.3g rad, forecast with the new gains %.3g rad"
            log.info(said, axis, motion.name, now_rad, then_rad)

    def move_second(self) -> Recorded:
        """The second motion with the old gains, made where it was not made yet."""
        if self.second is None:
            self.second = self._moved_second()
        return self.second

    def _moved_second(self) -> Recorded:
        before, board = self._before, self._board
        model, limits = before.grounds.model, self._limits
        fitting = within_limits(before.second, model, self.active, limits)
        second = inside_window(before.first, fitting, gain_transfer.confirm_window_s(board))
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


# From gains in force to others.


def put_in_force(
    board: Board, wanted: Bank, before: MotionBefore, observer: Observer
) -> GainChange:
    """Forecast, stage, commit, move with the new gains, and confirm them if they keep the promise.

    Nothing is written where the forecast is not worth it, or where the board's window to confirm
    is too short for the motions.

    Parameters
    ----------
    board : Board
        At rest, enabled, within `edge_ident.commissioning.safety.left_safe`.
    wanted : mapping of axis name to AxisGains
        Checked.
    before : MotionBefore
    observer : Observer

    Raises
    ------
    BoardError
        The window is too short, or a motion did not get to its end.
    """
    trial = Trial(board, wanted, before, observer, None, Stopwatch())
    return concluded(board, trial, worth_a_write=trial.worth_a_write())


def concluded(board: Board, trial: Trial, *, worth_a_write: bool) -> GainChange:
    """Write the gains of a trial if they are worth it, and confirm them if they keep the promise.

    The rules are in `edge_ident.commissioning.promise` and in
    `edge_ident.commissioning.verification`.

    Raises
    ------
    BoardError
        A motion did not get to its end.
    """
    if not worth_a_write:
        # the last motion was left to end by itself, and no further one ends it
        board.settle()
        log.info("not worth a write: nothing is written")
        return GainChange(confirmed=False, unchanged=True, promise=trial.promise)
    trial.write()
    change = trial.verify()
    keep = change.confirmed
    _confirm_or_roll_back(board, trial.wanted if keep else trial.active, keep=keep)
    return change


def settled_gains(board: Board) -> Bank:
    """Take a board, and give the gains that are in force on it to stay while this host holds it.

    Before that, another host could put others in force, confirm them, or lose them.

    Raises
    ------
    BoardError
        They wait to be confirmed, or another host holds the board.
    """
    board.claim()
    if board.status().unconfirmed:
        raise BoardError(
            "the gains in force wait to be confirmed, or the board takes them back by itself",
            "wait for that, or take them back with: edge-ident gains rollback",
        )
    return board.active_gains()


def wanted_gains(active: Bank, file: gain_transfer.GainFile) -> dict[str, AxisGains]:
    """Gains of all axes: a file's, and those in force where it says nothing.

    Raises
    ------
    DataError
        The file names an axis that the board does not have.
    """
    for axis in file.gains:
        # a board counts its axes by its own names; a file of another machine has others
        if axis not in active:
            raise DataError(
                f"the file has gains of axis {axis}, the board has {', '.join(active)}",
                "read the recording with the board's names of axes (--column), and design anew",
            )
    return {**active, **file.gains}


def check_change(board: Board, active: Bank, wanted: Bank, large_steps: bool) -> tuple[str, ...]:
    """What is checked before gains are staged, and again before they are committed.

    Returns
    -------
    tuple of str
        Axes whose feedback could not be checked: the board states no inertia.

    Raises
    ------
    GainError
    """
    gain_transfer.check_gains(wanted, active, board.limits())
    if not large_steps:
        gain_transfer.check_factor(wanted, active)
    return gain_transfer.check_feedback(board, wanted)


def commit_staged(
    board: Board, drive: Drive, staged: Bank, observer: Observer, model: Model | None = None
) -> GainChange:
    """Move with the old gains, forecast, then move with the new ones; keep them as a run does.

    Parameters
    ----------
    board : Board
    drive : Drive
    staged : mapping of axis name to AxisGains
    observer : Observer
    model : Model, optional
        Effects that are known of the drive.
    """
    check_drive(board, drive)
    name: MotionName = "sinusoid"
    with safety.ready_to_move(board, observer.say):
        observer.stage("motion, old gains")
        trajectory = named_trajectory(drive, name, 1)
        capture = capture_motion(board, trajectory, observer.samples, say=observer.say)
        board.finish()
        found = identify(capture.recording, None, model=model, diagnose=False)
        before = MotionBefore.of(drive, name, capture, found)
        return put_in_force(board, staged, before, observer)


def restore_gains(board: Board, drive: Drive, wanted: Bank, observer: Observer) -> GainChange:
    """Stage gains of before and put them in force; they stay if the drive moves without a fault.

    It does not move with the present gains, which may be the reason for the restoration.
    """
    check_drive(board, drive)
    motion = NamedMotion("sinusoid", named_trajectory(drive, "sinusoid", 1))
    with safety.ready_to_move(board, observer.say):
        # before any motion: the gains in force may be why somebody restores others
        gain_transfer.write_gains(board, wanted)
        observer.stage("verification motion")
        after = verification_motion(board, motion, observer)
        _confirm_or_roll_back(board, wanted, keep=True)
    return GainChange(confirmed=True, tracking_after_rad=after.tracking_rms_rad)


def roll_back_unconfirmed(board: Board) -> None:
    """Take back what was committed and not confirmed.

    Raises
    ------
    BoardError
        There is nothing to take back, or the gains in force did not change.
    NoReplyError, BusyError
        The board could not be asked what became of it; a note says that nobody knows.
    """
    if not board.status().unconfirmed:
        raise BoardError(
            "the active gains are confirmed: there is nothing to roll back",
            "to return to older gains, use edge-ident gains restore with a backup",
        )
    committed = board.active_gains()
    try:
        try:
            board.roll_back()
        except BoardError:
            if board.status().unconfirmed:
                raise
            log.warning("the axes did not come to rest: the board took the gains back itself")
        left = board.active_gains()
    except (NoReplyError, BusyError, KeyboardInterrupt) as error:
        error.add_note("which gains are in force is not known: look with edge-ident gains show")
        raise
    if left == committed:
        raise BoardError(
            "the gains in force are the same as before: those of before the commit were the same, "
            "or another command came in place of ROLL_BACK",
            "look with edge-ident gains show; if they are the wrong ones, use edge-ident gains "
            "restore with a backup",
        )


def check_owner(board: Board, file: gain_transfer.GainFile) -> None:
    """Make sure that a backup goes back to the board that it came from.

    Raises
    ------
    DataError
    """
    owner, serial = file.serial_number, board.identity.serial_number
    if owner is not None and owner != serial:
        raise DataError(
            f"the backup is of board {owner}, this is board {serial}",
            "connect the right board; to copy gains to another board, use edge-ident gains stage",
        )


def _confirm_or_roll_back(board: Board, left: Bank, *, keep: bool) -> None:
    """Keep the new gains or return to the old ones; read back that it leaves these in force.

    The board's word for it is not enough: no checksum says which command it was given.
    """
    if keep:
        board.confirm()
    else:
        board.roll_back()
    gain_transfer.compare_gains(left, board.active_gains())
    log.info("gains %s", "confirmed" if keep else "rolled back")

"""Let the board move and record what it did."""

import logging
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from typing import Final, Protocol

import numpy as np

from edge_ident.commissioning.safety import ready_to_move, stop_at_once
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import MotionName, named_trajectory
from edge_ident.errors import DataError, LinkError
from edge_ident.signals import data_checks, metrics, recording_files
from edge_ident.signals.recording import Array, AxisRecord, Recording
from edge_ident.support.process import deaf_to_interrupts, uncut
from firmware_interface.board import AxisLimits, Board, CapturePage
from firmware_interface.board_checks import CLOCK_RANGE, fault_error
from firmware_interface.control_law import exact_effort_nm
from firmware_interface.errors import BusyError, MotionRefusedError, StoppedError
from firmware_interface.gains import AxisGains
from firmware_interface.motion import (
    Multisine,
    Reference,
    Staircase,
    Trajectory,
    reference,
    stop_duration_s,
)
from firmware_interface.registers import REGISTERS, State

log = logging.getLogger(__name__)


class Observer(Protocol):
    """Sees the progress of a job on a board."""

    def stage(self, title: str) -> None:
        """Call when a stage begins."""

    def samples(self, in_hand: int, expected: int) -> None:
        """Call as captured samples arrive."""

    def say(self, message: str) -> None:
        """Call with what the person at the machine should know."""


Enough = Callable[[int, Callable[[], Recording]], bool]
"""Whether what is in hand is enough: gets the samples, and what makes a recording of them."""

_COLUMN_BYTES: Final = 8
_COLUMNS_PER_AXIS: Final = 3  # position, effort and reference; beside them the time


@dataclass(frozen=True)
class Capture:
    """One recorded motion.

    Attributes
    ----------
    recording : Recording
    clock_samples : int
        The board's clock at the first sample.
    pages : int
        Pages taken, each checked for its index, sample counter and CRC.
    tail_s : float
        Board time from the last captured sample to the last page in hand.
    tracking_rms_rad : dict of axis name to float
        Root mean square of reference minus position.
    ended_early : bool
        As much as was needed is in hand; the axes may still move.
    """

    recording: Recording
    clock_samples: int
    pages: int
    tail_s: float
    tracking_rms_rad: dict[str, float]
    ended_early: bool = False


def check_drive(board: Board, drive: Drive) -> None:
    """Make sure that board and drive description speak of the same machine.

    Raises
    ------
    DataError
        Axes, sampling period or encoder differ.
    """
    identity = board.identity
    pairs = {
        "sampling period": (identity.sample_period_s, drive.sampling_period_s),
        **{
            f"encoder counts of axis {name}": (
                float(identity.counts_per_turn),
                axis.encoder_counts_per_turn,
            )
            for name, axis in drive.axes.items()
        },
    }
    if set(board.axes) != set(drive.axes):
        raise DataError(
            f"the board has axes {', '.join(board.axes)}, the drive description "
            + ", ".join(drive.axes),
            "give the description of this drive with --drive; its axes have the board's names",
        )
    for what, (on_board, described) in pairs.items():
        if not np.isclose(on_board, described, rtol=1e-5):
            raise DataError(
                f"{what}: the board has {on_board:g}, the drive description {described:g}",
                "correct the drive description, or give another one with --drive",
            )


def capture_motion(
    board: Board,
    trajectory: Trajectory,
    on_samples: Callable[[int, int], None],
    file: Path | None = None,
    say: Callable[[str], None] = log.warning,
    after: "Capture | None" = None,
    enough: Enough | None = None,
) -> Capture:
    """Run one motion and drain its pages while it lasts; `come_to_rest` is to follow.

    Its lead-in is as long as the way there needs (`with_lead_in`). The recording is saved before
    anything else is done with it; where the motion fails, the machine is stopped and what
    there is of the recording is kept beside that file, as `partial_file` names it.

    Parameters
    ----------
    board : Board
        In state IDLE, enabled.
    trajectory : Trajectory
    on_samples : callable
        Called with samples in hand and samples expected.
    file : Path, optional
        For the recording.
    say : callable
        Takes what the person should know.
    after : Capture, optional
        An earlier motion, from which the recording's time goes on.
    enough : callable, optional
        Asked after every page whether what is in hand is enough; then the rest is not fetched.

    Raises
    ------
    DataError, LinkError
        See `check_recordable`; the motion is not made.
    """
    reachable = with_lead_in(board, trajectory)
    if reachable.lead_in_s > trajectory.lead_in_s:
        say(
            "the axes are far from the start of the motion: moving there takes "
            f"{reachable.lead_in_s:.1f} s"
        )
    board.write_trajectory(reachable)
    expected = _samples(board, trajectory)
    if later := check_recordable(board, trajectory, file):
        say(later)
    board.arm()
    pages: list[CapturePage] = []
    with _kept_if_cut_short(board, pages, file, say):
        board.start()
        log.info("motion started, %d samples expected", expected)
        begin, tail_s, ended_early = _drain(board, pages, expected, on_samples, enough)
        capture = _assemble(board, pages, begin, tail_s, after)
        samples = len(capture.recording.time_s)
        if ended_early:
            capture = replace(capture, ended_early=True)
        elif samples != expected:
            raise LinkError(
                f"the board captured {samples} samples of {expected}", "repeat the motion"
            )
        if file is not None:
            recording_files.save_recording(capture.recording, file)
    log.info("%d pages received %.3f s after the last sample", len(pages), capture.tail_s)
    return capture


def come_to_rest(board: Board, capture: Capture) -> None:
    """Wait for the end of a motion, or stop one that ended early.

    Raises
    ------
    BoardError
        The axes do not come to rest, or a fault stopped them.
    """
    if not capture.ended_early:
        board.finish()
        return
    board.quick_stop()
    status = board.status()
    if status.state is State.FAULT:
        raise fault_error(status)


def check_recordable(board: Board, trajectory: Trajectory, file: Path | None) -> str:
    """Refuse a motion that could not be recorded; best before the effort goes on.

    What the line brings is measured now.

    Returns
    -------
    str
        That fetching ends later than the motion; empty where it does not.

    Raises
    ------
    DataError
        The disk has no room for the file.
    LinkError
        The line is too slow: the board would overwrite samples before they are fetched.
    """
    if file is not None:
        _check_room(file, board, trajectory)
    pace = board.capture_pace(_samples(board, trajectory))
    if pace.overwritten:  # or was that one busy moment?
        pace = board.capture_pace(_samples(board, trajectory))
    if pace.keeps_up:
        return ""
    brings = f"it brings {1.0 / pace.fetched_s:.1f} capture pages a second"
    if pace.overwritten:
        raise LinkError(
            f"the line is too slow for this motion of {trajectory.duration_s:.0f} s: {brings}, "
            f"and at least {1.0 / pace.needed_s:.1f} are needed; the motion was not made",
            "edge-ident doctor says what slows the line; as it is, a motion of at most "
            f"{pace.longest_s:.0f} s can be recorded",
        )
    return (
        f"the line is slow: {brings}, and the board fills {1.0 / pace.filled_s:.1f}. Fetching all "
        f"samples takes {pace.all_fetched_s:.0f} s, of which the motion is "
        f"{trajectory.duration_s:.0f} s"
    )


def _check_room(file: Path, board: Board, trajectory: Trajectory) -> None:
    samples = _samples(board, trajectory)
    needed = samples * _COLUMN_BYTES * (1 + _COLUMNS_PER_AXIS * len(board.axes))
    free = shutil.disk_usage(file.parent).free
    if free < needed:
        raise DataError(
            f"{file.parent} has {free // 1000} kB free, but the recording needs "
            f"{ceil(needed / 1000)} kB",
            "free some space or choose another folder with --output; this motion was not made",
        )


def _samples(board: Board, trajectory: Trajectory) -> int:
    return round(trajectory.duration_s / board.identity.sample_period_s)


def partial_file(file: Path) -> Path:
    """Where what was captured is kept if the motion does not get to its end."""
    return file.with_name(f"{file.stem}_partial{file.suffix}")


def _drain(
    board: Board,
    pages: list[CapturePage],
    expected: int,
    on_samples: Callable[[int, int], None],
    enough: Enough | None,
) -> tuple[int, float, bool]:
    """Fetch all pages that are needed.

    Gives the board's clock at the first sample, in samples, its time from the last sample to the
    last page, s, and whether less than the whole motion was enough.
    """
    capture_start, samples, ended_early = 0, 0, False

    def in_hand() -> Recording:
        return _assemble(board, pages, capture_start, 0.0, None).recording

    for page in board.capture_pages():
        if not pages:
            status = board.status()
            capture_start = status.clock_samples - status.samples_captured
        pages.append(page)
        samples = page.first_sample + len(page.position_rad)
        on_samples(samples, expected)
        if enough is not None and samples < expected and enough(samples, in_hand):
            board.heartbeat()  # until the stop comes, the recording is saved
            ended_early = True
            break
    if not pages:
        raise LinkError("the board captured no samples", "repeat the motion")
    last = samples if ended_early else expected
    late = (board.status().clock_samples - capture_start - last) % CLOCK_RANGE
    return capture_start, late * board.identity.sample_period_s, ended_early


@contextmanager
@uncut
def _kept_if_cut_short(
    board: Board, pages: list[CapturePage], file: Path | None, say: Callable[[str], None]
) -> Iterator[None]:
    try:
        yield
    except BaseException as error:
        with deaf_to_interrupts():
            if not isinstance(error, BusyError | StoppedError):  # then another may have the board
                stop_at_once(board)
            if file is not None and pages:
                path = partial_file(file)
                recording = _assemble(board, pages, 0, 0.0, None).recording
                with suppress(OSError):  # the first error is the one to tell
                    recording_files.save_recording(recording, path)
                    say(f"saved the {len(recording.time_s)} samples captured so far: {path}")
        raise


def _assemble(
    board: Board, pages: list[CapturePage], begin: int, tail_s: float, after: Capture | None
) -> Capture:
    identity = board.identity
    passed = 0 if after is None else (begin - after.clock_samples) % CLOCK_RANGE
    position = np.concatenate([page.position_rad for page in pages])
    effort = np.concatenate([page.effort_nm for page in pages])
    following = np.concatenate([page.following_error_rad for page in pages])
    recording = Recording(
        time_s=identity.sample_period_s * np.arange(len(position), dtype=np.float64),
        axes={
            name: AxisRecord(
                position=position[:, i],
                effort=effort[:, i],
                position_unit="rad",
                effort_unit="N*m",
                reference=position[:, i] + following[:, i],
            )
            for i, name in enumerate(board.axes)
        },
        source=f"board {identity.serial_number}",
        # the effort of a row acts for one period, from its computation on
        effort_shift_s=identity.control_delay_s + 0.5 * identity.sample_period_s,
        begin_s=passed * identity.sample_period_s,
    )
    return Capture(
        recording=recording,
        clock_samples=begin,
        pages=len(pages),
        tail_s=tail_s,
        tracking_rms_rad={name: metrics.rms(following[:, i]) for i, name in enumerate(board.axes)},
    )


# How long the lead-in of a motion must be, from where the axes stand.
#
# A board blends from the rest position into a motion over its lead-in. The further away the axes
# stand, the longer that must take, or the lead-in is faster than the motion itself.


# Shares of the limits of position, speed, acceleration and effort that the lead-in may use where
# the motion itself stays below them; of the effort, feedback needs the rest.
_SHARES: Final = np.array([0.9, 0.9, 0.9, 0.8])
_ROUNDING: Final = 1.001
_LENGTHEN: Final = 1.1
_LOOKS_PER_S: Final = 100
_MOST_SAMPLES: Final = REGISTERS["trajectory.lead_in_samples"].maximum or 0.0


class UnreachableError(MotionRefusedError):
    """However long it takes, a motion cannot be begun from where the axes stand."""


def with_lead_in(board: Board, trajectory: Trajectory) -> Trajectory:
    """Lengthen the lead-in as far as the distance from where the axes stand asks for.

    Never shorter than it was. Over the lead-in every axis keeps nine tenths of the limits of speed,
    acceleration and travel, the way to a stop included, and eight tenths of the effort by
    feed-forward, or what the motion itself takes where that is more.

    Raises
    ------
    BoardError
        However long it takes, the motion cannot be reached from there.
    """
    rest, limits, gains = board.status().position_rad, board.limits(), board.active_gains()
    captured = _captured(trajectory, rest)
    allowed = {
        axis: _allowed(_use(axis, captured, None, gains[axis]), rest[axis], limits[axis])
        for axis in trajectory.axes
    }
    longest_s = _MOST_SAMPLES * board.identity.sample_period_s
    lead_in_s = trajectory.lead_in_s
    while lead_in_s <= longest_s:
        if _fits(trajectory.axes, lead_in_s, rest, gains, allowed):
            return replace(trajectory, lead_in_s=lead_in_s)
        lead_in_s *= _LENGTHEN
    where = ", ".join(f"{axis} {rest[axis]:.3g} rad" for axis in trajectory.axes)
    raise UnreachableError(
        f"the motion cannot be reached from the present position of the axes ({where})",
        "move the axes closer with edge-ident home",
    )


def _fits(
    axes: Mapping[str, Multisine] | Mapping[str, Staircase],
    lead_in_s: float,
    rest: Mapping[str, float],
    gains: Mapping[str, AxisGains],
    allowed: Mapping[str, Array],
) -> bool:
    times = np.linspace(-lead_in_s, 0.0, max(int(lead_in_s * _LOOKS_PER_S), 200))
    references = _references(axes, times, lead_in_s, rest)
    fastest = np.max([np.abs(of_axis.velocity_rad_s) for of_axis in references.values()], axis=0)
    stop_s = np.array([stop_duration_s(speed) for speed in fastest.tolist()])
    uses = {axis: _use(axis, references, stop_s, gains[axis]) for axis in axes}
    return all(bool(np.all(uses[axis] <= allowed[axis])) for axis in axes)


def _captured(trajectory: Trajectory, rest: Mapping[str, float]) -> dict[str, Reference]:
    """The motion itself, by axis; then any lead-in is over, however long it was."""
    count = max(int(trajectory.duration_s * _LOOKS_PER_S), 2)
    times = np.linspace(0.0, trajectory.duration_s, count)
    return _references(trajectory.axes, times, 1.0, rest)


def _references(
    axes: Mapping[str, Multisine] | Mapping[str, Staircase],
    times: Array,
    lead_in_s: float,
    rest: Mapping[str, float],
) -> dict[str, Reference]:
    return {axis: reference(motion, times, lead_in_s, rest[axis]) for axis, motion in axes.items()}


def _use(
    axis: str, references: Mapping[str, Reference], stop_s: Array | None, gains: AxisGains
) -> Array:
    """The most (4,) that an axis is asked for: position, rad; speed, rad/s; acceleration, rad/s²;
    effort, N*m. `stop_s` None stops it from its own top speed."""
    own = references[axis]
    other = next((of for name, of in references.items() if name != axis), None)
    if stop_s is None:
        stop_s = np.array(stop_duration_s(float(np.max(np.abs(own.velocity_rad_s)))))
    end = own.position_rad + own.velocity_rad_s / 2.0 * stop_s
    farthest = np.maximum(np.abs(own.position_rad), np.abs(end))
    effort = exact_effort_nm(gains, own, other)[0]
    asked = farthest, own.velocity_rad_s, own.acceleration_rad_s2, effort
    return np.array([float(np.max(np.abs(values))) for values in asked])


def _allowed(own: Array, rest_rad: float, limits: AxisLimits) -> Array:
    """What the lead-in may ask for (4,): a share of each limit, or what the motion itself does."""
    limit = np.array(
        [limits.travel_rad, limits.speed_rad_s, limits.acceleration_rad_s2, limits.effort_nm]
    )
    own = np.append(max(own[0], abs(rest_rad)), own[1:])
    allowed = np.maximum(_SHARES * limit, _ROUNDING * own)
    allowed[0] = min(allowed[0], limit[0])  # rounding leads no farther than the board allows
    return np.asarray(allowed)


# Record one motion, and nothing else.


def record_motion(
    board: Board,
    drive: Drive,
    motion: MotionName | Trajectory,
    cycles: int | None,
    file: Path,
    observer: Observer,
) -> Capture:
    """Move, and record what the board measures.

    Parameters
    ----------
    board : Board
        Connected.
    drive : Drive
    motion : {"sinusoid", "multisine", "staircase"} or Trajectory
    cycles : int or None
        Periods of a named motion; None takes the drive description's.
    file : Path
        For the recording, which is written before it is checked.
    observer : Observer

    Raises
    ------
    LinkError, BoardError
        The motion did not get to its end.
    DataError
        Board and drive description differ, or what an axis that was to move recorded cannot be
        used.
    """
    check_drive(board, drive)
    if isinstance(motion, Trajectory):
        check_motion(motion, board)
        trajectory, stage = motion, "motion"
    else:
        trajectory, stage = named_trajectory(drive, motion, cycles), motion
    check_recordable(board, trajectory, file)
    with ready_to_move(board, observer.say):
        observer.stage(stage)
        found = capture_motion(board, trajectory, observer.samples, file, observer.say)
        board.finish()
    data_checks.check_recording(_moved(found.recording))
    return found


def _moved(recording: Recording) -> Recording:
    """The axes that were to move: a designed motion may leave others at rest, as it should."""
    moved = {
        name: axis
        for name, axis in recording.axes.items()
        if axis.reference is None or np.ptp(axis.reference) > 0.0
    }
    return replace(recording, axes=moved or recording.axes)


def check_motion(trajectory: Trajectory, board: Board) -> None:
    """Make sure that a motion is one of the board's axes, and long enough to be identified.

    Raises
    ------
    DataError
        It names other axes, or ends too soon.
    """
    if set(trajectory.axes) != set(board.axes):
        raise DataError(
            f"the motion is one of axes {', '.join(trajectory.axes)}, the board has "
            f"{', '.join(board.axes)}",
            "design the motion with the description of this drive: edge-ident plan --drive FILE",
        )
    least_s = data_checks.MINIMUM_SAMPLES * board.identity.sample_period_s
    if trajectory.duration_s < least_s:
        raise DataError(
            f"duration_s of {trajectory.duration_s:g} is too short for "
            f"{data_checks.MINIMUM_SAMPLES} samples",
            f"give a motion of at least {least_s:g} s",
        )

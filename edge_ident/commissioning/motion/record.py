"""Record one motion, and nothing else."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from edge_ident.commissioning.motion.capture import (
    Capture,
    capture_motion,
    check_drive,
    check_recordable,
)
from edge_ident.commissioning.motion.observer import Observer
from edge_ident.commissioning.motion.safety import ready_to_move
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import MotionName, named_trajectory
from edge_ident.errors import DataError
from edge_ident.signals.array_checks import MINIMUM_SAMPLES
from edge_ident.signals.data_checks import check_recording
from edge_ident.signals.recording import Recording
from firmware_interface.board import Board
from firmware_interface.motion import Trajectory


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
    check_recording(_moved(found.recording))
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
    least_s = MINIMUM_SAMPLES * board.identity.sample_period_s
    if trajectory.duration_s < least_s:
        raise DataError(
            f"duration_s of {trajectory.duration_s:g} is too short for {MINIMUM_SAMPLES} samples",
            f"give a motion of at least {least_s:g} s",
        )

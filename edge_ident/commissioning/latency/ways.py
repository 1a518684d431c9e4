"""How long gains take from the last captured sample: with a stop before the commit, and without."""

import time
from dataclasses import replace
from typing import Final

from edge_ident.commissioning.gains.shadow_bank import staged_kept
from edge_ident.commissioning.gains.transfer import write_gains
from edge_ident.commissioning.motion.capture import capture_motion, check_drive
from edge_ident.commissioning.motion.observer import Observer
from edge_ident.commissioning.motion.safety import ready_to_move
from edge_ident.commissioning.run import board_designs
from edge_ident.drive.description import Drive
from edge_ident.estimation.network import Network
from edge_ident.identification.identify import identify
from edge_ident.signals.recording import Recording
from firmware_interface.board import Board
from firmware_interface.motion import Trajectory

_MOTION_S: Final = 1.0
"""The motion counts for its end alone."""


def measured_ways(
    board: Board,
    drive: Drive,
    recording: Recording,
    network: Network,
    repetitions: int,
    observer: Observer,
) -> dict[str, list[float]]:
    """Times from the last sample to gains read back, ms: `at_rest` and, where it can, `running`.

    Each is the end of a short motion, the identification of a recording, the design of gains, and
    the write of those in force, which are then taken back. What was staged before is staged again.
    The ways take turns, so that both have the same load beside them.

    Parameters
    ----------
    board : Board
    drive : Drive
        Behind the board, with the motion.
    recording : Recording
    network : Network
    repetitions : int
        Of each way.
    observer : Observer

    Raises
    ------
    LinkError, BoardError
        A motion or a write did not get to its end.
    DataError
        Board and drive description differ.
    """
    check_drive(board, drive)
    ways = ("at_rest", "running") if board.takes_gains_running() else ("at_rest",)
    found: dict[str, list[float]] = {way: [] for way in ways}
    motion = replace(drive.trajectory(), duration_s=_MOTION_S)
    turns = repetitions * ways
    observer.stage("from the last sample to gains")
    observer.samples(0, len(turns))
    with staged_kept(board), ready_to_move(board, observer.say):
        for done, way in enumerate(turns, 1):
            spent = _way_ms(board, motion, recording, network, observer, stop=way == "at_rest")
            found[way].append(spent)
            observer.samples(done, len(turns))
    return found


def _way_ms(
    board: Board,
    motion: Trajectory,
    recording: Recording,
    network: Network,
    observer: Observer,
    *,
    stop: bool,
) -> float:
    active = board.active_gains()
    capture = capture_motion(board, motion, lambda *_: None, say=observer.say)
    began_s = time.perf_counter()
    if stop:
        board.finish()
    else:
        board.leave_to_rest()
    board_designs(board, identify(recording, network, diagnose=False))
    write_gains(board, active, observer.say)
    spent_s = time.perf_counter() - began_s
    board.settle()
    board.roll_back()
    return 1e3 * (capture.tail_s + spent_s)

"""The work that follows a motion, up to gains committed and verified, by stage."""

from typing import Final

from edge_ident.commissioning.gains.transfer import compare_gains
from edge_ident.commissioning.run import board_designs
from edge_ident.estimation.network import Network
from edge_ident.identification.identify import identify
from edge_ident.signals.recording import Recording
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board import Board

STAGES: Final = (
    "start",
    "connect",
    "page_tail",
    "signals",
    "adequacy",
    "align",
    "image",
    "network",
    "estimate",
    "gains",
    "stage",
    "commit",
    "verify",
    "total",
)
"""Stages in order; `start` (interpreter, imports, network) and `connect` are cold only."""


def after_motion_ms(board: Board, recording: Recording, network: Network) -> dict[str, float]:
    """Time of each stage, with the board's own gains in place of new ones, ms.

    The shadow bank is left with the gains in force.
    """
    active = board.active_gains()
    watch = Stopwatch()
    with watch.stage("page_tail"):
        board.read_last_page()
    found = identify(recording, network, diagnose=False, stopwatch=watch)
    with watch.stage("gains"):
        board_designs(board, found)
    with watch.stage("stage"):
        board.stage_gains(active)
    with watch.stage("commit"):
        board.commit()
    with watch.stage("verify"):
        compare_gains(active, board.active_gains())
    times = watch.timing_ms()
    board.roll_back()
    return {stage: times[stage] for stage in STAGES if stage in times}

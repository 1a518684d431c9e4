"""Boards behind real lines, motions short enough for tests."""

import math
import os
from collections.abc import Iterator
from fcntl import LOCK_EX, flock
from functools import partial
from pathlib import Path

import pytest
from board_thread import Serve, served
from conformance_boards import (
    BoardCommand,
    Served,
    build_firmware,
    c_command,
    clean_up,
    python_command,
    serving,
    until_abandoned,
)
from hypothesis import settings

from firmware_interface.board import Board
from firmware_interface.motion import Multisine, SineComponent, Trajectory

settings.register_profile("seeded", derandomize=True, deadline=None)
settings.load_profile("seeded")


@pytest.fixture(name="served")
def served_fixture() -> Serve:
    """`with served(board, "pty") as url`."""
    return served


@pytest.fixture
def short_motion() -> Trajectory:
    """Both axes, half a second of lead-in, 421 samples: 30 full pages and one of a single row."""
    rate = 2.0
    return Trajectory(
        axes={
            "x": Multisine((SineComponent(0.5, rate, 0.0),)),
            "z": Multisine((SineComponent(0.4, rate, math.pi / 2),)),
        },
        duration_s=421 * 0.0025,
        lead_in_s=0.5,
    )


@pytest.fixture(scope="session")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the programs of the reference firmware, built with the sanitizers.

    Workers of pytest-xdist share it: the first one builds, and make has nothing to do for others.
    """
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    with (folder / "firmware.lock").open("w") as lock:
        flock(lock, LOCK_EX)
        build_firmware(folder / "firmware", "sanitized")
    return folder / "firmware" / "sanitized"


@pytest.fixture(scope="module", params=["python", "c"])
def command_of_either(request: pytest.FixtureRequest) -> BoardCommand:
    """Gives the command line of a board of either kind."""
    if request.param == "python":
        return python_command
    return partial(c_command, request.getfixturevalue("firmware"))


@pytest.fixture(scope="module")
def either_kind(command_of_either: BoardCommand) -> Iterator[Served]:
    """A board of either kind, in a process of its own, for all tests of a file.

    It has looked at its encoders for 50 ms, and so knows that the axes stand.
    """
    with serving(command_of_either()) as served:
        with served.connected() as board:
            until_abandoned(board, lambda status: status.clock_samples > 20)
        yield served


@pytest.fixture
def either_board(either_kind: Served) -> Iterator[Board]:
    """The host's verbs for that board, which starts and ends as after power-up."""
    with either_kind.connected() as board:
        first_gains = board.active_gains()
        yield board
        clean_up(board, first_gains)


@pytest.fixture
def fresh_board(command_of_either: BoardCommand) -> Iterator[Board]:
    """The host's verbs for a board of either kind that no other test uses."""
    with serving(command_of_either(window_s=1.0)) as served, served.connected() as board:
        yield board

"""Boards behind real lines, motions short enough for tests."""

import math
import os
from collections.abc import Callable, Iterator
from fcntl import LOCK_EX, flock
from functools import partial
from pathlib import Path
from typing import Final

import pytest
from board_thread import Serve, served
from conformance_boards import (
    FPGA_SPEED,
    BoardCommand,
    Served,
    build_firmware,
    build_fpga,
    c_command,
    clean_up,
    python_command,
    serving,
    until_abandoned,
)
from hypothesis import settings

from firmware_interface.board import Board
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from tests.repetitions import examples

settings.register_profile("seeded", derandomize=True, deadline=None, max_examples=examples(100))
settings.load_profile("seeded")

_PROGRAMS: Final = {"c": "firmware", "fpga": "fpga"}
"""Fixtures that build a board."""
_THROUGH_THE_PORT: Final = ("effort", "first_move", "motion", "protection", "registers", "watchdog")
"""Files of tests that reach what an FPGA does; the others end in the same C."""


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
    """Folder with the programs of the reference firmware, built with the sanitizers."""
    folder = _built_once(
        tmp_path_factory, "firmware", lambda to: build_firmware(to, "sanitized", "explore")
    )
    return folder / "sanitized"


@pytest.fixture(scope="session")
def fpga(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the programs of the simulated FPGA."""
    return _built_once(tmp_path_factory, "fpga", lambda to: build_fpga(to, "all", "checks"))


def _built_once(factory: pytest.TempPathFactory, name: str, build: Callable[[Path], None]) -> Path:
    """Workers of pytest-xdist share it: the first builds, and make has nothing to do for others."""
    folder = factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    with (folder / f"{name}.lock").open("w") as lock:
        flock(lock, LOCK_EX)
        build(folder / name)
    return folder / name


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Name the kinds of boards that a conformance test runs against."""
    if "command_of_either" in metafunc.fixturenames:
        kinds = ["python", "c"]
        if metafunc.module.__name__.endswith(_THROUGH_THE_PORT):
            kinds.append("fpga")
        metafunc.parametrize("command_of_either", kinds, indirect=True, scope="module")


@pytest.fixture(scope="module")
def command_of_either(request: pytest.FixtureRequest) -> BoardCommand:
    """Gives the command line of a board of any kind."""
    if request.param == "python":
        return python_command
    command = partial(c_command, request.getfixturevalue(_PROGRAMS[request.param]))
    return partial(command, speed=FPGA_SPEED) if request.param == "fpga" else command


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
    """The host's verbs for a board of any kind that no other test uses."""
    with serving(command_of_either(window_s=1.0)) as served, served.connected() as board:
        yield board

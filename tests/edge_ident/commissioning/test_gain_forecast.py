"""What gains promise: margins as the design has them, tracking as the virtual board shows it."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.commissioning.capture import capture_motion
from edge_ident.commissioning.gain_forecast import Forecaster, check_stable
from edge_ident.commissioning.run import design_gains
from edge_ident.drive.description import load_drive
from edge_ident.errors import DataError, GainError, ModelError
from edge_ident.identification.identify import identify
from edge_ident.model.model import Model
from edge_ident.signals.recording import Recording
from firmware_interface.board import Board
from firmware_interface.virtual.board import VirtualBoard


def nothing(done: int, total: int) -> None: ...


@pytest.fixture(scope="module")
def moved() -> tuple[Board, Recording, dict[str, float]]:
    """A board, a recorded motion with its start-up gains, and the tracking error measured."""
    board = Board.connect(VirtualBoard())
    board.enable()
    capture = capture_motion(board, load_drive().trajectory(1), nothing)
    board.finish()
    return board, capture.recording, capture.tracking_rms_rad


@pytest.fixture(scope="module")
def identified(moved: tuple[Board, Recording, dict[str, float]]) -> Model:
    found = identify(moved[1], None)
    return Model({name: axis.model for name, axis in found.axes.items()})


def test_simulated_tracking_is_that_of_the_flexible_drive(
    moved: tuple[Board, Recording, dict[str, float]],
) -> None:
    board, recording, measured = moved
    forecaster = Forecaster(board.identity, board.limits(), None, recording)
    swinging = {
        axis: replace(gains, proportional=600.0, derivative=0.0)
        for axis, gains in board.active_gains().items()
    }
    (active, unstable) = forecaster.forecast([board.active_gains(), swinging], nothing)
    for axis, rms in measured.items():
        assert active[axis].tracking_rms_rad == pytest.approx(rms, rel=0.02)
        assert active[axis].stable
        assert not unstable[axis].stable
    check_stable(active)
    with pytest.raises(GainError, match="unstable"):
        check_stable(unstable)


def test_margins_are_those_of_the_design(
    moved: tuple[Board, Recording, dict[str, float]], identified: Model
) -> None:
    board, recording, _ = moved
    designs = design_gains(board, identify(recording, None))
    forecaster = Forecaster(board.identity, board.limits(), identified, None)
    (found,) = forecaster.forecast([{a: d.gains for a, d in designs.items()}], nothing)
    for axis, design in designs.items():
        assert found[axis].phase_margin_rad == pytest.approx(design.phase_margin_rad, rel=1e-6)
        assert found[axis].gain_margin == pytest.approx(design.gain_margin, rel=1e-6)
        assert found[axis].tracking_rms_rad is None


def test_models_that_are_not_of_this_drive_are_refused(
    moved: tuple[Board, Recording, dict[str, float]], identified: Model
) -> None:
    board, recording, _ = moved
    one = Model({"x": identified.axes["x"]})
    with pytest.raises(ModelError, match="axis z is not in the model"):
        Forecaster(board.identity, board.limits(), one, None)
    linear = replace(identified.axes["z"], position_unit="m", effort_unit="N")
    with pytest.raises(ModelError, match="not in rad and N"):
        Forecaster(board.identity, board.limits(), Model({**one.axes, "z": linear}), None)
    slow = replace(recording, time_s=2.0 * np.asarray(recording.time_s))
    with pytest.raises(DataError, match=r"sampled every 0\.005 s"):
        Forecaster(board.identity, board.limits(), None, slow)


def test_an_inertia_that_is_hardly_known_promises_nothing(
    moved: tuple[Board, Recording, dict[str, float]], identified: Model
) -> None:
    board, *_ = moved
    term = identified.axes["x"].terms[0]
    vague = replace(term, std={**term.std, "inertia": 1.0})
    axes = {**identified.axes, "x": replace(identified.axes["x"], terms=(vague,))}
    with pytest.raises(GainError, match="promises nothing"):
        Forecaster(board.identity, board.limits(), Model(axes), None)

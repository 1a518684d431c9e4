"""What gains promise: margins as the design has them, tracking as the virtual board shows it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from edge_ident.commissioning.capture import capture_motion
from edge_ident.commissioning.promise import Forecaster, check_stable
from edge_ident.commissioning.run import board_designs
from edge_ident.drive.description import load_drive
from edge_ident.errors import DataError, GainError, ModelError
from edge_ident.identification.identify import identify
from edge_ident.model.model import AxisModel, Model
from edge_ident.signals.recording import Recording
from firmware_interface.board import Board
from firmware_interface.board_types import BoardIdentity
from firmware_interface.gains import AxisGains
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
    (active, unstable) = forecaster.forecast([board.active_gains(), swinging])
    for axis, rms in measured.items():
        forecast = active[axis].tracking_rms
        assert forecast is not None
        assert forecast.middle_rad == pytest.approx(rms, rel=0.02)
        of_unstable = unstable[axis].tracking_rms
        assert of_unstable is not None
        assert of_unstable.middle_rad == np.inf
        assert active[axis].stable
        assert not unstable[axis].stable
    check_stable(active)
    with pytest.raises(GainError, match="unstable"):
        check_stable(unstable)


def slowest_decay(
    gains: AxisGains, axis: AxisModel, identity: BoardIdentity, factor: complex
) -> float:
    """Largest magnitude of an eigenvalue of the sampled loop, its gain times a factor, over the
    interval of the inertia; from one on, the loop is unstable. States: position, speed, effort
    before, filtered speed, position before."""
    inertia, viscous, *_ = axis.parameters
    period, delay = identity.sample_period_s, identity.control_delay_s
    smoothing = period / (gains.velocity_filter_s + period)
    found = []
    for heavier in (-2.0, 0.0, 2.0):
        moved = inertia + heavier * axis.terms[0].std["inertia"]
        a = np.zeros((3, 3))
        a[:2, :2] = [[0.0, 1.0], [0.0, -viscous / moved]]
        a[1, 2] = 1.0 / moved
        before, under = expm(a * delay), expm(a * (period - delay))
        loop = np.zeros((5, 5), dtype=complex)
        filtered = np.array([smoothing / period, 0, 0, 1.0 - smoothing, -smoothing / period])
        effort = -factor * gains.derivative * filtered
        effort[0] -= factor * gains.proportional
        loop[:2, :3] = under[:2, :2] @ before[:2]
        loop[:2] += np.outer(under[:2, 2], effort)
        loop[2], loop[3], loop[4, 0] = effort, filtered, 1.0
        found.append(np.max(np.abs(np.linalg.eigvals(loop))))
    return max(found)


def with_deviation(axis: AxisModel, inertia_std: float) -> AxisModel:
    """The axis, its inertia known to this standard deviation."""
    term = axis.terms[0]
    return replace(axis, terms=(replace(term, std={**term.std, "inertia": inertia_std}),))


def test_margins_are_what_the_sampled_loop_bears(
    moved: tuple[Board, Recording, dict[str, float]], identified: Model
) -> None:
    """The loop's eigenvalues leave the unit circle as its gain or its phase uses up the margin."""
    board, recording, _ = moved
    designs = board_designs(board, identify(recording, None))
    vague = Model({name: with_deviation(axis, 0.03) for name, axis in identified.axes.items()})
    forecaster = Forecaster(board.identity, board.limits(), vague, None)
    (found,) = forecaster.forecast([{a: d.gains for a, d in designs.items()}])
    for axis, design in designs.items():
        assert found[axis].tracking_rms is None
        margin, turn = found[axis].gain_margin, -1j * found[axis].phase_margin_rad
        for factors, bears in (
            ((0.998 * margin, np.exp(0.998 * turn)), True),
            ((1.002 * margin, np.exp(1.002 * turn)), False),
        ):
            for factor in factors:
                largest = slowest_decay(design.gains, vague.axes[axis], board.identity, factor)
                assert (largest < 1.0) == bears, (axis, factor)


def test_models_that_are_not_of_this_drive_are_refused(
    moved: tuple[Board, Recording, dict[str, float]], identified: Model
) -> None:
    board, recording, _ = moved
    one = Model({"x": identified.axes["x"]})
    with pytest.raises(ModelError, match="the board has axis z in rad"):
        Forecaster(board.identity, board.limits(), one, None)
    linear = replace(identified.axes["z"], position_unit="m", effort_unit="N")
    with pytest.raises(ModelError, match=r"z \(m and N\)"):
        Forecaster(board.identity, board.limits(), Model({**one.axes, "z": linear}), None)
    slow = replace(recording, time_s=2.0 * np.asarray(recording.time_s))
    with pytest.raises(DataError, match=r"sampled every 0\.005 s"):
        Forecaster(board.identity, board.limits(), None, slow)


def test_an_inertia_that_is_hardly_known_promises_nothing(
    moved: tuple[Board, Recording, dict[str, float]], identified: Model
) -> None:
    board, *_ = moved
    axes = {**identified.axes, "x": with_deviation(identified.axes["x"], 1.0)}
    with pytest.raises(GainError, match="too uncertain"):
        Forecaster(board.identity, board.limits(), Model(axes), None)

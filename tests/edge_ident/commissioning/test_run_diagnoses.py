"""A run on a machine whose base model is not enough: it diagnoses, or writes nothing."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge_ident.commissioning import identification_motions
from edge_ident.commissioning.capture import Capture
from edge_ident.commissioning.identification_motions import Plan
from edge_ident.commissioning.run import Ending, Outcome, commission
from edge_ident.drive.description import load_drive
from edge_ident.identification.result import ParameterSource
from firmware_interface.board import Board
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.plant import Hidden
from firmware_interface.plant.feed_drive import FEED_DRIVE
from firmware_interface.virtual.board import VirtualBoard

Lacking = Callable[[np.ndarray, np.ndarray], np.ndarray]


class Listener:
    """Remembers what the person at the machine reads."""

    def __init__(self) -> None:
        self.stages: list[str] = []
        self.said: list[str] = []

    def stage(self, title: str) -> None:
        self.stages.append(title)

    def samples(self, in_hand: int, expected: int) -> None: ...

    def say(self, message: str) -> None:
        self.said.append(message)


def stribeck(time: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    return 0.5 * np.exp(-((velocity / 0.3) ** 2)) * np.tanh(velocity / 0.01)


@pytest.fixture
def board() -> Board:
    return Board.connect(VirtualBoard())


def run(
    board: Board, folder: Path, lacking: Lacking, monkeypatch: pytest.MonkeyPatch, **plan: object
) -> tuple[Outcome, Listener]:
    """A run whose board measures an effort beyond that of its drive on axis x."""
    capture_motion = identification_motions.capture_motion

    def with_more(*arguments: object) -> Capture:
        made = capture_motion(*arguments)  # type: ignore[arg-type]
        recording = made.recording
        x = recording.axes["x"]
        velocity = np.gradient(x.position, recording.time_s)
        smooth = np.convolve(velocity, np.ones(21) / 21, "same")
        more = replace(x, effort=x.effort + lacking(recording.time_s, smooth))
        return replace(made, recording=replace(recording, axes={**recording.axes, "x": more}))

    monkeypatch.setattr(identification_motions, "capture_motion", with_more)
    listener = Listener()
    wanted = Plan(**{"motion": "multisine", "most_motions": 1, **plan})  # type: ignore[arg-type]
    return commission(board, load_drive(), None, wanted, folder, listener), listener


def test_what_the_base_model_lacks_is_said_and_the_gains_have_it(
    board: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outcome, listener = run(board, tmp_path, stribeck, monkeypatch, write=False)
    found = outcome.identification.axes["x"]
    assert outcome.good, found.findings
    assert found.source is ParameterSource.EXTENDED_MODEL
    assert found.estimate.parameters[2] == pytest.approx(FEED_DRIVE["x"].coulomb_friction, rel=0.03)
    assert abs(found.least_squares.parameters[2] - found.estimate.parameters[2]) > 0.05
    assert outcome.designs["x"].gains.stribeck_feedforward == pytest.approx(0.5, rel=0.1)
    assert "diagnosis" in listener.stages
    [line] = [line for line in listener.said if "stribeck friction" in line]
    assert line.startswith("axis x: explained")
    assert outcome.identification.axes["z"].diagnosis is None
    assert outcome.timing_ms["diagnosis"] > 0.0


def test_what_nothing_explains_keeps_no_gains_from_a_machine(
    tmp_path: Path,
) -> None:
    """A used machine: its base model is not adequate, one axis's inertia useless at first."""
    board = Board.connect(VirtualBoard(plant=Hidden.used(7).plant()))
    listener = Listener()
    plan = Plan(diagnose=False)
    outcome = commission(board, load_drive(), None, plan, tmp_path, listener)
    assert "diagnosis" not in listener.stages
    found = outcome.identification
    codes = {finding.code for axis in found.axes.values() for finding in axis.findings}
    assert "base_inadequate" in codes
    assert not found.trusted
    assert outcome.good
    assert outcome.answer.ending is Ending.BETTER
    assert outcome.change is not None
    for of in (outcome.change.verification, *outcome.change.others.values()):
        assert of is not None
        assert min(tracking.ratio for tracking in of.axes.values()) > 5.0
    assert 1 <= len([one for one in outcome.rounds if one.change.confirmed]) <= 3


def test_data_that_contradict_themselves_write_nothing(
    board: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The effort of axis x has the wrong sign."""
    capture_motion = identification_motions.capture_motion

    def turned(*arguments: object) -> Capture:
        made = capture_motion(*arguments)  # type: ignore[arg-type]
        x = made.recording.axes["x"]
        axes = {**made.recording.axes, "x": replace(x, effort=-x.effort)}
        return replace(made, recording=replace(made.recording, axes=axes))

    monkeypatch.setattr(identification_motions, "capture_motion", turned)
    outcome = commission(board, load_drive(), None, Plan(diagnose=False), tmp_path, Listener())
    assert not outcome.good
    assert outcome.change is None
    assert outcome.conclusion == "the data contradict themselves: axis x; nothing was written"
    assert board.active_gains()["x"].proportional == CONSERVATIVE_GAINS.proportional


def test_play_that_shows_at_reversals_alone_is_diagnosed_and_not_only_refused(
    tmp_path: Path,
) -> None:
    """Away from reversals the base model hardly misses: motor and load move as one."""
    hidden = Hidden.of(["backlash"])
    board = Board.connect(VirtualBoard(plant=hidden.plant()))
    plan = Plan(motion="multisine", write=False, most_motions=1)
    outcome = commission(board, load_drive(), None, plan, tmp_path, Listener())
    found = outcome.identification.axes["x"]
    assert found.adequacy.relative_residual < 0.01
    assert "with the samples near reversals, the base model leaves" in found.adequacy.reason
    assert found.diagnosis is not None
    assert [cause.term.effect for cause in found.diagnosis.causes] == ["backlash"]
    assert found.trusted, found.findings

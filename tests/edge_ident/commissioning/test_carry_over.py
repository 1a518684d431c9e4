"""A model that the second motion contradicts: nothing is written from it."""

from pathlib import Path

import pytest

from edge_ident.commissioning.run import Outcome, Plan, commission
from edge_ident.commissioning.separation import contradictions
from edge_ident.drive.description import load_drive
from edge_ident.identification.identify import identify
from edge_ident.signals.recording_files import load_recording
from firmware_interface.board import Board
from firmware_interface.plant import Hidden
from firmware_interface.virtual.board import VirtualBoard
from tests.short_runs import Listening


def run(effects: list[str], folder: Path, **plan: object) -> tuple[Outcome, Listening]:
    hidden = Hidden.of(effects, "x")
    board, listener = Board.connect(VirtualBoard(plant=hidden.plant())), Listening()
    wanted = Plan(**plan)  # type: ignore[arg-type]
    return commission(board, load_drive(), None, wanted, folder, listener), listener


def test_a_weak_spring_that_one_sinusoid_hides_is_named_before_the_write(tmp_path: Path) -> None:
    """With a positive inertia, nothing on the sinusoid says that a part of it is a spring."""
    outcome, listener = run(["position_dependent_load=0.03"], tmp_path)
    first, second = outcome.separation.motions
    alone = first.found.axes["x"]
    assert alone.trusted
    assert alone.estimate.parameters[0] < 0.35
    assert second.file == "capture_multisine.npz"
    assert list(second.sought) == ["x"]
    assert any("capture_multisine.npz joins the identification" in said for said in listener.said)
    after = outcome.identification.axes["x"]
    assert after.compensated_effects == ("position_dependent_load",)
    assert after.estimate.parameters[0] == pytest.approx(0.43, rel=0.02)
    assert outcome.confirmed


def test_one_motion_alone_is_not_contradicted_by_a_second(tmp_path: Path) -> None:
    outcome, _ = run(["position_dependent_load=0.03"], tmp_path, most_motions=1, write=False)
    assert len(outcome.separation.motions) == 1


def test_the_second_motion_of_a_sound_machine_says_nothing(tmp_path: Path) -> None:
    outcome, _ = run([], tmp_path)
    assert len(outcome.separation.motions) == 1
    found = identify(load_recording(tmp_path / "capture.npz"))
    assert contradictions(found, load_recording(tmp_path / "capture_multisine.npz")) == {}

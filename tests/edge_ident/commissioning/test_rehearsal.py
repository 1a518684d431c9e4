"""The identification before the motion: on as many samples, and of no consequence."""

from pathlib import Path

import numpy as np
import pytest

from edge_ident.commissioning import identification_motions
from edge_ident.commissioning.run import Plan, commission
from edge_ident.drive.description import load_drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.errors import DataError
from edge_ident.estimation.network import load_network
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.signals.recording import Recording
from firmware_interface.board import Board
from firmware_interface.virtual.board import VirtualBoard
from tests.short_runs import Silent, brief_drive


@pytest.fixture
def looked_at(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Recording, Identification]]:
    """Recordings that are identified, and what is found."""
    seen: list[tuple[Recording, Identification]] = []

    def seeing(recording: Recording, *given: object, **named: object) -> Identification:
        found = identify(recording, *given, **named)
        seen.append((recording, found))
        return found

    monkeypatch.setattr(identification_motions, "identify", seeing)
    return seen


def test_a_run_rehearses_on_as_many_samples_as_it_captures(
    looked_at: list[tuple[Recording, Identification]], tmp_path: Path
) -> None:
    board = Board.connect(VirtualBoard())
    commission(board, brief_drive(), None, Plan(write=False), tmp_path, Silent())
    (rehearsed, _), (captured, _) = looked_at[:2]
    assert rehearsed.source == "rehearsal"
    assert captured.source != "rehearsal"
    np.testing.assert_allclose(rehearsed.time_s, captured.time_s)


def test_everything_that_follows_a_motion_is_rehearsed_the_network_too(
    looked_at: list[tuple[Recording, Identification]], tmp_path: Path
) -> None:
    drive, board = load_drive(), Board.connect(VirtualBoard())
    study = Plan().study(board, drive, load_network(), tmp_path, Silent())
    identification_motions.rehearse(study, named_trajectory(drive, "sinusoid", None))
    [(_, found)] = looked_at
    assert all(axis.network is not None for axis in found.axes.values())


def test_a_motion_that_tells_nothing_is_not_refused_by_its_rehearsal(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The recording may be better, and says itself what it lacks."""

    def refused(*_: object, **__: object) -> Identification:
        raise DataError("only 3 independent samples show the axis in motion", "move longer")

    drive, board = load_drive(), Board.connect(VirtualBoard())
    study = Plan().study(board, drive, None, tmp_path, Silent())
    monkeypatch.setattr(identification_motions, "identify", refused)
    identification_motions.rehearse(study, named_trajectory(drive, "sinusoid", None))

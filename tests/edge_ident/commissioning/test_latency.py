"""What a profile says where the process that it measures fails."""

from pathlib import Path

import pytest

from edge_ident.commissioning.latency import measure
from edge_ident.errors import BoardError
from edge_ident.estimation.network import load_network
from tests.short_runs import Silent


def test_the_cause_of_a_cold_process_that_fails_is_said(tmp_path: Path) -> None:
    with pytest.raises(BoardError) as caught:
        measure._cold("virtual", None, tmp_path / "no.npz", load_network(), 1, Silent())
    assert "no.npz" in caught.value.cause

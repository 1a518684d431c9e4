"""A folder of eight units, the first of which has too much friction, and a file that is none."""

from pathlib import Path

import pytest

import edge_ident
from tests.fleets import fleet_drives, fleet_recordings, save_fleet


@pytest.fixture(scope="session")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fleet")
    save_fleet(fleet_recordings(fleet_drives(8, seed=3, first_coulomb=1.5), seed=3), folder)
    (folder / "broken.csv").write_text("time_s,x_position_rad\n0,what\n", encoding="utf-8")
    (folder / "notes.md").write_text("recorded on Monday\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def surveyed(
    fleet: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[edge_ident.Survey, Path]:
    """What two processes find in that folder, and where it is written."""
    output = tmp_path_factory.mktemp("output")
    return edge_ident.survey(fleet, jobs=2, output=output), output

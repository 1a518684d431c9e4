"""Where the measured recordings lie."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def measured_data() -> Path:
    """Folder of real recordings: EDGE_IDENT_DATA, else ../shared/data beside the checkout."""
    given = os.environ.get("EDGE_IDENT_DATA")
    folder = Path(given) if given else Path(__file__).parents[2] / "shared" / "data"
    if not (folder / "emps_train.csv").is_file():
        pytest.skip(f"no recordings in {folder}; set EDGE_IDENT_DATA")
    return folder

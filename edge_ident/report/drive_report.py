"""A drive description as a document."""

import tomllib
from pathlib import Path
from typing import Any

from edge_ident.commissioning.described_drive import DescribedDrive
from edge_ident.drive.description import drive_text


def drive_document(made: DescribedDrive, file: Path) -> dict[str, Any]:
    """Schema edge-ident/drive/1: under `drive` the tables and keys of the file.

    Parameters
    ----------
    made : DescribedDrive
    file : Path
        Where the description was written.
    """
    return {
        "schema": "edge-ident/drive/1",
        "file": str(file),
        "drive": tomllib.loads(drive_text(made.drive, made.origins)),
        "assumed": list(made.assumed),
    }

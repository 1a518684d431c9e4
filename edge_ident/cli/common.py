"""What the commands that talk to a board still take from one place."""

from pathlib import Path
from typing import Any

import edge_ident
from edge_ident.cli.command import UNTRUSTED, command
from edge_ident.cli.messages import say
from edge_ident.cli.options import (
    BaudRate,
    Device,
    DriveFile,
    Json,
    ModelFile,
    NetworkFile,
    Output,
    Precision,
    Seed,
    deliver,
    given_model,
    save_result_model,
)
from edge_ident.cli.progress import shown_progress

__all__ = [
    "UNTRUSTED",
    "BaudRate",
    "Device",
    "DriveFile",
    "Json",
    "ModelFile",
    "NetworkFile",
    "Output",
    "Precision",
    "Seed",
    "built_in_or_given_network",
    "deliver",
    "given_model",
    "guarded",
    "leave_model",
    "say",
    "shown_progress",
]

guarded = command


def built_in_or_given_network(path: Path | None, precision: Any) -> Any:
    """Load the network that the options name."""
    return edge_ident.load_network(precision, path)


def leave_model(found: Any, file: Path, known: Any, folder: Path) -> None:
    """Write the model of an identification."""
    save_result_model(found.model, [file], folder, known)

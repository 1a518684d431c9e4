"""A run on a simulated drive, put together without a board."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import edge_ident
from edge_ident.commissioning.capture import Capture
from edge_ident.commissioning.identification_motions import CAPTURE_FILE, IdentificationMotion
from edge_ident.commissioning.rounds import VERIFICATION_FILE
from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.separation import Separation
from edge_ident.commissioning.verification import GainChange, Tracking, Verification
from edge_ident.drive.description import load_drive
from edge_ident.report.run_documents import run_document
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import save_recording
from firmware_interface.board_types import BoardIdentity

BOARD = BoardIdentity("1.0.0", 4711, 1, 0.0025, 0.0005, 8400, 0.004)
TRACKING = Tracking(0.0824, 0.00605, 0.00165, 0.00165, count_rad=0.000748)


def closer(recording: Recording) -> Recording:
    """The same motion, followed a hundred times closer."""
    axes = {
        name: replace(axis, position=axis.reference + (axis.position - axis.reference) / 100.0)
        for name, axis in recording.axes.items()
        if axis.reference is not None
    }
    return replace(recording, axes=axes)


def run(folder: Path, *, confirmed: bool = True) -> tuple[Outcome, dict[str, Any]]:
    """An outcome and its document, with both recordings in the folder.

    Parameters
    ----------
    folder : Path
    confirmed : bool
        Otherwise a trial run, which writes nothing.
    """
    recording = edge_ident.simulate()
    found = edge_ident.identify(recording)
    designs = dict(edge_ident.design_gains(found.model).axes)
    soft = {
        name: replace(design.gains, proportional=30.0, inertia_feedforward=0.0)
        for name, design in designs.items()
    }
    save_recording(recording, folder / CAPTURE_FILE)
    change = GainChange(False, dry_run=True)
    if confirmed:
        save_recording(closer(recording), folder / VERIFICATION_FILE)
        change = GainChange(True, False, Verification(dict.fromkeys(designs, TRACKING)), {})
    capture = Capture(recording, 0, 20, 0.1, {})
    first = IdentificationMotion(CAPTURE_FILE, load_drive().trajectory(), capture, found)
    outcome = Outcome(
        capture=capture,
        identification=found,
        designs=designs,
        gains_before=soft,
        change=change,
        stored=False,
        conclusion="new gains confirmed" if confirmed else "dry run: nothing was written",
        timing_ms={"motion": 21855.0, "last_sample_to_verified": 31.4},
        separation=Separation((first,)),
        file_after=VERIFICATION_FILE if confirmed else "",
    )
    return outcome, run_document(outcome, BOARD, edge_ident.load_network(), folder)

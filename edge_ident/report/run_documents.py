"""A run and a latency profile as JSON documents (schemas edge-ident/*/1)."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from edge_ident.commissioning.capture import Capture
from edge_ident.commissioning.homing import Held, Homing
from edge_ident.commissioning.identification_motions import CAPTURE_FILE
from edge_ident.commissioning.latency import TARGET_MS, Profile, spread
from edge_ident.commissioning.rounds import Round
from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.verification import GainChange
from edge_ident.estimation.network import Network
from edge_ident.model.model import PARAMETERS
from edge_ident.report.board_answer_report import board_answer_document
from edge_ident.report.documents import design_document, identification_document
from edge_ident.report.promise_report import commit_document, promise_document
from edge_ident.report.run_motions import motions_document
from edge_ident.support.documents import file_sha256
from edge_ident.support.version import VERSION
from firmware_interface.board import BoardIdentity

_SHOWN_RAD: Final = 5e-5
"""Half of the last digit that is printed."""


def run_document(
    outcome: Outcome, identity: BoardIdentity, network: Network, folder: Path
) -> dict[str, Any]:
    """Schema edge-ident/run/1, with the hashes that tie it to its capture and network."""
    capture = folder / CAPTURE_FILE
    return {
        "schema": "edge-ident/run/1",
        "answer": _answer(outcome),
        "identification": identification_document(outcome.identification),
        "designs": {name: design_document(design) for name, design in outcome.designs.items()},
        "gains_before": {
            name: dataclasses.asdict(gains) for name, gains in outcome.gains_before.items()
        },
        "verification": _verification(outcome.change),
        "confirmed": outcome.confirmed,
        "unchanged": outcome.change is not None and outcome.change.unchanged,
        "dry_run": outcome.change is not None and outcome.change.dry_run,
        "promise": None if outcome.change is None else promise_document(outcome.change.promise),
        "contradicted": {} if outcome.change is None else dict(outcome.change.contradicted),
        "board_identification": board_answer_document(outcome),
        "commit": commit_document(outcome.change),
        "writes": [_round(one) for one in outcome.rounds if one.change.verification is not None],
        "stored": outcome.stored,
        "conclusion": outcome.conclusion,
        "capture": {
            "file": str(capture),
            "sha256": file_sha256(capture),
            "samples": len(outcome.capture.recording.time_s),
            "pages": outcome.capture.pages,
            "tail_s": outcome.capture.tail_s,
        },
        "motions": motions_document(outcome.separation.motions, folder),
        "motions_ended": outcome.separation.ended,
        "until": None if outcome.early is None else dataclasses.asdict(outcome.early),
        "network_sha256": network.sha256,
        "board": dataclasses.asdict(identity),
        "version": VERSION,
        "timing_ms": {name: round(ms, 3) for name, ms in outcome.timing_ms.items()},
    }


def _answer(outcome: Outcome) -> dict[str, Any]:
    """Both verdicts: are the parameters known, and are new gains better."""
    found, answer = outcome.identification, outcome.answer
    return {
        "ending": answer.ending.value,
        "good": answer.ending.good,
        "trusted": found.trusted,
        "consistent": found.consistent,
        "axes": {
            name: {
                "parameters": {
                    parameter: {"value": value, "std": std}
                    for parameter, value, std in zip(
                        PARAMETERS,
                        axis.model.estimate.parameters.tolist(),
                        axis.model.estimate.std.tolist(),
                        strict=True,
                    )
                },
                "known": list(axis.known),
                "unknown": list(axis.unknown),
                "fall": None if axis.tracking is None else axis.tracking.fall,
            }
            for name, axis in answer.axes.items()
        },
    }


def _round(one: Round) -> dict[str, Any]:
    """One set of gains that was written, measured against those in force then."""
    return {
        "designs": {name: design_document(design) for name, design in one.designs.items()},
        "verification": _verification(one.change),
        "confirmed": one.change.confirmed,
        "promise": promise_document(one.change.promise),
        "commit": commit_document(one.change),
        "conclusion": one.change.conclusion,
        "file": one.file,
    }


def _verification(change: GainChange | None) -> dict[str, Any] | None:
    if change is None or change.verification is None:
        return None
    return {
        axis: {
            "tracking_rms_before_rad": tracking.before_rad,
            "tracking_rms_after_rad": tracking.after_rad,
            "ratio": tracking.ratio,
            "fall": tracking.fall,
            "count_rad": tracking.count_rad,
            "liveliness": tracking.liveliness,
            "repeatability_rad": tracking.repeatability_rad,
            "resolved_rad": tracking.resolved_rad,
            "machine_changed": tracking.machine_changed,
            "verdict": tracking.verdict,
        }
        for axis, tracking in change.verification.axes.items()
    }


def capture_document(capture: Capture, file: Path) -> dict[str, Any]:
    """Schema edge-ident/capture/1: what was recorded and where it lies."""
    return {
        "schema": "edge-ident/capture/1",
        "file": str(file),
        "samples": len(capture.recording.time_s),
        "pages": capture.pages,
        "tail_s": capture.tail_s,
        "tracking_rms_rad": capture.tracking_rms_rad,
    }


def home_document(homing: Homing) -> dict[str, Any]:
    """Schema edge-ident/home/1: where each axis came from and where it stands."""
    return {
        "schema": "edge-ident/home/1",
        "axes": {axis: dataclasses.asdict(way) for axis, way in homing.ways.items()},
        "time_s": homing.time_s,
    }


def home_lines(homing: Homing) -> list[str]:
    """The same for a person, a line for each axis, with what is left of its way if that shows."""
    lines = []
    for axis, way in homing.ways.items():
        left = f", {way.left_rad:.4f} rad from {way.to_rad:.4f}" * (way.left_rad >= _SHOWN_RAD)
        lines.append(f"{axis}: {way.from_rad:.4f} → {way.reached_rad:.4f} rad{left}")
    return lines


def hold_document(held: Mapping[str, Held]) -> dict[str, Any]:
    """Schema edge-ident/hold/1: how far each axis was pushed, and what held it."""
    return {
        "schema": "edge-ident/hold/1",
        "axes": {axis: dataclasses.asdict(one) for axis, one in held.items()},
    }


def profile_document(profile: Profile) -> dict[str, Any]:
    """Schema edge-ident/profile/1: percentiles in ms by start, precision and stage."""
    return {
        "schema": "edge-ident/profile/1",
        "device": profile.device,
        "machine": profile.machine,
        "repetitions": profile.repetitions,
        "target_ms": TARGET_MS,
        "tail_ms": profile.tail_ms,
        "stop_ms": profile.stop_ms,
        "ways_ms": {
            way: dataclasses.asdict(spread(times)) for way, times in profile.ways_ms.items()
        },
        "runs": [
            {
                "start": run.start,
                "precision": run.precision,
                "graph": run.graph,
                "stages_ms": {
                    stage: dataclasses.asdict(spread(times))
                    for stage, times in run.stages_ms.items()
                },
                "within_target": profile.within_target(run),
            }
            for run in profile.runs
        ],
        "faster_precision": profile.faster_precision,
        "verdict": profile.verdict,
    }

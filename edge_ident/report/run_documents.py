"""A run and a latency profile as JSON documents (schemas edge-ident/*/1), and what to do next."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from edge_ident.commissioning import board_answer, gain_transfer, latency, rounds, verification
from edge_ident.commissioning.capture import Capture
from edge_ident.commissioning.homing import Held, Homing
from edge_ident.commissioning.identification_motions import CAPTURE_FILE, IdentificationMotion
from edge_ident.commissioning.run import Ending, Outcome
from edge_ident.estimation.network import Network
from edge_ident.experiment.result import QUANTITIES, question
from edge_ident.identification.result import AxisIdentification
from edge_ident.model.model import PARAMETERS
from edge_ident.report.documents import design_document, identification_document
from edge_ident.report.findings import blocking_steps, distinct, look_at
from edge_ident.report.gains import commit_document, promise_document
from edge_ident.report.plan import pair_documents, uses_document
from edge_ident.support import documents, version
from firmware_interface import board, registers
from firmware_interface.motion import reference

_SHOWN_RAD: Final = 5e-5  # half of the last digit that is printed


def run_document(
    outcome: Outcome, identity: board.BoardIdentity, network: Network, folder: Path
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
            "sha256": documents.file_sha256(capture),
            "samples": len(outcome.capture.recording.time_s),
            "pages": outcome.capture.pages,
            "tail_s": outcome.capture.tail_s,
        },
        "motions": [_motion(made, folder) for made in outcome.separation.motions],
        "motions_ended": outcome.separation.ended,
        "until": None if outcome.early is None else dataclasses.asdict(outcome.early),
        "network_sha256": network.sha256,
        "board": dataclasses.asdict(identity),
        "version": version.VERSION,
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


def _round(one: rounds.Round) -> dict[str, Any]:
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


def _verification(change: verification.GainChange | None) -> dict[str, Any] | None:
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


def profile_document(profile: latency.Profile) -> dict[str, Any]:
    """Schema edge-ident/profile/1: percentiles in ms by start, precision and stage."""
    return {
        "schema": "edge-ident/profile/1",
        "device": profile.device,
        "machine": profile.machine,
        "repetitions": profile.repetitions,
        "target_ms": latency.TARGET_MS,
        "tail_ms": profile.tail_ms,
        "stop_ms": profile.stop_ms,
        "ways_ms": {
            way: dataclasses.asdict(latency.spread(times)) for way, times in profile.ways_ms.items()
        },
        "runs": [
            {
                "start": run.start,
                "precision": run.precision,
                "graph": run.graph,
                "stages_ms": {
                    stage: dataclasses.asdict(latency.spread(times))
                    for stage, times in run.stages_ms.items()
                },
                "within_target": profile.within_target(run),
            }
            for run in profile.runs
        ],
        "faster_precision": profile.faster_precision,
        "verdict": profile.verdict,
    }


# What was moved to find out what is wrong.

_LOOKS_PER_S = 100


def _motion(made: IdentificationMotion, folder: Path) -> dict[str, Any]:
    plan = made.plan
    return {
        "file": made.file,
        "sha256": documents.file_sha256(folder / made.file),
        "designed": plan is not None,
        "duration_s": made.duration_s,
        "recorded_s": made.trajectory.duration_s,
        "purpose": purpose(made),
        "peaks": peaks(made),
        "limits": {} if plan is None else {n: uses_document(use) for n, use in plan.axes.items()},
        "pairs": [] if plan is None else pair_documents(plan.pairs),
        "axes": {name: _known_after(axis) for name, axis in made.found.axes.items()},
        "ruled_out": {name: list(effects) for name, effects in (made.ruled_out or {}).items()},
    }


def _known_after(axis: AxisIdentification) -> dict[str, Any]:
    """Verdict and possible causes once the motion is recorded."""
    diagnosis = axis.diagnosis
    if diagnosis is None:
        return {"verdict": "adequate", "causes": [], "rivals": {}, "suspected": []}
    return {
        "verdict": diagnosis.verdict.value,
        "causes": distinct(cause.term.effect for cause in diagnosis.causes),
        "rivals": {
            cause.term.effect: [other.effect for other in cause.inseparable]
            for cause in diagnosis.causes
        },
        "suspected": distinct(cause.term.effect for cause in diagnosis.suspected),
    }


def purpose(made: IdentificationMotion) -> dict[str, list[str]]:
    """What a motion was made to settle, by axis."""
    found = {name: list(reasons) for name, reasons in made.sought.items()}
    for pair in () if made.plan is None else made.plan.pairs:
        if pair.separated:
            found.setdefault(pair.axis, []).append(question(pair))
    return found


def peaks(made: IdentificationMotion) -> dict[str, dict[str, float]]:
    """Largest travel from zero, speed and acceleration as commanded, and effort as recorded."""
    trajectory, found = made.trajectory, {}
    times = np.arange(0.0, trajectory.duration_s, 1.0 / _LOOKS_PER_S)
    for name, motion in trajectory.axes.items():
        way = reference(motion, times, trajectory.lead_in_s, 0.0)
        effort = made.capture.recording.axes[name].effort
        values = (way.position_rad, way.velocity_rad_s, way.acceleration_rad_s2, effort)
        found[name] = {
            field: float(np.max(np.abs(value)))
            for (_, field, _), value in zip(QUANTITIES, values, strict=True)
        }
    return found


# What the board identified by itself, as part of a run's document.


def board_answer_document(outcome: Outcome) -> dict[str, Any] | None:
    """The field `board_identification` of schema edge-ident/run/1; null without a network."""
    answer = outcome.board
    if answer is None:
        return None
    return {
        "state": answer.state.name,
        "network": f"{answer.network:08x}",
        "axes": {
            name: _axis(axis, outcome.identification.axes[name])
            for name, axis in answer.axes.items()
        },
    }


def _axis(answer: board_answer.AxisAnswer, own: AxisIdentification) -> dict[str, Any]:
    identified = answer.board.reason is registers.IdentificationReason.NONE
    again = answer.recomputed
    return {
        "verdict": answer.verdict.value,
        "said": answer.sentence,
        "reason": answer.board.reason.name,
        "images": answer.board.images,
        "relative_residual": answer.board.relative_residual if identified else None,
        "deviations": answer.deviations if identified else None,
        "parameters": {
            name: {
                "value": answer.board.parameters[i],
                "std": None if answer.std is None else float(answer.std[i]),
                "difference": float(answer.difference[i]),
                "recomputed": None if again is None else float(again[i]),
                "unit": own.units[i],
            }
            for i, name in enumerate(PARAMETERS)
        }
        if identified
        else None,
    }


# What to do next after a run; the terminal and the page say the same.

_VIRTUAL: Final = "virtual"  # the device that ends with the command, and its gains with it


def run_steps(outcome: Outcome, device: str | None = None) -> list[str]:
    """After a run, of all axes: what to do with the gains, and where to look at the machine.

    Parameters
    ----------
    outcome : Outcome
    device : str, optional
        The board's, as --device names it.
    """
    axes = outcome.identification.axes
    if outcome.answer.ending is Ending.CONTRADICTORY:
        return distinct([step for axis in axes.values() for step in blocking_steps(axis.findings)])
    return [
        *(_look_at(name, outcome) for name in axes if _to_adjust(name, outcome)),
        _gains(outcome, device),
    ]


def axis_steps(axis: AxisIdentification, outcome: Outcome, device: str | None = None) -> list[str]:
    """After a run, of one axis."""
    if outcome.answer.ending is Ending.CONTRADICTORY:
        steps = blocking_steps(axis.findings)
        return steps or ["correct what is wrong on the other axis, then run again"]
    return [_gains(outcome, device)]


def _gains(outcome: Outcome, device: str | None) -> str:
    """What to do with gains that were designed."""
    change = outcome.change
    if change is None or change.dry_run:
        promise = None if change is None else change.promise
        if promise is not None and not promise.worth_a_write:
            return "nothing: the board's gains are as good"
        return "run it again without --dry-run to write these gains"
    if change.next_step:
        return change.next_step
    old = f"the old gains are in {gain_transfer.BACKUP_FILE}"
    if device == _VIRTUAL:
        return f"run a virtual board that keeps its gains: edge-ident board --pty; {old}"
    if outcome.confirmed and not outcome.stored:
        where = f" --device {device}" if device else ""
        return f"keep the new gains over a power cycle: edge-ident gains store{where}; {old}"
    return f"nothing; {old}"


def _to_adjust(name: str, outcome: Outcome) -> bool:
    """Whether a diagnosis names a part of the machine, and no motion contradicts it."""
    found, change = outcome.identification.axes[name].diagnosis, outcome.change
    contradicted = change is not None and name in change.contradicted
    return found is not None and bool(found.causes) and not contradicted


def _look_at(name: str, outcome: Outcome) -> str:
    found = outcome.identification.axes[name].diagnosis
    assert found is not None
    return f"{look_at(name, found.causes)}; the page of the run says why"

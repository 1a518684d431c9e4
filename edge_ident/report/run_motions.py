"""How a run found out what is wrong: each identification motion, and what it ruled out."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from edge_ident.commissioning.identification_motions import IdentificationMotion
from edge_ident.commissioning.separation import Separation
from edge_ident.experiment.result import QUANTITIES, AxisUse, question
from edge_ident.identification.result import AxisIdentification
from edge_ident.report.view import Grid
from edge_ident.support.documents import file_sha256, finite
from edge_ident.support.words import listed, spoken
from firmware_interface.motion import Staircase, reference

_LOOKS_PER_S = 100


def motions_document(motions: Iterable[IdentificationMotion], folder: Path) -> list[dict[str, Any]]:
    """Field `motions` of schema edge-ident/run/1.

    Parameters
    ----------
    motions : iterable of IdentificationMotion
    folder : Path
        Of the run.
    """
    return [_motion(made, folder) for made in motions]


def uses_document(use: AxisUse) -> dict[str, dict[str, float | None]]:
    """What a motion asks of an axis; infinite limits are null."""
    return {
        name: {quantity: finite(value) for quantity, value in of.items()}
        for name, of in asdict(use).items()
    }


def _motion(made: IdentificationMotion, folder: Path) -> dict[str, Any]:
    plan = made.plan
    return {
        "file": made.file,
        "sha256": file_sha256(folder / made.file),
        "designed": plan is not None,
        "duration_s": made.duration_s,
        "recorded_s": made.trajectory.duration_s,
        "purpose": purpose(made),
        "peaks": peaks(made),
        "limits": {} if plan is None else {n: uses_document(use) for n, use in plan.axes.items()},
        "pairs": [
            {**asdict(pair), "separated": pair.separated, "separable": pair.separable}
            for pair in (() if plan is None else plan.pairs)
        ],
        "axes": {name: _after(axis) for name, axis in made.found.axes.items()},
        "ruled_out": {name: list(effects) for name, effects in (made.ruled_out or {}).items()},
    }


def _after(axis: AxisIdentification) -> dict[str, Any]:
    """Verdict and possible causes once the motion is recorded."""
    diagnosis = axis.diagnosis
    if diagnosis is None:
        return {"verdict": "adequate", "causes": [], "rivals": {}, "suspected": []}
    return {
        "verdict": diagnosis.verdict.value,
        "causes": _effects(cause.term.effect for cause in diagnosis.causes),
        "rivals": {
            cause.term.effect: [other.effect for other in cause.inseparable]
            for cause in diagnosis.causes
        },
        "suspected": _effects(cause.term.effect for cause in diagnosis.suspected),
    }


def _effects(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


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


def kind(made: IdentificationMotion) -> str:
    """What a motion is, in a few words."""
    stairs = any(isinstance(motion, Staircase) for motion in made.trajectory.axes.values())
    shape = "staircase" if stairs else "sum of sines"
    return f"{'designed ' if made.plan else ''}{shape}, {made.duration_s:.0f} s"


def what_for(made: IdentificationMotion) -> str:
    """What a motion was for, in words."""
    asked = _by_axis(purpose(made))
    return asked or "the first look"


def what_it_showed(made: IdentificationMotion) -> str:
    """What is known once a motion is recorded, in words."""
    return "; ".join(f"{name}: {_shown(axis)}" for name, axis in made.found.axes.items())


def what_it_ruled_out(made: IdentificationMotion) -> str:
    """Possible causes of before that are none any more, in words."""
    gone = {name: list(map(spoken, effects)) for name, effects in (made.ruled_out or {}).items()}
    return _by_axis(gone)


def motions_grid(separation: Separation) -> Grid:
    """How it was found out: a row for each identification motion."""
    rows = [
        (
            f"{made.file}\n{kind(made)}",
            what_for(made),
            what_it_showed(made),
            what_it_ruled_out(made),
        )
        for made in separation.motions
    ]
    headings = ("motion", "what it was for", "what is known then", "ruled out")
    return Grid("how it was found out", headings, rows, note=separation.ended)


def _by_axis(said: Mapping[str, list[str]]) -> str:
    return "; ".join(f"{name}: {listed(parts)}" for name, parts in said.items() if parts)


def _shown(axis: AxisIdentification) -> str:
    diagnosis = axis.diagnosis
    if diagnosis is None:
        return "the base model is enough"
    parts = []
    for cause in diagnosis.causes:
        rivals = [spoken(other.effect) for other in cause.inseparable]
        parts.append(" or ".join([spoken(cause.term.effect), *rivals]))
    suspected = _effects(spoken(cause.term.effect) for cause in diagnosis.suspected)
    said = [f"{diagnosis.verdict.value}, {listed(_effects(parts)) or 'no cause'}"]
    return ", ".join(said + [f"{name} suspected" for name in suspected])

"""Axes to design motions for, without a diagnosis of seconds."""

from dataclasses import replace
from functools import cache

import numpy as np

from edge_ident.diagnosis.result import Alternative, AxisDiagnosis, Cause, Diagnosis
from edge_ident.drive.description import Drive, load_drive
from edge_ident.experiment.design import AxisCase, axis_case
from edge_ident.experiment.limits import Allowed, Loops, Use
from edge_ident.model.effects import named
from edge_ident.model.model import Term
from edge_ident.signals.recording import Recording
from tests.planned import Hidden, diagnosed, hidden

LEAD_IN_S = 9.0


@cache
def hiding(effect: str) -> Hidden:
    return hidden(effect, 1, seed=5)


@cache
def rival_pair(effect: str, alternative: str) -> tuple[Recording, Diagnosis]:
    """A drive that hides an effect, beside which one alternative is fitted."""
    recording = hiding(effect).recordings[0]
    return recording, diagnosed(recording, effect, alternative)


def one_axis() -> Drive:
    drive = load_drive()
    return replace(drive, axes={"x": drive.axes["x"]})


def case_of(recording: Recording, diagnosis: Diagnosis, drive: Drive | None = None) -> AxisCase:
    drive = one_axis() if drive is None else drive
    limit = Use.of_drive(drive.axes["x"])
    allowed = Allowed(limit, Loops.unknown(), limit.speed_rad_s)
    duration_s = drive.trajectory().duration_s
    return axis_case("x", diagnosis.axes["x"], [recording], drive, allowed, duration_s, LEAD_IN_S)


def term(effect: str, **values: float) -> Term:
    """A term; what is not named is zero, or the effect's default."""
    every = {p.name: p.default or 0.0 for p in named(effect).parameters}
    return Term(effect, {**every, **values})


def cause(found: Term, *alternatives: Term) -> Cause:
    rivals = tuple(Alternative(t.effect, False, "as small", "", t) for t in alternatives)
    return Cause(found, 0.1, (0.1, 0.1), 0.1, rivals, "", "")


def supposed(
    recording: Recording, diagnosis: Diagnosis, first: Term, second: Term | None
) -> Diagnosis:
    """The diagnosis of a sound drive, with two rivals that somebody supposes."""
    axis: AxisDiagnosis = diagnosis.axes["x"]
    base = axis.model.terms[:1]
    if second is None:
        found = replace(axis, causes=(), suspected=(cause(first),))
        found = replace(found, model=replace(axis.model, terms=base))
    else:
        found = replace(axis, causes=(cause(first, second),), suspected=())
        found = replace(found, model=replace(axis.model, terms=(*base, first)))
    return Diagnosis({"x": found}, (), {})


def smallest(distances: np.ndarray, needed: np.ndarray) -> float:
    return float(np.min(distances / needed))

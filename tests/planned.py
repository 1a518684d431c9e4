"""Plans for drives of the independent plant: what they hide, and whether a motion keeps the limits.

A full diagnosis takes seconds. So the rivals are fitted alone: the hidden effect and one of its
alternatives, each at its best on the recording.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.account import Missed, fitted_curves
from edge_ident.diagnosis.fit.candidates import base_regressor, candidates, grid, regressors
from edge_ident.diagnosis.fit.candidates import term as term_of
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.fit.held_out import standard_deviations
from edge_ident.diagnosis.fit.linear import solve_within
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.fit.summary import model_fit, traces
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.result import Alternative, AxisDiagnosis, Cause, Diagnosis
from edge_ident.diagnosis.select.search import excited
from edge_ident.drive.description import Drive, DriveAxis, load_drive
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.motion import Trajectory, reference, stop_duration_s, stopping_reference
from firmware_interface.plant import (
    SAMPLE_S,
    Drives,
    Effect,
    Electronics,
    Motion,
    Noise,
    Recordings,
    draw,
    draw_drives,
    paper,
    simulate,
)
from firmware_interface.plant.drives import LEAD, TAIL

Array = NDArray[np.float64]

_TEMPLATE = AxisModel((Term(BASE, dict.fromkeys(PARAMETERS, 0.0)),))
_SETTLING_S = 1.0
_MOTION, _JOLT = 40, 8
"""Samples over which accelerations are averaged."""
_LEAST = 0.1
"""Effort of an alternative, of the cause's, below which it is none."""


@dataclass(frozen=True)
class Hidden:
    """Drives of one axis that hide an effect, as the paper's motion records them.

    Attributes
    ----------
    drives : Drives
    effects : tuple of Effect
    recordings : tuple of Recording
        One for each drive.
    accelerations : (B,) array
        Peaks of the simulated machines in their recordings, means over 20 ms.
    """

    drives: Drives
    effects: tuple[Effect, ...]
    recordings: tuple[Recording, ...]
    accelerations: Array


def hidden(
    name: str, count: int, seed: int, strength: float = 0.75, motion: Motion | None = None
) -> Hidden:
    """Drives that hide an effect."""
    motion = paper() if motion is None else motion
    motion = replace(
        motion,
        position=motion.position[..., :1],
        velocity=motion.velocity[..., :1],
        acceleration=motion.acceleration[..., :1],
    )
    drives = draw_drives(count, seed, axes=1)
    effects = draw([name], drives, motion, seed, strength=strength)
    made = simulate(
        drives, motion, effects=effects, noise=Noise(0.01), seed=seed, steps_per_sample=5
    )
    recordings = tuple(_recording(made, k) for k in range(count))
    return Hidden(drives, effects, recordings, _accelerations(made, _JOLT))


def _accelerations(made: Recordings, samples: int) -> Array:
    """Largest mean acceleration over some samples."""
    change = np.diff(made.true_velocity[:, 0], axis=-1) / SAMPLE_S
    return np.asarray(np.max(np.abs(_mean_over(change, samples)), axis=-1))


def _recording(made: Recordings, drive: int) -> Recording:
    axis = AxisRecord(made.position[drive, 0], made.effort[drive, 0], "rad", "N*m")
    return Recording(made.time_s, {"x": axis}, "plant", float(made.effort_shift_s[drive]))


def diagnosed(recording: Recording, cause: str, *alternatives: str) -> Diagnosis:
    """A cause with inseparable alternatives, each fitted alone.

    An alternative that explains hardly anything is left out; where none is left, the cause is only
    suspected.
    """
    data = prepare_axis([recording], "x")
    start = fit(data, _TEMPLATE, np.array([1.0, 0.0, 0.0, 0.0]), ())
    found = [fitted_term(data, start.axis, name) for name in (cause, *alternatives)]
    pairs = [one for one in found if one is not None]
    sizes = [rms(regressed(data, start.axis, term)) for _, term in pairs]
    terms = [t for (_, t), size in zip(pairs, sizes, strict=True) if size > _LEAST * sizes[0]]
    floor = noise_floor(data, start)
    estimate = model_fit(data, start, standard_deviations(data, start))
    rivals = tuple(Alternative(t.effect, False, "as small", "", t) for t in terms[1:])
    own = Cause(terms[0], 0.1, (0.1, 0.1), 0.1, rivals, "", "")
    known = pairs[0] if rivals else start.axis.terms
    axis = AxisDiagnosis(
        verdict=Verdict.EXPLAINED,
        causes=(own,) if rivals else (),
        suspected=() if rivals else (own,),
        refused=(),
        external_vibrations=(),
        converged=True,
        not_testable=(),
        base=estimate,
        extended=estimate,
        noise_floor=floor.rms / rms(data.effort[data.valid]),
        noise_floor_source=floor.source,
        model=replace(start.axis, terms=known),
        budget=fitted_curves(Missed(data, start, floor.rms)).budget,
        cutoff_hz=data.segments[0].cutoff_hz,
        knee_hz=data.segments[0].band.knee_hz,
        traces=traces(data, start, start, []),
    )
    return Diagnosis({"x": axis}, (), {})


def regressed(data: AxisData, axis: AxisModel, term: Term) -> Array:
    """Effort that a term adds to a base model at the compared samples."""
    together = replace(axis, terms=(axis.terms[0], term))
    return np.asarray(data.predicted(together) - data.predicted(axis))[data.valid]


def fitted_term(data: AxisData, axis: AxisModel, name: str) -> tuple[Term, Term] | None:
    """The base term and an effect at the best point of its grid; None where it does not apply."""
    excitation = data.excitation(axis.parameters)
    base = base_regressor(data)[data.valid]
    target = data.effort[data.valid]
    best: tuple[float, Term, Term] | None = None
    for candidate in candidates(data, rotary=True):
        if candidate.effect != name:
            continue
        points = grid(candidate, excitation)
        for k, rows in enumerate(regressors(data, axis, candidate, points)[..., data.valid]):
            names = candidate.form.linear
            bounds = [named(BASE).bounds[n] for n in PARAMETERS]
            bounds += [named(name).bounds[n] for n in names]
            low, high = np.array(bounds).T
            columns = np.column_stack([base, rows.T]) if names else base
            fixed = 0.0 if names else rows[0]
            found = solve_within(columns, target - fixed, low, high).solution
            left = rms(target - fixed - columns @ found)
            linear = dict(zip(names, found[len(PARAMETERS) :].tolist(), strict=True))
            nonlinear = {n: float(values[k]) for n, values in points.items()}
            term = FittedTerm(candidate, nonlinear, linear)
            if not excited(term, excitation):
                continue
            if best is None or left < best[0]:
                own = dict(zip(PARAMETERS, found[: len(PARAMETERS)].tolist(), strict=True))
                best = (left, Term(BASE, own), term_of(candidate, nonlinear, linear))
    return None if best is None else best[1:]


def random_limits(found: Hidden, drive: int, seed: int) -> Drive:
    """The description of a drive of one axis with random limits that allow its recording."""
    recording, inertia = found.recordings[drive], float(found.drives.chain.rigid_body[drive, 0, 0])
    rng = np.random.default_rng([seed, 5])
    speed = float(np.exp(rng.uniform(np.log(1.9), np.log(6.0))))
    change = float(np.exp(rng.uniform(np.log(5.0), np.log(60.0))))
    change = max(change, 1.3 * float(found.accelerations[drive]))
    recorded = float(np.max(np.abs(recording.axes["x"].effort)))
    effort = recorded * rng.uniform(1.3, 2.0) + inertia * change * rng.uniform(0.0, 1.5)
    built_in = load_drive()
    axis: DriveAxis = replace(
        built_in.axes["x"],
        travel_limit_rad=float(rng.uniform(6.5, 15.0)),
        speed_limit_rad_s=speed,
        acceleration_limit_rad_s2=change,
        effort_limit_nm=float(effort),
    )
    return replace(built_in, axes={"x": axis})


@dataclass(frozen=True)
class Peaks:
    """Largest absolute values of each of B drives, (B,) each, of the simulated machine.

    Attributes
    ----------
    travel : array
        With the way to a stop.
    speed, acceleration, effort : array
        Accelerations are means over 100 ms.
    jolt : array
        The same over 20 ms: what friction, play and their compensation do at a reversal.
    """

    travel: Array
    speed: Array
    acceleration: Array
    effort: Array
    jolt: Array


def followed(
    found: Hidden, plans: Sequence[Trajectory], stop_speeds: Sequence[float]
) -> tuple[Recordings, Peaks]:
    """Let each drive follow its plan from rest to rest, overshoot included."""
    longest_s = max(p.lead_in_s + p.duration_s for p in plans) + 2.0 + _SETTLING_S
    samples = round(longest_s / SAMPLE_S)
    ways = [_from_rest_to_rest(plan, samples) for plan in plans]
    parts = np.stack([np.stack(way) for way in ways], axis=-1)[..., None]  # (3, N, B, 1)
    still = [np.repeat(parts[:, :1], LEAD, axis=1), np.repeat(parts[:, -1:], TAIL, axis=1)]
    motion = Motion("planned", *np.concatenate([still[0], parts, still[1]], axis=1))
    made = simulate(
        found.drives,
        motion,
        effects=found.effects,
        electronics=Electronics(effort_limit_nm=1e3),
        steps_per_sample=5,
    )
    stops = np.array([stop_duration_s(speed) for speed in stop_speeds])[:, None]
    angle, speed = made.true_angle[:, 0], made.true_velocity[:, 0]
    return made, Peaks(
        np.max(np.maximum(np.abs(angle), np.abs(angle + 0.5 * stops * speed)), axis=-1),
        np.max(np.abs(speed), axis=-1),
        _accelerations(made, _MOTION),
        np.max(np.abs(made.true_command[:, 0]), axis=-1),
        _accelerations(made, _JOLT),
    )


def _mean_over(rows: Array, samples: int) -> Array:
    total = np.cumsum(np.pad(rows, ((0, 0), (1, 0))), axis=-1)
    return np.asarray((total[:, samples:] - total[:, :-samples]) / samples)


def _from_rest_to_rest(plan: Trajectory, samples: int) -> tuple[Array, Array, Array]:
    motion = plan.axes["x"]
    lead, captured = (round(t / SAMPLE_S) for t in (plan.lead_in_s, plan.duration_s))
    times = SAMPLE_S * np.arange(-lead, captured)
    way = reference(motion, times, plan.lead_in_s, 0.0)
    at, speed = float(way.position_rad[-1]), float(way.velocity_rad_s[-1])
    after = SAMPLE_S * np.arange(1, samples - len(times) + 1)
    stop = stopping_reference(at, speed, after, stop_duration_s(speed))
    return (
        np.concatenate([way.position_rad, stop.position_rad]),
        np.concatenate([way.velocity_rad_s, stop.velocity_rad_s]),
        np.concatenate([way.acceleration_rad_s2, stop.acceleration_rad_s2]),
    )

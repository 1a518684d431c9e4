"""A diagnosis made by hand: one axis explained, one adequate, one unexplained."""

from dataclasses import replace

import numpy as np

from edge_ident.diagnosis.error_budget import NOISE, BudgetCurve, BudgetEntry, ErrorBudget
from edge_ident.diagnosis.measures import ModelFit, Traces, Validation, Verdict
from edge_ident.diagnosis.result import (
    Alternative,
    AxisDiagnosis,
    Cause,
    DataFinding,
    Diagnosis,
    NotTestable,
)
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import AxisModel, Estimate, Term, base_axis
from edge_ident.model.motion import Motion
from edge_ident.signals.metrics import compare

PERIOD_S = 0.0025
TRUTH = np.array([0.5, 0.8, 1.2, 0.1])
BIASED = np.array([0.42, 0.95, 1.1, 0.13])
STD = np.array([0.01, 0.005, 0.008, 0.004])
_ALONG = np.linspace(0.0, 2.0, 41)
_RIPPLE = 0.1 * np.sin(6.98 * _ALONG)
_BAND = (_RIPPLE - 0.01, _RIPPLE + 0.01)
BUDGET = ErrorBudget(
    (
        BudgetEntry(
            "position", 0.9, (0.85, 0.95), 0.07,
            (
                BudgetCurve("load", "position", _ALONG, _RIPPLE, *_BAND, "N*m", "rad"),
            ),
            ("torque_ripple",), ("turn",),
        ),
        BudgetEntry(NOISE, 0.1, (0.1, 0.1), 0.02),
    ),
    0.074, 0.05, 6.5, "N*m",
)  # fmt: skip
RIPPLE = Term(
    "torque_ripple",
    {"cosine": 0.2, "sine": -0.1, "period": 0.9},
    {"cosine": 0.01, "sine": 0.01, "period": 0.0005},
)
DIRECTION = Term("asymmetric_friction", {"difference": 0.1}, {"difference": 0.006})


def traces(axis: AxisModel, samples: int = 4000, noise: float = 0.02) -> Traces:
    """A sum of two sines, along which the axis's own terms and noise make the effort."""
    time = PERIOD_S * np.arange(samples)
    position, velocity, acceleration = np.zeros((3, samples))
    for amplitude, rate, phase in ((3.0, 0.9, 0.3), (1.0, 3.1, 1.1)):
        angle = rate * time + phase
        position += amplitude * np.sin(angle)
        velocity += amplitude * rate * np.cos(angle)
        acceleration -= amplitude * rate**2 * np.sin(angle)
    motion = Motion.known(time, position, velocity, acceleration)
    extended = inverse_effort(axis, motion)
    contributions = {
        term.effect: inverse_effort(AxisModel((axis.terms[0], term)), motion)
        - inverse_effort(AxisModel(axis.terms[:1]), motion)
        for term in axis.terms[1:]
    }
    parameters = BIASED if contributions else TRUTH
    turns = np.flatnonzero(np.diff(np.sign(velocity))) + 1
    last = np.concatenate([[0], turns])[np.searchsorted(turns, np.arange(samples), side="right")]
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(position)))])
    return Traces(
        time_s=time,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        effort=extended + np.random.default_rng(1).normal(0.0, noise, samples),
        base_effort=inverse_effort(base_axis(Estimate(parameters, STD)), motion),
        extended_effort=extended,
        contributions=contributions,
        since_reversal=travelled - travelled[last],
        valid=np.abs(velocity) > 0.15,
        file=np.zeros(samples, dtype=np.intp),
        recording=np.zeros(samples, dtype=np.intp),
    )


def axis(verdict: Verdict, *causes: Cause, samples: int = 4000) -> AxisDiagnosis:
    base_term = base_axis(Estimate(TRUTH, STD)).terms[0]
    model = AxisModel((base_term, *(cause.term for cause in causes)))
    seen = traces(model, samples)
    before, after = (
        compare(seen.effort, seen.base_effort),
        compare(seen.effort, seen.extended_effort),
    )
    return AxisDiagnosis(
        verdict=verdict,
        causes=causes,
        refused=(),
        external_vibrations=(),
        converged=True,
        not_testable=(
            NotTestable("backlash", "too few reversals", "a staircase of short moves"),
            NotTestable("presliding_hysteresis", "too few reversals", "a staircase of short moves"),
            NotTestable("load_dependent_friction", "the load is constant", "two payloads"),
        ),
        base=ModelFit(
            Estimate(BIASED if causes else TRUTH, STD),
            before.relative_residual, 1.05 * before.relative_residual, before,
        ),
        extended=ModelFit(
            Estimate(TRUTH, STD), after.relative_residual, 1.05 * after.relative_residual, after
        ),
        noise_floor=0.9 * after.relative_residual,
        noise_floor_source="from the motion's repetition",
        model=model,
        budget=BUDGET,
        cutoff_hz=6.5,
        knee_hz=3.1,
        traces=seen,
    )  # fmt: skip


def ripple() -> Cause:
    return Cause(
        RIPPLE, 0.31, (0.27, 0.35), 0.12,
        (Alternative("encoder_eccentricity", True, "it grows with speed squared", "two speeds"),),
        "effort rises and falls 6.98 times per turn, at all speeds alike",
        "without it the criterion is 412 units worse (a term must gain more than 25 to enter, "
        "and more than 0 to stay)",
    )  # fmt: skip


def friction_by_direction() -> Cause:
    return Cause(
        DIRECTION, 0.12, (0.08, 0.17), 0.05,
        (Alternative("nonlinear_viscous", False, "0.97 alike [so far]", "a faster multisine"),),
        "viscous friction is 12 % larger forward than backward",
        "without it the criterion is 57 units worse (a term must gain more than 25 to enter, "
        "and more than 0 to stay)",
    )  # fmt: skip


def diagnosis(*, doubtful: bool = False, unexplained: bool = False) -> Diagnosis:
    """Axis x explained by two causes, z adequate, and y unexplained where a test asks for it."""
    axes = {
        "x": axis(Verdict.EXPLAINED, ripple(), friction_by_direction()),
        "z": axis(Verdict.ADEQUATE),
    }
    if unexplained:
        axes["y"] = replace(axis(Verdict.PARTLY_EXPLAINED, ripple()), noise_floor=0.002)
    finding = DataFinding("uneven_sampling", "x", "stamps stray by 0.3 sampling periods")
    return Diagnosis(
        axes, (finding,) if doubtful else (), {"x": Validation(0.12, 0.04, 0.05, (0.11, 0.03))}
    )

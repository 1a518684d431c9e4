"""What a term adds beside others is what it changes in the effort of the whole model."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import (
    cached_regressors,
    candidates,
    derivatives,
    regressors,
)
from edge_ident.diagnosis.fit.fitting import fit
from edge_ident.diagnosis.fit.held_out import held_out_residuals
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.inverse import Kept, inverse_effort
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

Array = NDArray[np.float64]
START = np.array([1.0, 0.0, 0.0, 0.0])
STEP = 1e-6

RIGID = Term(BASE, dict(zip(PARAMETERS, (0.5, 0.8, 1.1, 0.2), strict=True)))
ENCODER = Term("encoder_eccentricity", {"cosine": 0.004, "sine": -0.003, "period": 1.3})
RIPPLE = Term("torque_ripple", {"cosine": 0.05, "sine": 0.02, "period": 0.5})
SPRING = Term(
    "coupling_compliance",
    {
        "load_inertia": 0.1, "rate": 40.0, "damping_ratio": 0.1, "deceleration": 0.3,
        "damping_rate": 0.2, "weight": 0.1,
    },
)  # fmt: skip
LOSSES = Term("load_dependent_friction", {"share": 0.2, "guided": 0.5, "moved": 0.7})
DRIFT = Term("gain_drift", {"rate": 0.01})
DEAD = Term("actuator_deadband", {"width": 0.05})
LINEAR = {
    "encoder_eccentricity": ("cosine", "sine"),
    "torque_ripple": ("cosine", "sine"),
    "coupling_compliance": ("load_inertia",),
    "load_dependent_friction": ("share",),
    "gain_drift": ("rate",),
    "actuator_deadband": ("width",),
}
MODELS = {
    "an encoder's error moves all others": (ENCODER, RIPPLE, SPRING),
    "losses follow the base model": (RIPPLE, LOSSES, ENCODER, DEAD),
    "a gain multiplies all others": (RIPPLE, DRIFT, ENCODER),
}


@pytest.fixture(scope="module")
def data() -> AxisData:
    """An axis that swings."""
    t, x, v, a = swing()
    return prepare_axis([recorded(t, x, rigid(v, a), noise=0.01)], "x")


def moved(axis: AxisModel, place: int, name: str) -> AxisModel:
    """The axis with one parameter a step higher."""
    terms = list(axis.terms)
    values = dict(terms[place].values)
    terms[place] = replace(terms[place], values={**values, name: values[name] + STEP})
    return replace(axis, terms=tuple(terms))


@pytest.mark.parametrize("terms", MODELS.values(), ids=MODELS)
def test_derivatives_are_those_of_the_whole_model(data: AxisData, terms: tuple[Term, ...]) -> None:
    axis = AxisModel((RIGID, *terms))
    linear = [LINEAR[t.effect] for t in terms]
    found = np.vstack(derivatives(data, axis, data.predicted(axis), linear)).T
    places = [(0, name) for name in PARAMETERS]
    places += [(k, name) for k, names in enumerate(linear, 1) for name in names]
    base, timing = len(PARAMETERS), len(data.segments)
    columns = [*range(base), *range(base + timing, found.shape[1])]
    for column, place in zip(columns, places, strict=True):
        whole = (data.predicted(moved(axis, *place)) - data.predicted(axis)) / STEP
        assert found[:, column] == pytest.approx(whole, abs=1e-6 * np.max(np.abs(whole)))


@pytest.mark.parametrize("terms", MODELS.values(), ids=MODELS)
@pytest.mark.parametrize("effect", ["torque_ripple", "encoder_eccentricity"])
def test_regressors_are_what_the_whole_model_changes_by(
    data: AxisData, terms: tuple[Term, ...], effect: str
) -> None:
    axis = AxisModel((RIGID, *terms))
    candidate = next(c for c in candidates(data, rotary=True) if c.effect == effect)
    periods = np.array([0.4, 0.9, 1.7])
    found = regressors(data, axis, candidate, {"period": periods})
    for period, rows in zip(periods, found, strict=True):
        for name, row in zip(("cosine", "sine"), rows, strict=True):
            added = Term(effect, {"cosine": 0.0, "sine": 0.0, "period": period, name: STEP})
            more = data.predicted(replace(axis, terms=(*axis.terms, added)))
            whole = (more - data.predicted(axis)) / STEP
            assert row == pytest.approx(whole, abs=1e-6 * np.max(np.abs(whole)))
        kept = cached_regressors(data, axis, candidate, {"period": float(period)})
        # a small amplitude makes rounding a million times as large
        assert kept == pytest.approx(rows, abs=1e-8 * np.max(np.abs(rows)))


def test_what_is_kept_belongs_to_its_motion(data: AxisData) -> None:
    """Two errors of an encoder in turn, and none."""
    other = replace(ENCODER, values={**ENCODER.values, "cosine": -0.002})
    motion, kept = data.segments[0].motion, Kept()
    for movers in ((ENCODER,), (ENCODER,), (other,), (), (ENCODER,), (ENCODER, other)):
        axis = AxisModel((RIGID, *movers, SPRING))
        found, fresh = inverse_effort(axis, motion, kept=kept), inverse_effort(axis, motion)
        assert found == pytest.approx(fresh, abs=1e-12 * np.max(np.abs(fresh)))


def test_what_is_remembered_belongs_to_its_effort(data: AxisData) -> None:
    """Disturbed data share no result with the others."""
    fitted = fit(data, TEMPLATE, START, ())
    assert fit(data, TEMPLATE, START, ()) is fitted
    twice = replace(data, effort=2.0 * data.effort)
    again = fit(twice, TEMPLATE, START, ())
    assert again.base == pytest.approx(2.0 * fitted.base)
    assert held_out_residuals(twice, again) == pytest.approx(2.0 * held_out_residuals(data, fitted))

"""The friction curve is the friction that the axis has, line or not, inside its band."""

import numpy as np
import pytest

import edge_ident
from edge_ident.identification.result import FrictionCurve
from edge_ident.model.measured_curves import ENTRIES, at_entries, entries
from edge_ident.model.model import AxisModel, Model, Term
from edge_ident.report.documents import friction_document

BASE = edge_ident.reduced_model().axes["x"].terms[0]
_, VISCOUS, COULOMB, OFFSET = edge_ident.reduced_model().axes["x"].parameters
TOP = 6.0


def truth(speed: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """Friction and what it has beyond the line."""
    return COULOMB + VISCOUS * speed + np.interp(np.sqrt(speed), np.sqrt(at(TOP)), bend)


def at(top: float) -> np.ndarray:
    return at_entries(0.0, top, finer_at_zero=True)


def curve_of(*terms: Term) -> FrictionCurve:
    model = Model({"x": AxisModel((BASE, *terms))})
    recording = edge_ident.simulate(model, motion="multisine", noise=0.01, seed=1)
    found = edge_ident.identify(recording).axes["x"].friction_curve
    assert found is not None
    return found


def test_a_line_stays_a_line() -> None:
    found = curve_of()
    forward, backward = OFFSET + np.array([1.0, -1.0])[:, None] * truth(found.speed, np.zeros(33))
    assert np.all(np.abs(found.forward - forward) < 2.0 * found.deviation)
    assert np.all(np.abs(found.backward - backward) < 2.0 * found.deviation)


def test_friction_that_bends_without_a_law_is_the_curve() -> None:
    rng = np.random.default_rng(1)
    corners = rng.uniform(-0.35, 0.35, 7)
    bend = np.interp(np.linspace(0.0, 1.0, ENTRIES), np.linspace(0.0, 1.0, 7), corners)
    found = curve_of(Term("friction_over_speed", {"first": 0.0, "last": TOP, **entries(bend)}))
    inside = (found.speed > 0.1) & (found.speed < 0.95 * found.speed[-1])
    true = truth(found.speed, bend)[inside]
    seen = 0.5 * (found.forward - found.backward)[inside]
    assert np.sqrt(np.mean((seen - true) ** 2)) < 0.02 * COULOMB
    line = np.polynomial.Polynomial.fit(found.speed[inside], true, 1)(found.speed[inside])
    assert np.sqrt(np.mean((line - true) ** 2)) > 0.05 * COULOMB, "the truth is no line"


def test_scripts_get_the_curve() -> None:
    document = friction_document(curve_of())
    assert document["unit"] == "N*m"
    assert document["speed"]["unit"] == "rad/s"
    for way in ("forward", "backward"):
        low, values, high = (document[way][key] for key in ("low", "values", "high"))
        assert all(a < b < c for a, b, c in zip(low, values, high, strict=True))
    assert document["forward"]["values"][-1] == pytest.approx(
        COULOMB + OFFSET + VISCOUS * document["speed"]["values"][-1], rel=0.02
    )

"""Static departures without a name come back as curves of the extended model, with their size.

Each hidden curve is a zigzag that no law of the catalogue has. What acts once, or does not come
back, is in no model.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import edge_ident
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.model.measured_curves import ENTRIES, at_entries, entries
from edge_ident.model.model import AxisModel, Model, Term
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]

KNOTS = 7
SIZES = {"friction_over_speed": 0.35, "inertia_over_position": 0.1, "load_over_position": 0.3}
NO_LAW_FITS = ("friction_over_speed", "inertia_over_position")


def zigzag(seed: int, size: float) -> Array:
    corners = np.random.default_rng(seed).uniform(-size, size, KNOTS)
    return np.interp(np.linspace(0.0, 1.0, ENTRIES), np.linspace(0.0, 1.0, KNOTS), corners)


@cache
def sound() -> Recording:
    return edge_ident.simulate(motion="multisine", noise=0.01)


@cache
def hidden(name: str, seed: int = 1, noise_seed: int = 1) -> tuple[Recording, Term]:
    """A recording in closed loop, and what acts in it beside the base model."""
    base = edge_ident.reduced_model().axes["x"].terms[0]
    position = sound().axes["x"].position
    over_speed = name.endswith("speed")
    top = float(np.max(np.abs(np.gradient(position, sound().time_s))))
    first, last = (0.0, top) if over_speed else (float(position.min()), float(position.max()))
    table = entries(zigzag(seed, SIZES[name]))
    term = Term(name, {"first": first, "last": last, **table})
    model = Model({"x": AxisModel((base, term))})
    return edge_ident.simulate(model, motion="multisine", noise=0.01, seed=noise_seed), term


@cache
def diagnosed(name: str) -> AxisDiagnosis:
    return edge_ident.diagnose(hidden(name)[0]).axes["x"]


@pytest.mark.parametrize("name", NO_LAW_FITS)
def test_a_curve_without_a_law_is_in_the_model_with_its_size(name: str) -> None:
    found = diagnosed(name)
    assert (found.verdict, found.causes) == (Verdict.PARTLY_EXPLAINED, ())
    assert [curve.term.effect for curve in found.curves] == [name]
    assert found.explained_share > 0.75
    assert found.extended.fitted < 0.25 * found.base.fitted
    assert found.model.parameters[0] == pytest.approx(0.42957, rel=0.02)


@pytest.mark.parametrize(("name", "seed"), [("friction_over_speed", 2), ("load_over_position", 1)])
def test_laws_that_add_up_to_a_curve_are_not_named(name: str, seed: int) -> None:
    """Two laws of friction, or three waves, leave little of these."""
    found = edge_ident.diagnose(hidden(name, seed)[0]).axes["x"]
    assert (found.verdict, found.causes) == (Verdict.PARTLY_EXPLAINED, ())
    assert [curve.term.effect for curve in found.curves] == [name]
    assert len(found.suspected) >= 2
    assert all("of which no law is assumed" in cause.decision for cause in found.suspected)


def test_the_curve_is_the_hidden_one_beyond_the_base_model() -> None:
    """Inertia at each position: that of the base model and the table, found and hidden."""
    found, (_, term) = diagnosed("inertia_over_position"), hidden("inertia_over_position")
    curve = found.curves[0].term
    at = np.linspace(0.8 * term.values["first"], 0.8 * term.values["last"], 50)
    seen, true = (
        inertia
        + np.interp(
            at,
            at_entries(one.values["first"], one.values["last"]),
            [one.values[f"entry_{k:02d}"] for k in range(ENTRIES)],
        )
        for inertia, one in ((found.model.parameters[0], curve), (0.42957, term))
    )
    assert np.sqrt(np.mean((seen - true) ** 2)) < 0.02


def elsewhere(other: Recording) -> Diagnosis:
    recording, _ = hidden("friction_over_speed")
    return edge_ident.diagnose(recording, validate=other)


def test_a_curve_that_another_recording_shows_predicts_it() -> None:
    other, _ = hidden("friction_over_speed", noise_seed=2)
    found = elsewhere(other)
    assert [curve.term.effect for curve in found.axes["x"].curves] == ["friction_over_speed"]
    assert found.validation["x"].extended < 0.3 * found.validation["x"].base


def test_a_curve_that_another_recording_does_not_show_is_in_no_model() -> None:
    found = elsewhere(replace(sound(), axes={"x": sound().axes["x"]}))
    assert found.axes["x"].curves == ()
    assert found.axes["x"].verdict is Verdict.UNEXPLAINED


def test_what_acts_once_is_no_curve() -> None:
    """Efforts of a tenth that come and go for a moment, at no place and no speed of their own."""
    recording = sound()
    rng, time_s = np.random.default_rng(4), recording.time_s
    moments = rng.uniform(time_s[0], time_s[-1], 12)
    pulses = sum(
        rng.choice([-1.0, 1.0]) * np.exp(-(((time_s - moment) / 0.4) ** 2)) for moment in moments
    )
    axis = recording.axes["x"]
    disturbed = replace(axis, effort=axis.effort + 0.2 * pulses)
    found = edge_ident.diagnose(replace(recording, axes={"x": disturbed}))
    assert found.axes["x"].curves == ()
    assert not found.axes["x"].verdict.complete

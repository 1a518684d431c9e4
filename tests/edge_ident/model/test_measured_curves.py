"""Curves of a model: a table, straight between entries, constant beyond, for one drive or many."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import edge_ident
from edge_ident.model.effects import named
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.measured_curves import ENTRIES, MEASURED, at_entries, entries
from edge_ident.model.model import AxisModel, Model, SupportedRange, Term
from edge_ident.model.motion import Motion

TIME_S = np.linspace(0.0, 2.0, 400)
RNG = np.random.default_rng(5)
TABLE = RNG.normal(size=ENTRIES)


def motion(amplitude: float, rate: float) -> Motion:
    angle = rate * TIME_S
    return Motion.known(
        TIME_S,
        amplitude * np.sin(angle),
        amplitude * rate * np.cos(angle),
        -amplitude * rate**2 * np.sin(angle),
    )


OTHER = motion(0.7, 3.0)
ALONG = replace(motion(0.5, 5.0), source=OTHER)
BY_HAND = {
    "friction_over_speed": (np.abs(ALONG.velocity), ALONG.direction, True),
    "difference_over_speed": (np.abs(ALONG.velocity), 1.0, True),
    "load_over_position": (ALONG.position, 1.0, False),
    "load_over_turn": (np.mod(ALONG.position, 2.0 * np.pi), 1.0, False),
    "friction_over_position": (ALONG.position, ALONG.direction, False),
    "inertia_over_position": (ALONG.position, ALONG.acceleration, False),
    "load_over_other": (OTHER.position, 1.0, False),
    "inertia_over_other": (OTHER.position, ALONG.acceleration, False),
    "coupling_over_other": (OTHER.position, OTHER.acceleration, False),
}


def values(first: float, last: float, table: np.ndarray = TABLE) -> dict[str, float]:
    return {"first": first, "last": last, **entries(table)}


def test_every_curve_is_checked() -> None:
    assert BY_HAND.keys() == MEASURED.keys()


@pytest.mark.parametrize("name", MEASURED)
def test_a_curve_is_its_table_times_its_column(name: str) -> None:
    """The range ends inside the motion's, so that both ends are tested as well."""
    coordinate, column, finer = BY_HAND[name]
    first, last = (0.0, 1.5) if finer else (-0.3, 0.4)
    at = at_entries(first, last, finer_at_zero=finer)
    # between entries over speed, the table is straight in the root of the speed, as the board's is
    shape = np.sqrt if finer else np.asarray
    expected = np.interp(shape(np.clip(coordinate, first, last)), shape(at), TABLE) * column
    effort = named(name).resistance(
        ALONG, {k: np.asarray(v)[None] for k, v in values(first, last).items()}
    )
    np.testing.assert_allclose(effort, expected, atol=1e-12)


@pytest.mark.parametrize("name", MEASURED)
def test_many_drives_at_once_are_each_alone(name: str) -> None:
    tables = RNG.normal(size=(3, ENTRIES))
    each = [values(-0.3, 0.4 + 0.1 * k, table) for k, table in enumerate(tables)]
    together = {key: np.array([one[key] for one in each])[:, None] for key in each[0]}
    found = named(name).resistance(ALONG, together)
    for row, one in zip(found, each, strict=True):
        alone = named(name).resistance(ALONG, {k: np.asarray(v)[None] for k, v in one.items()})
        np.testing.assert_allclose(row, alone, atol=1e-12)


def test_identification_beside_a_known_curve_finds_the_base_parameters(tmp_path: Path) -> None:
    """Simulated in closed loop, saved, read again and compensated."""
    base = edge_ident.reduced_model().axes["x"].terms[0]
    travel = edge_ident.simulate(motion="multisine").axes["x"].position
    curves = (
        Term("friction_over_speed", values(0.0, 5.0, 0.1 * TABLE)),
        Term("load_over_position", values(travel.min(), travel.max(), 0.2 * TABLE)),
    )
    model = Model({"x": AxisModel((base, *curves))})
    edge_ident.save_model(model, tmp_path / "model.json")
    known = edge_ident.load_model(tmp_path / "model.json")
    recording = edge_ident.simulate(known, motion="multisine")
    found = edge_ident.identify(recording, model=known, diagnose=False).axes["x"]
    np.testing.assert_allclose(
        found.estimate.parameters[:3], model.axes["x"].parameters[:3], rtol=0.02
    )


def test_gains_feed_curves_forward() -> None:
    base = edge_ident.reduced_model().axes["x"].terms[0]
    seen = SupportedRange((-1.0, 1.0), (-2.0, 2.0), (-9.0, 9.0), (-3.0, 3.0))
    smooth = np.linspace(0.0, 0.2, ENTRIES)
    curves = (
        Term("friction_over_speed", values(0.0, 2.0, smooth), supported=seen),
        Term("load_over_position", values(-1.0, 1.0, smooth), supported=seen),
    )
    axis = AxisModel((replace(base, supported=seen), *curves))
    gains = edge_ident.design_gains(Model({"x": axis})).axes["x"].gains
    assert max(gains.friction_forward) == pytest.approx(0.2, abs=0.02)
    assert max(gains.load_table) == pytest.approx(0.2, abs=0.02)


def test_a_curve_resists_as_the_inverse_says() -> None:
    base = edge_ident.reduced_model().axes["x"].terms[0]
    without, beside = (
        inverse_effort(AxisModel(terms), ALONG)
        for terms in ((base,), (base, Term("load_over_position", values(-0.5, 0.5))))
    )
    at = at_entries(-0.5, 0.5)
    np.testing.assert_allclose(beside - without, np.interp(ALONG.position, at, TABLE), atol=1e-12)

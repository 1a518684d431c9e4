"""Effects take no more of inertia and Coulomb friction than there is."""

import pytest

from edge_ident.model.inverse import left_by_terms, made_physical
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term


def axis(inertia: float, coulomb: float, *effects: Term) -> AxisModel:
    values = dict(zip(PARAMETERS, (inertia, 0.9, coulomb, 0.1), strict=True))
    return AxisModel((Term(BASE, values, {"inertia": 0.01}), *effects))


LIGHTER = Term("payload_change", {"time": 5.0, "inertia": -0.3, "coulomb_friction": -0.4})


def test_the_least_is_left_after_the_payload_is_gone() -> None:
    left = left_by_terms(axis(0.5, 1.0, LIGHTER))
    assert (left.inertia, left.coulomb_friction) == pytest.approx((0.2, 0.6))
    assert left.physical
    assert not left_by_terms(axis(0.2, 1.0, LIGHTER)).physical
    assert not left_by_terms(axis(0.5, 0.2, LIGHTER)).physical


def test_what_is_missing_is_added_and_said_in_the_deviation() -> None:
    made = made_physical(axis(0.2, 0.1, LIGHTER), 0.001)
    assert made.terms[0].values["inertia"] == pytest.approx(0.301)
    assert made.terms[0].values["coulomb_friction"] == pytest.approx(0.4)
    assert made.terms[0].std["inertia"] == pytest.approx(0.101)
    assert left_by_terms(made).physical


def test_a_physical_axis_stays_as_it_is() -> None:
    sound = axis(0.5, 1.0, LIGHTER)
    assert made_physical(sound, 0.001) == sound


def test_a_part_of_the_friction_is_no_larger_than_the_whole() -> None:
    """It shows at reversals alone, and the whole wherever the axis slides."""
    level = Term("presliding_hysteresis", {"level": 1.01, "distance": 1e-3}, {"level": 0.09})
    made = made_physical(axis(0.3, 0.91, level), 0.001)
    assert made.terms[0].values["coulomb_friction"] == 0.91
    assert made.terms[1].values == pytest.approx({"level": 0.91, "distance": 1e-3})
    assert made.terms[1].std["level"] == pytest.approx(0.1)
    assert left_by_terms(made).physical


def test_an_axis_is_no_surer_than_what_had_to_be_added() -> None:
    found = made_physical(axis(0.2, 0.1, LIGHTER), 0.001).estimate
    assert found.parameters.tolist() == pytest.approx([0.301, 0.9, 0.4, 0.1])
    assert found.std.tolist() == pytest.approx([0.101, 0.0, 0.3, 0.0])

"""What a term names as the source of its effect: an axis, or joints by the sum of their angles."""

import numpy as np
import pytest

from edge_ident.errors import ModelError
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term, acting, sources, turned
from edge_ident.model.motion import Motion
from edge_ident.simulation.machine import Parts

TIME_S = np.linspace(0.0, 4.0, 401)
BASE_TERM = Term(BASE, dict.fromkeys(PARAMETERS, 0.0) | {"inertia": 1.0})
WEIGHT = {"stiffness": 0.0, "curvature": 0.0, "cosine": 0.0, "sine": 0.0, "period": 6.0}


def swung(rate: float) -> Motion:
    angle = rate * TIME_S
    return Motion.known(TIME_S, np.sin(angle), rate * np.cos(angle), -(rate**2) * np.sin(angle))


MOTIONS = {"j1": swung(1.1), "j2": swung(1.7)}


def weighed(source: str) -> AxisModel:
    return AxisModel(
        (BASE_TERM, Term("position_dependent_load", {**WEIGHT, "sum_sine": 2.0}, {}, source))
    )


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("j1", {"j1": 1}),
        ("-j1", {"j1": -1}),
        ("j1 + j2", {"j1": 1, "j2": 1}),
        ("-j1 - x-axis", {"j1": -1, "x-axis": -1}),
        ("left + right", {"left + right": 1}),
    ],
)
def test_a_source_is_read(source: str, found: dict[str, int]) -> None:
    assert dict(acting(source, ("left + right",))) == found


def test_every_sense_of_two_joints_can_be_named() -> None:
    assert list(sources(["j1", "j2"], 1)) == ["j1", "-j1", "j2", "-j2"]
    assert list(sources(["j1", "j2"], 2))[4:] == ["j1 + j2", "j1 - j2", "-j1 + j2", "-j1 - j2"]


@pytest.mark.parametrize(("source", "senses"), [("j1 - j2", (1, -1)), ("-j2", (0, -1))])
def test_the_weight_follows_the_sum_of_the_angles(source: str, senses: tuple[int, int]) -> None:
    own = swung(0.7)
    angle = own.position + senses[0] * MOTIONS["j1"].position + senses[1] * MOTIONS["j2"].position
    effort = inverse_effort(weighed(source), own, MOTIONS)
    assert effort == pytest.approx(own.acceleration + 2.0 * np.sin(angle))


def test_a_simulation_has_the_same_sources() -> None:
    free = AxisModel((BASE_TERM,))
    parts = Parts({"j1": free, "j2": free, "j3": weighed("j1 - j2")}, 1)
    angles = np.array([[0.3], [0.5], [0.7]])
    at = Motion(np.zeros(1), *np.array([angles] * 4), driven=np.zeros((3, 1)))
    (part,) = parts.all
    load = part.effect.load(part.at(at, np.zeros((parts.states, 1))), part.values)
    assert load == pytest.approx(2.0 * np.sin([0.7 + 0.3 - 0.5]))


def test_what_is_no_axis_is_refused() -> None:
    with pytest.raises(ModelError, match=r"j1 \+ j9"):
        inverse_effort(weighed("j1 + j9"), swung(0.7), MOTIONS)
    with pytest.raises(ModelError, match="no other axis is j3"):
        Parts({"j1": AxisModel((BASE_TERM,)), "j3": weighed("j3")}, 1)


@pytest.mark.parametrize(
    ("source", "other"), [("j2", "-j2"), ("-j1 + j2", "-j1 - j2"), ("j2 - j3", "-j2 - j3")]
)
def test_a_joint_that_counts_the_other_way_round(source: str, other: str) -> None:
    assert turned(source, "j2") == other
    assert turned(other, "j2") == source
    assert turned(source, "z") == source

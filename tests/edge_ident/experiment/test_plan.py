"""The designed motion separates better than usual ones, and says what no motion separates."""

import math
from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.result import Diagnosis
from edge_ident.errors import DataError
from edge_ident.experiment.plan import plan_motion
from edge_ident.experiment.search import SineShape
from edge_ident.report.plan import conclusion, inseparable_sentence, plan_document
from edge_ident.support.documents import to_json
from tests.edge_ident.experiment.problems import (
    case_of,
    one_axis,
    rival_pair,
    smallest,
    supposed,
    term,
)
from tests.planned import diagnosed, hidden
from tests.repetitions import a_few

RIVALS = [
    ("stribeck_friction", "nonlinear_viscous"),
    ("asymmetric_friction", "nonlinear_viscous"),
    ("position_dependent_friction", "torque_ripple"),
    ("encoder_eccentricity", "torque_ripple"),
]


@pytest.mark.parametrize(("effect", "alternative"), a_few(RIVALS, RIVALS[:1]))
def test_it_separates_better_than_usual_motions_as_large_as_the_limits_allow(
    effect: str, alternative: str
) -> None:
    recording, diagnosis = rival_pair(effect, alternative)
    case = case_of(recording, diagnosis)
    rate = 2.0 * math.pi / case.problem.duration_s
    named = SineShape.of(case.named, rate, case.highest(rate))
    rng = np.random.default_rng(11)
    random = [
        replace(named, phases=rng.uniform(-math.pi, math.pi, len(named.phases))) for _ in range(8)
    ]
    usual = [SineShape.of(case.sinusoid, rate, 1), named, *random]
    reached = []
    for shape in usual:
        seen = case.problem.distances(case.problem.sized(shape))
        reached.append(0.0 if seen is None else smallest(seen.apart, seen.needed))
    plan = plan_motion(diagnosis, [recording], one_axis())
    designed = min(pair.best / pair.needed for pair in plan.pairs)
    assert designed > 1.1 * max(reached)


def test_the_same_input_gives_the_same_motion() -> None:
    recording, diagnosis = rival_pair("asymmetric_friction", "nonlinear_viscous")
    one, two = (plan_motion(diagnosis, [recording], one_axis()) for _ in range(2))
    assert one.trajectory == two.trajectory
    assert one.pairs == two.pairs


def test_twice_the_time_separates_more_by_the_root_of_two() -> None:
    """Independent samples add up in squares."""
    problem = case_of(*rival_pair("asymmetric_friction", "nonlinear_viscous")).problem
    rate = 2.0 * math.pi / problem.duration_s
    motion = problem.sized(SineShape.drawn(np.random.default_rng(3), rate, 12))
    longer = replace(problem, duration_s=2.0 * problem.duration_s)
    once, twice = (one.distances(motion) for one in (problem, longer))
    assert once is not None
    assert twice is not None
    assert twice.apart / once.apart == pytest.approx(math.sqrt(2.0), rel=0.1)


RIPPLE = term("torque_ripple", cosine=0.05, sine=0.02, period=0.9)
INSEPARABLE = {
    "a mirror image of itself": (RIPPLE, replace(RIPPLE, std={"cosine": 0.01})),
    "the same order, named by position": (
        RIPPLE,
        term("torque_ripple", cosine=0.05, sine=0.02, period=0.9 * (1.0 + 1e-7)),
    ),
    "an order that is a constant over the travel": (
        term("torque_ripple", cosine=0.1, period=5000.0),
        None,
    ),
    "two orders that are both a slope over the travel": (
        term("torque_ripple", sine=0.2, period=3000.0),
        term("torque_ripple", sine=0.2, period=3001.0),
    ),
    "a bump that ends above the speed limit": (
        term("stribeck_friction", level=0.3, speed=400.0),
        None,
    ),
    "a bump that ends before the encoder shows motion": (
        term("stribeck_friction", level=0.3, speed=1e-5),
        None,
    ),
    "a spring that gives less than the encoder resolves": (
        term("presliding_hysteresis", level=0.3, distance=1e-8),
        None,
    ),
    "a resonance far above the band": (
        term(
            "coupling_compliance",
            load_inertia=0.02,
            rate=1e5,
            damping_ratio=0.03,
            deceleration=5.0,
            damping_rate=3.0,
            weight=0.1,
        ),
        None,
    ),
    "a limit that the drive never reaches": (term("actuator_saturation", limit=50.0), None),
    "a difference below the noise": (term("asymmetric_friction", difference=1e-5), None),
}
FEW = ("a mirror image of itself", "a resonance far above the band")
"""Two rivals, and one."""


@pytest.fixture(scope="module")
def sound() -> tuple:
    recording = hidden("asymmetric_friction", 1, seed=9, strength=0.0).recordings[0]
    return recording, diagnosed(recording, "asymmetric_friction")


@pytest.mark.parametrize("what", a_few(INSEPARABLE, FEW))
def test_what_no_motion_inside_the_limits_can_separate_is_said_so(what: str, sound: tuple) -> None:
    recording, diagnosis = sound
    first, second = INSEPARABLE[what]
    plan = plan_motion(supposed(recording, diagnosis, first, second), [recording], one_axis())
    assert plan.trajectory is None
    (pair,) = plan.inseparable
    assert pair.best < pair.needed
    sentence = inseparable_sentence(pair)
    assert sentence.startswith("no motion inside the limits can ")
    assert f"{pair.best:.2g}" in sentence
    assert f"{pair.needed:.2g}" in sentence
    assert conclusion(plan) == "no motion inside the limits separates any of the pairs"
    assert to_json(plan_document(plan, None))


USUAL = {
    "stribeck_friction": {"level": 0.5, "speed": 0.3},
    "torque_ripple": {"cosine": 0.2, "period": 0.9},
    "asymmetric_friction": {"difference": 0.2},
}


@pytest.mark.parametrize("effect", a_few(USUAL, ["stribeck_friction"]))
def test_an_effect_of_usual_size_is_shown_on_the_same_drive(effect: str, sound: tuple) -> None:
    """The list above is no accident: ten times what noise hides is separable."""
    recording, diagnosis = sound
    first = term(effect, **USUAL[effect])
    plan = plan_motion(supposed(recording, diagnosis, first, None), [recording], one_axis())
    assert plan.trajectory is not None
    assert not plan.inseparable


def test_one_explanation_leaves_nothing_to_plan(sound: tuple) -> None:
    recording, diagnosis = sound
    axis = replace(diagnosis.axes["x"], causes=(), suspected=(), not_testable=())
    plan = plan_motion(Diagnosis({"x": axis}, (), {}), [recording], one_axis())
    assert plan.trajectory is None
    assert plan.pairs == ()
    assert conclusion(plan) == "there is nothing to separate"


def test_limits_and_recordings_of_other_units_cannot_be_compared(sound: tuple) -> None:
    recording, diagnosis = sound
    axis = diagnosis.axes["x"]
    model = replace(axis.model, position_unit="m", effort_unit="N")
    in_metres = Diagnosis({"x": replace(axis, model=model)}, (), {})
    with pytest.raises(DataError, match="in m and N"):
        plan_motion(in_metres, [recording], one_axis())


def test_a_drive_of_other_axes_is_refused(sound: tuple) -> None:
    recording, diagnosis = sound
    drive = replace(one_axis(), axes={"y": one_axis().axes["x"]})
    with pytest.raises(DataError, match="has axes y"):
        plan_motion(diagnosis, [recording], drive)


def test_an_effort_limit_below_friction_is_refused() -> None:
    x = replace(one_axis().axes["x"], effort_limit_nm=0.1)
    recording, found = rival_pair("asymmetric_friction", "nonlinear_viscous")
    with pytest.raises(DataError, match=r"the effort limit less its margin is 0\.09 N"):
        plan_motion(found, [recording], replace(one_axis(), axes={"x": x}))

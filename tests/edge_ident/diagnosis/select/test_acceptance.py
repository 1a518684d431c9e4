"""The rule that accepts a cause, and the thresholds: all in one file, all with a reason."""

import ast
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.fit.linear import solve
from edge_ident.diagnosis.judge import judgement
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select import acceptance, thresholds
from edge_ident.diagnosis.select.acceptance import (
    Evidence,
    beyond,
    decide,
    larger_than_rest,
    noise_limit,
    structure_left,
)
from edge_ident.diagnosis.select.cross_validation import held_out_gain
from edge_ident.model.search import Form
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing

ROOMS = [Path(room.__file__).parent for room in (acceptance, judgement)]


def term(effect: str) -> FittedTerm:
    return FittedTerm(Candidate(effect, Form(("level",))), {}, {"level": 1.0})


RIPPLE, DRIFT = term("torque_ripple"), term("offset_drift")
PUSH = replace(term("disturbance_event"), nonlinear={"time": 1.0, "duration": 0.2})


@pytest.mark.parametrize(("gain", "accepted"), [(24.9, False), (25.0, False), (25.1, True)])
def test_one_more_term_has_to_gain_more_than_its_threshold(gain: float, accepted: bool) -> None:
    decision = decide([RIPPLE], [RIPPLE, DRIFT], Evidence(gain))
    assert decision.accepted is accepted
    assert "more than 25 are required" in decision.reason


@pytest.mark.parametrize(("gain", "accepted"), [(0.0, False), (0.1, True)])
def test_a_term_that_stays_has_to_gain_less_than_one_that_enters(
    gain: float, accepted: bool
) -> None:
    assert decide([RIPPLE], [RIPPLE, DRIFT], Evidence(gain), staying=True).accepted is accepted


@pytest.mark.parametrize(("gain", "said"), [(730.0, "730 units worse"), (-12.0, "12 units better")])
def test_a_decision_to_stay_says_what_entering_and_staying_require(gain: float, said: str) -> None:
    decision = decide([RIPPLE], [RIPPLE, DRIFT], Evidence(gain), staying=True)
    assert decision.reason == (
        f"without it the criterion is {said} "
        "(a term must gain more than 25 to enter, and more than 0 to stay)"
    )


@pytest.mark.parametrize(
    ("before", "after", "required"),
    [
        ([RIPPLE], [DRIFT], 0.0),
        ([RIPPLE, RIPPLE], [RIPPLE, DRIFT], 10.0),
        ([RIPPLE, DRIFT], [RIPPLE, RIPPLE], -10.0),
        ([RIPPLE], [PUSH], 10.0),
        ([PUSH], [RIPPLE], -10.0),
    ],
)
def test_a_replacement_that_adds_a_kind_of_effect_or_a_moment_has_to_be_decisive(
    before: list[FittedTerm], after: list[FittedTerm], required: float
) -> None:
    assert not decide(before, after, Evidence(required)).accepted
    assert decide(before, after, Evidence(required + 0.1)).accepted


def test_a_cause_has_to_hold_on_held_out_blocks() -> None:
    refused = decide([], [RIPPLE], Evidence(400.0, supported=0.9))
    assert not refused.accepted
    assert "a probability of 90.0%" in refused.reason
    assert decide([], [RIPPLE], Evidence(400.0, supported=0.951)).accepted
    once = decide([], [RIPPLE], Evidence(400.0, supported=0.0, one_off=True))
    assert once.accepted
    assert "acts once" in once.reason


def test_an_essential_parameter_near_zero_refuses_a_cause() -> None:
    decision = decide([], [RIPPLE], Evidence(400.0, supported=1.0, near_zero=("inertia",)))
    assert not decision.accepted
    assert decision.reason == "inertia lies within 3 standard deviations of zero"


def test_structure_begins_above_noise_with_discrepancy_and_above_noise_with_tolerance() -> None:
    assert noise_limit(1.0, 0.0) == pytest.approx(1.2)
    assert noise_limit(1.0, 0.1) == pytest.approx(1.44), "twice the floor's uncertainty"
    assert not structure_left(1.2, 1.0, 0.0, 0.0, 0.0, 100.0)
    assert structure_left(1.21, 1.0, 0.0, 0.0, 0.0, 100.0)
    assert not structure_left(1.55, 1.0, 0.0, 1.0, 0.0, 100.0)
    assert structure_left(1.57, 1.0, 0.0, 1.0, 0.0, 100.0)
    assert not structure_left(1.41, 1.0, 0.0, 0.0, 1.0, 100.0)
    assert structure_left(1.42, 1.0, 0.0, 0.0, 1.0, 100.0)
    assert structure_left(6.0, 1.0, 0.0, 50.0, 0.0, 100.0), "of rough formulas a twentieth counts"


def test_a_cause_is_larger_than_what_noise_does_not_explain_of_the_rest() -> None:
    assert beyond(1.1, 1.2) == 0.0
    assert beyond(1.3, 1.2) == pytest.approx(0.5)
    assert larger_than_rest(0.02, 0.0).accepted
    assert larger_than_rest(0.02, 0.019).accepted
    refused = larger_than_rest(0.02, 0.021)
    assert not refused.accepted
    assert "2.0%, is less than what is left unexplained beside it, 2.1%" in refused.reason


def test_a_drift_beside_as_large_a_rest_is_only_suspected() -> None:
    """A disturbance in time looks like it for a while."""
    refused = larger_than_rest(0.02, 0.019, tied_to_time=True)
    assert not refused.accepted
    assert "less than 2 times what is left unexplained beside it, 1.9%" in refused.reason
    assert larger_than_rest(0.02, 0.009, tied_to_time=True).accepted


NOISES = 30


def test_regressors_of_noise_are_refused_by_cross_validation() -> None:
    """Fitted, thirty of them reduce the residual everywhere; on held-out blocks they do not."""
    t, x, v, a = swing(seed=8)
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.05)], "x")
    noise = np.random.default_rng(1).normal(size=(len(data.effort), NOISES))
    assert not accepted(data, noise)
    wave = np.sin(7.0 * data.of_motion("position"))
    assert accepted(replace(data, effort=data.effort + 0.02 * wave), wave[:, None])


def accepted(data: AxisData, regressors: np.ndarray) -> bool:
    """Whether a term of so many linear parameters is accepted, its criterion aside."""
    start = fit(data, TEMPLATE, np.zeros(4), ())
    jacobian = np.column_stack([start.jacobian, regressors])
    solved = solve(jacobian[data.valid], data.effort[data.valid])
    linear = {f"level_{k}": float(value) for k, value in enumerate(solved[5:])}
    predicted = jacobian @ solved
    left = (data.effort - predicted)[data.valid]
    after = replace(
        start,
        base=solved[:4],
        own=solved[4:5],
        terms=(replace(RIPPLE, linear=linear),),
        predicted=predicted,
        rows=(jacobian.T,),
        free=np.ones(jacobian.shape[1], dtype=np.bool_),
        error=float(left @ left),
    )
    assert after.error < start.error, "a fit never gets worse"
    gain = held_out_gain(data, start, after)
    return decide([], after.terms, Evidence(400.0, gain.supported, gain.one_off)).accepted


@pytest.mark.parametrize(
    "file", sorted(f for room in ROOMS for f in room.glob("*.py")), ids=lambda file: file.name
)
def test_no_other_file_of_selection_and_judgement_holds_a_threshold(file: Path) -> None:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    assert numbers(tree) == [] or file.name == "thresholds.py"


def numbers(tree: ast.Module) -> list[str]:
    """Numeric module constants, and numbers other than zero and one in comparisons."""
    found = [
        ast.unparse(node)
        for node in tree.body
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value and literals(node.value)
    ]
    compared = [node for node in ast.walk(tree) if isinstance(node, ast.Compare)]
    return found + [ast.unparse(c) for c in compared if literals(c) - {0, 1}]


def literals(node: ast.AST) -> set[float]:
    return {
        part.value
        for part in ast.walk(node)
        if isinstance(part, ast.Constant) and type(part.value) in (int, float)
    }


def test_the_check_for_thresholds_finds_them() -> None:
    assert numbers(ast.parse("_LEAST: Final = 3.0\nx = 2"))
    assert numbers(ast.parse("def f(x):\n    return x > 0.9 * len(x)"))
    assert not numbers(ast.parse("def f(x):\n    return x > 0 and len(x) == 1"))


def test_the_reference_has_every_threshold_as_it_is() -> None:
    page = (Path(__file__).parents[4] / "docs" / "diagnosis_reference.md").read_text("utf-8")
    table = re.findall(r"^\| `([A-Z_]+)` \| ([0-9.]+) ", page, re.MULTILINE)
    in_code = {name: value for name, value in vars(thresholds).items() if name.isupper()}
    assert {name: float(value) for name, value in table} == in_code

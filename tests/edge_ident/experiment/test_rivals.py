"""What a diagnosis leaves open becomes pairs; what belongs to a time does not come back."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.result import AxisDiagnosis, NotTestable
from edge_ident.experiment.compared import Compared, base_columns, term_effort
from edge_ident.experiment.rivals import Rivals, Typical, Why, rivals
from edge_ident.model.model import AxisModel
from edge_ident.signals.metrics import rms
from tests.edge_ident.experiment.problems import case_of, cause, rival_pair, term

STRIBECK = term("stribeck_friction", level=0.4, speed=0.3)
VISCOUS = term("nonlinear_viscous", quadratic=0.1)
HYSTERESIS = term("presliding_hysteresis", level=0.4, distance=0.01)
EVENT = term("disturbance_event", effort=0.3, start=3.0, duration=1.0)


@pytest.fixture(scope="module")
def typical() -> Typical:
    case = case_of(*rival_pair("stribeck_friction", "nonlinear_viscous"))
    problem = case.problem
    compared = problem.compared(case.named)
    assert isinstance(compared, Compared)
    effort = rms(base_columns(compared, problem.base).effort)
    return Typical(problem.base, problem.judge.excitation, compared, effort, None)


@pytest.fixture
def axis() -> AxisDiagnosis:
    _, diagnosis = rival_pair("stribeck_friction", "nonlinear_viscous")
    found = diagnosis.axes["x"]
    return replace(found, causes=(), suspected=(), not_testable=())


def with_terms(axis: AxisDiagnosis, *terms) -> AxisModel:
    return replace(axis.model, terms=(axis.model.terms[0], *terms))


def pairs(found: Rivals) -> set[tuple[str, str | None, Why]]:
    return {
        (p.first.effect, None if p.second is None else p.second.effect, p.why) for p in found.pairs
    }


def test_a_cause_and_its_alternatives_are_rivals_of_each_other(axis, typical) -> None:
    own = replace(
        axis, causes=(cause(STRIBECK, VISCOUS, HYSTERESIS),), model=with_terms(axis, STRIBECK)
    )
    assert pairs(rivals(own, typical)) == {
        ("stribeck_friction", "nonlinear_viscous", Why.ALTERNATIVE),
        ("stribeck_friction", "presliding_hysteresis", Why.ALTERNATIVE),
        ("nonlinear_viscous", "presliding_hysteresis", Why.ALTERNATIVE),
    }


def test_a_cause_without_rivals_stands_beside_those_of_others(axis, typical) -> None:
    ripple = term("torque_ripple", cosine=0.1, period=0.9)
    own = replace(
        axis,
        causes=(cause(ripple), cause(STRIBECK, VISCOUS)),
        model=with_terms(axis, ripple, STRIBECK),
    )
    (pair,) = rivals(own, typical).pairs
    assert pair.others == (ripple,)


def test_a_suspected_cause_has_its_absence_for_a_rival(axis, typical) -> None:
    own = replace(axis, suspected=(cause(STRIBECK),))
    assert pairs(rivals(own, typical)) == {("stribeck_friction", None, Why.SUSPECTED)}


def test_what_belongs_to_a_time_is_absent_from_another_motion(axis, typical) -> None:
    own = replace(axis, causes=(cause(STRIBECK, EVENT),), model=with_terms(axis, STRIBECK))
    assert pairs(rivals(own, typical)) == {("stribeck_friction", None, Why.ALTERNATIVE)}
    suspected = replace(axis, suspected=(cause(EVENT),))
    found = rivals(suspected, typical)
    assert found.pairs == ()
    assert "repeat the recording" in found.left_out["disturbance_event"]


def test_an_untested_effect_is_as_large_as_is_called_not_testable(axis, typical) -> None:
    own = replace(axis, not_testable=(NotTestable("asymmetric_friction", "", ""),))
    (pair,) = rivals(own, typical).pairs
    assert pair.why is Why.UNTESTED
    size = rms(term_effort(typical.reference, typical.base, pair.first))
    assert size == pytest.approx(0.1 * typical.effort, rel=0.01)


def test_an_effect_of_another_axis_needs_one(axis, typical) -> None:
    own = replace(axis, not_testable=(NotTestable("cross_axis_coupling", "", ""),))
    found = rivals(own, typical)
    assert found.pairs == ()
    assert "cross_axis_coupling" in found.left_out
    assert np.isfinite(typical.effort)

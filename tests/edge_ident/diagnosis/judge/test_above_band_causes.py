"""What lies above the band decides on causes, on the model and on the verdict."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.judge.above_band_causes import supported_orders, with_band_content
from edge_ident.diagnosis.measures import TOLERANCE, Verdict
from edge_ident.diagnosis.wording import facts
from edge_ident.model.model import AxisModel, Model, Term
from tests.edge_ident.diagnosis.above_band.test_content import content, recorded


def test_a_line_above_the_band_forbids_adequate() -> None:
    assert diagnose([recorded(1)]).axes["x"].verdict is Verdict.ADEQUATE
    axis = diagnose([recorded(1, line=(0.15, 37.3))]).axes["x"]
    assert axis.verdict is Verdict.UNEXPLAINED
    assert axis.causes == ()
    (line,) = axis.lines
    assert line.frequency_hz == pytest.approx(37.3, abs=0.02)
    assert any("37.3 Hz" in fact for fact in facts(axis))


def test_a_line_that_is_not_worth_naming_forbids_nothing() -> None:
    axis = diagnose([recorded(1, line=(0.03, 37.3))]).axes["x"]
    assert len(axis.lines) == 1
    assert axis.verdict is Verdict.ADEQUATE


def test_an_order_above_the_band_is_a_cause_with_its_amplitude() -> None:
    recording = recorded(2, order=(0.15, 36.0))
    found = diagnose([recording])
    axis = found.axes["x"]
    (cause,) = axis.causes
    assert axis.verdict is Verdict.EXPLAINED
    assert cause.term.effect == "torque_ripple"
    assert 2.0 * np.pi / cause.term.values["period"] == pytest.approx(36.0, abs=0.02)
    amplitude = np.hypot(cause.term.values["cosine"], cause.term.values["sine"])
    assert abs(amplitude - 0.15) < 4.0 * cause.term.std["cosine"]
    assert axis.model.terms[1].effect == "torque_ripple"
    again = diagnose([recording], model=Model(found.model.axes)).axes["x"]
    assert again.causes == (), "it is known"
    assert len(again.model.terms) == 2


def test_an_order_stays_a_cause_beside_what_its_rate_is_off_by() -> None:
    """Along three quarters of a turn the search added 24.04 and 35.87 a turn, a tenth as large, to
    24 and 36: these two were in the model, and no longer among the causes."""
    found = content(recorded(2, order=(0.15, 36.0)))
    (order,) = found.orders
    beside = Term("torque_ripple", {"cosine": 0.01, "sine": 0.0, "period": 2.0 * np.pi / 35.9})
    axis = diagnose([recorded(1)]).axes["x"]
    (small,) = diagnose([recorded(2, order=(0.15, 36.0))]).axes["x"].causes
    axis = replace(axis, causes=(replace(small, term=beside, share=0.01),))
    empty = AxisModel(axis.model.terms[:1], *axis.model.units)
    named = with_band_content(axis, found, empty, TOLERANCE).causes
    assert [round(2.0 * np.pi / cause.term.values["period"], 1) for cause in named] == [36.0, 35.9]
    less = replace(found, orders=(replace(order, share=0.1 * TOLERANCE),))
    assert len(with_band_content(axis, less, empty, TOLERANCE).causes) == 1, "it is in no model"


def test_a_small_order_is_minor() -> None:
    axis = diagnose([recorded(2, order=(0.035, 90.0))]).axes["x"]
    assert axis.causes == ()
    assert [cause.term.effect for cause in axis.minor] == ["torque_ripple"]
    assert axis.verdict is Verdict.ADEQUATE


def test_an_order_is_only_suspected_where_the_recording_says_nothing_of_the_machine() -> None:
    """In a speed loop, the current answers the cogging as the controller has it: a model with that
    ripple left 1.13 times what the base model left on the motor's other recording."""
    found = content(recorded(2, order=(0.15, 36.0)))
    assert supported_orders(found, 0.0, None) == (found, ())
    kept, (suspected,) = supported_orders(found, 0.0, "what was recorded is the loop")
    assert kept.orders == ()
    assert suspected.term.effect == "torque_ripple"
    assert suspected.decision == "what was recorded is the loop"

"""What an actuator ignores is free, and freedom has a price: no more than a parameter each."""

import numpy as np
import pytest

from edge_ident.diagnosis.fit.library import ignored_command_penalty
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.model import Term
from tests.edge_ident.diagnosis.select.test_search_parts import recorded, rigid, swing


@pytest.fixture(scope="module")
def data() -> AxisData:
    """A rigid axis, and noise of the effort."""
    t, x, v, a = swing()
    return prepare_axis([recorded(t, x, rigid(v, a), noise=0.05)], "x")


def price(data: AxisData, share: float) -> tuple[float, float]:
    """Of each command that a deadband ignores, in units of the criterion; and the deadband's width.

    It ignores this share of all commands. The residual counts as a share of the effort that
    arrives, which is not in this price.
    """
    raw = data.segments[0].raw_effort
    width = float(np.quantile(np.abs(raw), share))
    arriving = np.var(raw - np.clip(raw, -width, width)) / np.var(raw)
    return float(np.log(penalty(data, width) * arriving) / np.mean(np.abs(raw) < width)), width


def penalty(data: AxisData, width: float) -> float:
    """Factor on the squared residual beside a deadband."""
    term = Term("actuator_deadband", {"width": np.array([width])})
    return float(ignored_command_penalty(data, term)[0])


def test_a_command_ignored_in_a_narrow_band_costs_the_likelihood_of_its_range(
    data: AxisData,
) -> None:
    narrow, width = price(data, 0.03)
    noise = data.segments[0].effort_noise
    likelihood = np.log(2.0 * width) - np.log(noise * np.sqrt(2.0 * np.pi * np.e))
    assert narrow == pytest.approx(2.0 * likelihood, rel=0.05)
    assert 0.0 < narrow < np.log(np.count_nonzero(data.valid))


def test_it_costs_no_more_than_a_parameter(data: AxisData) -> None:
    wide, _ = price(data, 0.35)
    assert wide == pytest.approx(np.log(np.count_nonzero(data.valid)), rel=0.01)


def test_a_deadband_that_leaves_next_to_nothing_is_worth_nothing() -> None:
    """Of an effort of two levels it withholds all but a thousandth, and ignores no command."""
    t, x, _, _ = swing()
    levels = np.where(np.sin(7.0 * t) > 0.0, 3.0, -3.0)
    data = prepare_axis([recorded(t, x, levels, noise=1e-6)], "x")
    assert penalty(data, 0.0) == pytest.approx(1.0)
    assert penalty(data, 2.997) == pytest.approx(1e6, rel=0.01)


def test_an_effect_that_ignores_no_command_costs_nothing_more(data: AxisData) -> None:
    values = {"level": np.ones(1), "time": np.ones(1), "duration": np.ones(1)}
    assert ignored_command_penalty(data, Term("disturbance_event", values)) == 1.0

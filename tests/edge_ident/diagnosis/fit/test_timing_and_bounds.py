"""Timing in the base model, and the physical bounds of every fit."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import fit
from edge_ident.diagnosis.fit.linear import solve, solve_within
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.signals.metrics import rms
from tests.edge_ident.diagnosis.select.test_search_parts import (
    PERIOD_S,
    TEMPLATE,
    diagnosed,
    recorded,
    rigid,
    swing,
)
from tests.repetitions import a_few

Array = NDArray[np.float64]
START = np.array([1.0, 0.0, 0.0, 0.0])


@cache
def late_by(samples: float, extra: float = 0.0) -> AxisDiagnosis:
    """The diagnosis of a drive whose effort is recorded late; `extra` is friction by direction."""
    t, x, v, a = swing()
    effort = rigid(v, a) + extra * np.abs(v)
    effort = np.interp(t - samples * PERIOD_S, t, effort)
    return diagnosed(recorded(t, x, effort, noise=0.01))


@pytest.mark.parametrize("samples", a_few([-0.5, 0.0, 1.2], [1.2]))
def test_a_controllers_timing_is_measured_and_accuses_nobody(samples: float) -> None:
    found = late_by(samples)
    assert found.verdict is Verdict.ADEQUATE
    assert not found.causes
    assert found.timing.std_samples < 0.1
    assert found.timing.shift_samples == pytest.approx(samples, abs=4 * found.timing.std_samples)


def test_a_longer_delay_is_a_cause_and_carries_the_whole_shift() -> None:
    found = late_by(6.0)
    (cause,) = found.causes
    assert cause.term.effect == "time_delay"
    assert cause.term.values["delay"] == pytest.approx(6.0 * PERIOD_S, rel=0.05)
    assert found.timing.shift_s == 0.0


def test_no_effect_takes_what_timing_explains() -> None:
    found = late_by(-0.5, extra=0.3)
    assert [cause.term.effect for cause in found.causes] == ["asymmetric_friction"]
    assert found.timing.shift_samples == pytest.approx(-0.5, abs=0.1)


def test_a_share_is_what_the_base_model_cannot_express() -> None:
    """Most of |v| is an offset; only what varies is left to the cause."""
    found = late_by(-0.5, extra=0.3)
    (cause,) = found.causes
    traces = found.traces
    whole = rms(traces.contributions["asymmetric_friction"]) / rms(traces.effort)
    assert 0.01 < cause.share < 0.6 * whole


def test_the_least_squares_end_inside_their_bounds_and_say_what_a_bound_holds() -> None:
    rng = np.random.default_rng(2)
    regressor = rng.normal(size=(200, 3))
    target = regressor @ [1.0, -0.5, 2.0]
    low, high = np.array([-np.inf, 0.0, -np.inf]), np.array([np.inf, np.inf, np.inf])
    found = solve_within(regressor, target, low, high)
    assert found.free.tolist() == [True, False, True]
    assert found.solution[1] == 0.0
    assert found.solution[[0, 2]] == pytest.approx(solve(regressor[:, [0, 2]], target))


def test_a_fixed_parameter_keeps_its_value() -> None:
    rng = np.random.default_rng(2)
    regressor = rng.normal(size=(200, 2))
    low, high = np.array([-np.inf, 0.7]), np.array([np.inf, 0.7])
    found = solve_within(regressor, regressor @ [1.0, 0.2], low, high)
    assert found.solution[1] == 0.7
    assert not found.free[1]


def test_friction_that_would_be_negative_is_zero_in_the_fit_and_in_its_residual() -> None:
    """The reported residual is that of the written model."""
    t, x, v, a = swing()
    data = prepare_axis([recorded(t, x, 0.5 * a - 0.3 * v + np.sign(v), noise=0.01)], "x")
    model = fit(data, TEMPLATE, START, ())
    assert model.base[1] == 0.0
    written = data.predicted(model.axis) + data.timing_columns @ model.own
    left = (data.effort - written)[data.valid]
    assert float(left @ left) == pytest.approx(model.error)

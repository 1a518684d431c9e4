"""The criterion: how many samples count, and that nobody changes them behind its back."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from edge_ident.diagnosis.fit.fitting import FittedModel, build, fit
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import Search, independent_samples
from edge_ident.diagnosis.select.selection import selected_model
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing


@pytest.fixture(scope="module")
def prepared() -> tuple[AxisData, FittedModel]:
    t, x, v, a = swing(seconds=12.0)
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.05)], "x")
    return data, fit(data, TEMPLATE, np.zeros(4), ())


def with_residual(prepared: tuple[AxisData, FittedModel], residual: np.ndarray) -> float:
    data, start = prepared
    every = replace(data, valid=np.ones(len(data.effort), dtype=np.bool_))
    return independent_samples(every, replace(start, predicted=data.effort - residual))


def test_white_samples_all_count(prepared: tuple[AxisData, FittedModel]) -> None:
    count = len(prepared[0].effort)
    assert with_residual(prepared, np.random.default_rng(1).normal(size=count)) > 0.95 * count


def test_coloured_samples_count_for_fewer(prepared: tuple[AxisData, FittedModel]) -> None:
    """Of a first-order series of coefficient c, (1 - c²)/(1 + c²) of the samples count."""
    count, c = len(prepared[0].effort), 0.8
    rng = np.random.default_rng(2)
    series = np.zeros(count)
    for k in range(1, count):
        series[k] = c * series[k - 1] + rng.normal()
    expected = count * (1.0 - c**2) / (1.0 + c**2)
    assert with_residual(prepared, series) == pytest.approx(expected, rel=0.3)


def test_a_search_never_changes(prepared: tuple[AxisData, FittedModel]) -> None:
    """Slow waves that no effect explains colour the residual: the selection counts fewer samples,
    and the search that it was given counts as many as before."""
    data, start = prepared
    time_s = data.of_motion("time_s")
    waves = sum(np.sin(w * time_s + w**2) * 0.2 for w in np.linspace(2.0, 9.0, 23))
    push = 0.6 * np.sin(2.0 * np.pi * data.of_motion("position") / 0.31)
    data = replace(data, effort=data.effort + waves + push)
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    before = search.samples
    fewer = selected_model(data, TEMPLATE).search
    assert fewer.samples < 0.8 * before
    assert search.samples == before == np.count_nonzero(data.valid)
    with pytest.raises(FrozenInstanceError):
        search.samples = 1.0  # type: ignore[misc]


def test_less_inertia_for_the_encoder_noise_is_no_evidence() -> None:
    """With four fifths of the inertia 0.64 of the noise's energy pass; the rest is added again."""
    t, x, v, a = swing(seconds=12.0, period_s=1e-3)
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.002, count=1e-3)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    lighter = build(TEMPLATE, start.base * (0.8, 1.0, 1.0, 1.0), ())
    late = data.timing_columns @ start.own
    model = replace(start, axis=lighter, predicted=data.predicted(lighter) + late)
    noise, band, period_s = next((s.position_noise, s.band, s.raw_period_s) for s in data.segments)
    frequency_hz = np.linspace(0.0, 2.0 * band.cutoff_hz, 2001)
    torque = start.base[0] * (2.0 * np.pi * frequency_hz) ** 2 * noise
    density = 2.0 * period_s * torque**2 * band.power(frequency_hz)
    passed = np.count_nonzero(data.valid) * np.trapezoid(density, frequency_hz)
    assert search.error(start) == start.error
    assert search.error(model) - model.error == pytest.approx(0.36 * passed, rel=0.4)

"""A whole-period recording is rotated to the network's phase, whatever phase it began with."""

import numpy as np
import pytest

from edge_ident.estimation.image import align
from edge_ident.model.model import regressor
from edge_ident.signals.conditioning import Signals
from edge_ident.signals.metrics import subsample
from edge_ident.signals.time_stamps import EvenGrid

PERIOD_S, SAMPLES = 0.0025, 8742
RATE = 2 * np.pi / (SAMPLES * PERIOD_S)


def motion(phase: float, periods: float = 1.0) -> Signals:
    angle = RATE * PERIOD_S * np.arange(int(periods * SAMPLES)) + phase
    velocity, acceleration = np.cos(angle), -RATE * np.sin(angle)
    columns = regressor(velocity, acceleration)
    effort = columns @ np.array([0.4, 0.9, 1.4, 0.1])
    return Signals(
        grid=EvenGrid.of(PERIOD_S * np.arange(len(effort))),
        cutoff_hz=3.0,
        effort=effort,
        regressor=columns,
        moving=np.ones(len(effort), dtype=bool),
        acceleration_noise=0.0,
    )


@pytest.mark.parametrize("phase", [0.0, np.pi / 2, -2.0])
@pytest.mark.parametrize("periods", [1.0, 2.0, 2.6])
def test_any_start_phase_gives_the_same_columns(phase: float, periods: float) -> None:
    trained = motion(0.0)
    found = align(motion(phase, periods), subsample(trained.regressor[:, 1]), SAMPLES * PERIOD_S)
    assert found is not None
    smooth = slice(None), [0, 1, 3]
    expected = subsample(trained.regressor)
    np.testing.assert_allclose(found.regressor[smooth], expected[smooth], atol=2e-3)
    np.testing.assert_allclose(
        found.effort, found.regressor @ np.array([0.4, 0.9, 1.4, 0.1]), atol=1e-9
    )


def test_less_than_a_period_is_not_aligned() -> None:
    reference = subsample(motion(0.0).regressor[:, 1])
    assert align(motion(0.0, 0.9), reference, SAMPLES * PERIOD_S) is None


def test_a_period_of_fewer_samples_than_the_network_reads_is_not_aligned() -> None:
    reference = subsample(motion(0.0).regressor[:, 1])
    few = motion(0.0, 2.0)
    assert align(few, reference, len(reference) * PERIOD_S) is not None
    assert align(few, reference, (len(reference) - 1) * PERIOD_S) is None

"""Figures of a network: of unseen drives, against the truth, with rivals beside it."""

from collections.abc import Callable

import numpy as np
import pytest

from edge_ident.estimation.image import effort_scale
from export import evaluate
from export.evaluate import (
    DriveSet,
    EvaluationDrives,
    error_per_residual,
    evaluate_all,
    evaluation_drives,
    figures,
    guessed,
    solved,
)
from tests.edge_ident.stand_ins import MOTION, START, StandIn, nothing, reader

Make = Callable[[], EvaluationDrives]


@pytest.fixture
def make(few_effects: None, monkeypatch: pytest.MonkeyPatch) -> Make:
    for name, size in {"DRIVES": 40, "MOTIONS": 3, "DRIVES_WITH_EFFECT": 4}.items():
        monkeypatch.setattr(evaluate, name, size)
    return lambda: evaluation_drives(MOTION, 100)


@pytest.fixture
def drives(make: Make) -> EvaluationDrives:
    return make()


def test_the_sets_are_always_the_same(make: Make) -> None:
    first, again = make(), make()
    for name in ("clean", "noisy", "disturbed"):
        np.testing.assert_array_equal(getattr(first, name).effort, getattr(again, name).effort)


def test_each_set_has_what_its_name_says(drives: EvaluationDrives) -> None:
    """Clean: the model's effort. Noisy: 2 % noise, a tenth of it left. Disturbed: an effect."""
    missed = {}
    for name, some in vars(drives).items():
        scale = effort_scale(some.effort, "effort-scale")
        missed[name] = effort_scale(some.effort - some.base_effort, "effort-scale") / scale
        assert scale.max() > 10.0 * scale.min()
        assert np.all(some.parameters[:, :3] > 0.0)
    assert np.all(missed["clean"] == 0.0)
    expected = 0.02 * np.sqrt(2.0 * 100 / 8742)
    assert np.median(missed["noisy"]) == pytest.approx(expected, rel=0.2)
    assert np.median(missed["disturbed"]) > 10.0 * np.median(missed["noisy"])
    assert len(drives.disturbed.effort) == 3 * 2 * 4


def test_shares_are_of_the_measured_efforts_scale(drives: EvaluationDrives) -> None:
    some = drives.clean
    shares = some.shares(some.parameters)
    unit_effort = (some.regressor / some.column_scales @ shares[:, :, None])[:, :, 0]
    np.testing.assert_allclose(effort_scale(unit_effort, "effort-scale"), 1.0)


def test_an_exact_reader_is_exact_on_clean_drives_and_no_better_than_noise_allows(
    drives: EvaluationDrives,
) -> None:
    network = StandIn(reader(), START)
    found = {
        entry.name: entry for entry in evaluate_all({"fp32": network, "int8": network}, drives)
    }
    assert found["clean"].residual_median < 1e-5
    assert np.all(found["clean"].share_error_p95 < 1e-4)
    assert found["noisy"].residual_median < 0.02
    assert found["one_effect"].residual_median > found["noisy"].residual_median
    assert found["clean"].drives == 40
    for name in ("clean", "noisy", "one_effect"):
        for value, other in zip(
            vars(found[name]).values(), vars(found[f"{name}_int8"]).values(), strict=True
        ):
            assert isinstance(value, str) or np.array_equal(value, other)


def test_a_useless_network_is_no_better_than_guessing(drives: EvaluationDrives) -> None:
    """Eight random guesses miss most of the effort, least squares hardly any."""
    network = StandIn(nothing, START)
    found = {entry.name: entry for entry in evaluate_all({"fp32": network}, drives)}
    assert found["noisy"].residual_median > 0.2
    assert found["noisy_random_search"].residual_median > 0.2
    assert found["noisy_least_squares"].residual_median < 0.02
    assert np.all(found["noisy_least_squares"].share_error_median < 0.05)


def test_least_squares_and_guesses_are_in_the_drives_own_units(drives: EvaluationDrives) -> None:
    some = drives.clean
    np.testing.assert_allclose(solved(some), some.parameters, rtol=1e-6)
    shares = some.shares(guessed(some))
    assert np.all(shares[:, :3] >= 0.0)
    assert np.all(np.abs(shares) <= 1.0)


def test_figures_measure_errors_in_shares_and_of_the_noise_free_effort() -> None:
    columns = np.broadcast_to(MOTION.scaled_regressor(100), (5, 100, 4)).copy()
    truth = np.tile([0.5, 0.4, 0.3, 0.2], (5, 1))
    effort = (columns @ truth[:, :, None])[:, :, 0]
    some = DriveSet(columns, effort, effort, truth, np.ones(4))
    scale = effort_scale(effort[0], "effort-scale")
    found = figures("five", some, truth + np.arange(5)[:, None] * [0.0, 0.01, 0.0, -0.02])
    steps = np.array([0.0, 0.01, 0.0, 0.02]) / scale
    np.testing.assert_allclose(found.share_error_median, 2.0 * steps, atol=1e-12)
    np.testing.assert_allclose(found.share_error_rms, np.sqrt(6.0) * steps, atol=1e-12)
    one = columns[0] @ [0.0, 0.01, 0.0, -0.02]
    miss = np.linalg.norm(one) / np.linalg.norm(effort[0])
    assert found.residual_median == pytest.approx(2.0 * miss)
    assert found.drives == 5


def test_error_per_residual_is_what_an_effect_adds(drives: EvaluationDrives) -> None:
    network = StandIn(reader(), START)
    grown = error_per_residual(network, drives.disturbed, np.zeros(4))
    assert np.all(grown > 0.0)
    assert np.all(grown < 5.0)
    none_left = error_per_residual(network, drives.disturbed, np.full(4, 10.0))
    np.testing.assert_array_equal(none_left, 0.0)

"""Training examples: drawn from what the loop meets, labelled with what the loop subtracts."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("torch")

from edge_ident.image import effort_scale
from export import data
from export.configuration import IMPROVED, PAPER
from export.drives import FAMILIES, as_shares, efforts, guesses, mixture
from export.motion import column_scales, motion_columns


@pytest.fixture(autouse=True)
def _few_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data, "MOTIONS", 4)


def test_a_batch_depends_on_seed_and_number_alone() -> None:
    first, again = (data.Batches(IMPROVED).batch(7) for _ in range(2))
    other = data.Batches(replace(IMPROVED, seed=2)).batch(7)
    np.testing.assert_array_equal(first.model_effort, again.model_effort)
    np.testing.assert_array_equal(first.residual, again.residual)
    assert not np.array_equal(first.residual, other.residual)


def test_label_is_guess_minus_truth_as_the_nominal_motion_shows_it() -> None:
    batch = data.Batches(IMPROVED).batch(0)
    inverse = np.linalg.pinv(data.nominal_shapes())
    guess, truth = batch.model_effort @ inverse.T, batch.measured_effort @ inverse.T
    # noise of the measurement is in the truth found here, not in the label
    np.testing.assert_allclose(batch.residual, guess - truth, atol=0.03)


def test_half_of_the_papers_examples_match() -> None:
    batches = data.Batches(replace(PAPER, batch=400))
    matching = np.all(np.abs(batches.batch(0).residual) < 1e-9, axis=1)
    assert 0.4 < np.mean(matching) < 0.6


@pytest.mark.parametrize("name", FAMILIES)
def test_shares_give_efforts_of_scale_one_with_physical_signs(name: str) -> None:
    rng = np.random.default_rng(2)
    shares = as_shares(data.nominal_shapes(), FAMILIES[name](rng, 200), "effort-scale")
    scales = effort_scale(efforts(data.nominal_shapes(), shares), "effort-scale")
    np.testing.assert_allclose(scales, 1.0)
    assert np.all(shares[:, :3] > 0.0)
    assert np.any(shares[:, 3] > 0.0)
    assert np.any(shares[:, 3] < 0.0)


def test_guesses_are_near_and_far_and_unphysical_too() -> None:
    rng = np.random.default_rng(2)
    truth = as_shares(data.nominal_shapes(), mixture(rng, 3000), "effort-scale")
    guess = guesses(rng, truth)
    distance = np.linalg.norm(guess - truth, axis=1)
    assert np.mean(distance < 0.01) > 0.1
    assert np.mean(distance > 0.5) > 0.2
    assert np.any(guess[:, :3] < 0.0)


def test_nominal_motion_is_the_papers() -> None:
    columns = motion_columns(1.0, 0.0)
    time = 0.0025 * 8742 * (np.arange(100) + 0.5) / 100
    np.testing.assert_allclose(columns[:, 1], 1.80642 * np.cos(0.2875 * time), atol=5e-3)
    np.testing.assert_allclose(column_scales(), [0.519345, 1.806416, 1.0, 1.0], rtol=1e-5)


def test_a_measured_motion_is_the_nominal_one_within_the_encoders_noise() -> None:
    difference = motion_columns(1.0, 0.0, measured=True) - motion_columns(1.0, 0.0)
    assert np.sqrt(np.mean(difference[:, 0] ** 2)) < 0.05 * 0.519
    assert np.max(np.abs(difference[:, 1])) < 0.02


def test_friction_lag_shows_at_the_reversals_alone() -> None:
    prompt, late = (motion_columns(1.0, 0.0, measured=True, lag_rad=lag) for lag in (0.0, 0.08))
    difference = np.abs(late - prompt)[:, 2]
    reversals = np.r_[22:32, 72:82]
    assert np.max(difference[reversals]) > 0.5
    assert np.max(np.delete(difference, reversals)) < 0.1

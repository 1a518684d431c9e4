"""Training examples: drawn from what the loop meets, labelled with what the loop subtracts."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("torch")

from edge_ident.estimation.image import effort_scale
from export import data
from export.configuration import IMPROVED, PAPER, Configuration
from export.data import Batch, Batches, rotate
from export.motion import paper_motion
from export.recordings import Recordings

MOTION = paper_motion()
SMALL = replace(IMPROVED, motions=8, drives_with_effect=0)
WITH_EFFECTS = replace(IMPROVED, motions=2, drives_with_effect=1)


def batch(
    configuration: Configuration = SMALL, count: int = 200, *, held_out: bool = False
) -> Batch:
    return Batches(configuration, MOTION, held_out=held_out).batch("test", 7, count)


def equal(first: Batch, second: Batch) -> bool:
    return all(np.array_equal(vars(first)[name], vars(second)[name]) for name in vars(first))


# ---- the stream


def test_a_batch_depends_on_seed_purpose_and_number_alone() -> None:
    batches = Batches(SMALL, MOTION)
    first = batches.batch("network", 7, 50)
    batches.batch("dense", 3, 20)
    assert equal(first, batches.batch("network", 7, 50))
    assert equal(first, Batches(SMALL, MOTION).batch("network", 7, 50))
    for other in (batches.batch("network", 8, 50), batches.batch("dense", 7, 50)):
        assert not equal(first, other)
    assert not equal(batch(), batch(replace(SMALL, seed=2)))


@pytest.mark.parametrize("configuration", [SMALL, PAPER])
def test_held_out_examples_are_others_than_those_of_training(configuration: Configuration) -> None:
    trained, held_out = (batch(configuration, held_out=kind) for kind in (False, True))
    assert not np.any(np.isin(trained.residual, held_out.residual) & (trained.residual != 0.0))


def test_held_out_motions_and_effects_are_others_too(few_effects: None) -> None:
    trained, held_out = (Batches(WITH_EFFECTS, MOTION, held_out=kind) for kind in (False, True))
    assert len(held_out._recordings.measured) == 1
    assert trained._recordings.effects == held_out._recordings.effects
    for name in ("measured", "true", "added", "parameters"):
        made, other = (vars(some._recordings)[name][0] for some in (trained, held_out))
        assert not np.allclose(made, other)


# ---- images of remainders, for a network with a start


def quiet(monkeypatch: pytest.MonkeyPatch, kind: int) -> None:
    """No noise in the effort, and guesses of one kind."""
    monkeypatch.setattr(data, "NOISE", (1e-12, 2e-12))
    monkeypatch.setattr(data, "GUESSES", np.eye(3)[kind])


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_label_is_guess_minus_truth_as_the_nominal_motion_shows_it(
    monkeypatch: pytest.MonkeyPatch, kind: int
) -> None:
    """Where nothing disturbs the effort: the remainder's parameters with the sign changed."""
    quiet(monkeypatch, kind)
    ideal = replace(MOTION, count=0.0, noise=0.0, largest_lag=0.0)
    batches = Batches(SMALL, ideal)
    some = batches.batch("test", 0, 300)
    wanted = -some.measured_effort @ batches.inverse.T
    missed = np.linalg.norm(some.residual - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    assert np.median(missed) < (1e-3 if kind == 0 else 0.1)  # near the truth the filter shows
    np.testing.assert_allclose(effort_scale(some.measured_effort, "effort-scale"), 1.0)


def test_label_goes_through_the_motion_that_was_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """A motion 3 % larger shows three per cent more inertia and viscous friction."""
    quiet(monkeypatch, 0)
    larger = np.diag([1.03, 1.03, 1.0, 1.0])

    def exact(regressor: np.ndarray) -> Recordings:
        return Recordings(regressor[None], regressor[None], (), np.zeros(0), np.zeros(0))

    nominal = MOTION.scaled_regressor(100)
    monkeypatch.setattr(data, "make_recordings", lambda *_, **__: exact(nominal @ larger))
    batches = Batches(SMALL, MOTION)
    examples = batches.examples(np.random.default_rng(1), 50)
    some = batches._with_guesses(examples, np.random.default_rng(2))
    difference = (np.array(SMALL.start_shares) - examples.truth) @ larger
    scale = effort_scale(difference @ nominal.T, "effort-scale")
    np.testing.assert_allclose(some.residual, difference / scale[:, None], atol=1e-9)


def test_the_image_is_of_the_starts_effort_and_the_remainder() -> None:
    batches = Batches(SMALL, MOTION)
    some = batches.batch("test", 0, 20)
    start = batches.nominal @ np.array(SMALL.start_shares)
    np.testing.assert_array_equal(some.model_effort, np.tile(start, (20, 1)))
    np.testing.assert_array_equal(some.offset, 0.0)


def test_guesses_are_the_start_and_answers_near_and_far() -> None:
    some = batch(count=2000)
    at_start = np.all(some.guess == np.array(SMALL.start_shares), axis=1)
    assert 0.25 < np.mean(at_start) < 0.35


def recorded_with(monkeypatch: pytest.MonkeyPatch, added: float) -> tuple[Batches, np.ndarray]:
    """Every drive has one effect: a parabola over time."""
    monkeypatch.setattr(data, "EFFECTS", (0.0, 1.0, 0.0))
    nominal = MOTION.scaled_regressor(100)
    parabola = np.linspace(-1.0, 1.0, 100) ** 2
    drives = np.array([[[[0.2, 0.4, 0.3, 0.1], [0.1, 0.3, 0.6, -0.1]]]])
    effect = np.broadcast_to(added * parabola, (1, 1, 2, 100))
    made = Recordings(nominal[None], nominal[None], ("parabola",), drives, effect)
    monkeypatch.setattr(data, "make_recordings", lambda *_, **__: made)
    return Batches(WITH_EFFECTS, MOTION), parabola


def test_an_effect_is_in_the_measured_effort_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    quiet(monkeypatch, 0)
    batches, parabola = recorded_with(monkeypatch, 0.3)
    examples = batches.examples(np.random.default_rng(1), 50)
    beside = examples.measured - examples.truth @ batches.nominal.T
    ratio = beside @ parabola / (parabola @ parabola)
    assert np.all(ratio > 0.05)
    np.testing.assert_allclose(beside, ratio[:, None] * parabola, atol=1e-9)
    np.testing.assert_allclose(effort_scale(examples.measured, "effort-scale"), 1.0)


def test_an_effect_changes_the_label_in_scale_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The remainder's scale grows; what it says of the drive stays."""
    quiet(monkeypatch, 1)
    without = recorded_with(monkeypatch, 0.0)[0].batch("test", 0, 60).residual
    disturbed = recorded_with(monkeypatch, 0.3)[0].batch("test", 0, 60).residual
    with_size, size = (np.linalg.norm(some, axis=1) for some in (disturbed, without))
    assert np.median(with_size) < 0.5 * np.median(size)
    np.testing.assert_allclose(disturbed / with_size[:, None], without / size[:, None], atol=1e-6)


# ---- the paper's images


def test_half_of_the_papers_examples_match() -> None:
    matching = np.all(np.abs(batch(PAPER, 400).residual) < 1e-9, axis=1)
    assert 0.4 < np.mean(matching) < 0.6


def test_turned_factors_make_the_turned_image() -> None:
    rng = np.random.default_rng(3)
    model, measured = rng.normal(size=(8, 30)), rng.normal(size=(8, 30))
    turns = np.arange(8) % 4
    left, right = rotate(model, measured, turns)
    for number, quarters in enumerate(turns):
        image = np.outer(model[number], measured[number])
        turned = np.outer(left[number], right[number])
        np.testing.assert_array_equal(turned, np.rot90(image, quarters))


def test_the_papers_turned_images_keep_their_labels() -> None:
    """The paper's, and wrong: half a turn changes the sign of what an odd effort says."""
    turned, upright = (batch(replace(PAPER, rotations=on)) for on in (True, False))
    np.testing.assert_array_equal(turned.residual, upright.residual)
    same = np.all(turned.measured_effort == upright.measured_effort, axis=1)
    assert 0.15 < np.mean(same) < 0.35


# ---- what the warm start reads


def test_basis_is_least_squares_then_what_parameters_leave(few_effects: None) -> None:
    batches = Batches(WITH_EFFECTS, MOTION)
    basis = batches.basis()
    assert basis.shape == (4 + data.DETAILS, 100)
    np.testing.assert_allclose(basis[:4] @ batches.nominal, np.eye(4), atol=1e-9)
    np.testing.assert_allclose(basis[4:] @ batches.nominal, 0.0, atol=1e-6)
    described = batches.batch("test", 0, 4000).measured_effort @ basis[4:].T
    np.testing.assert_allclose(np.std(described, axis=0), 0.3, atol=0.1)


def test_basis_without_effects_is_least_squares_alone() -> None:
    batches = Batches(SMALL, MOTION)
    np.testing.assert_array_equal(batches.basis(), np.linalg.pinv(batches.nominal))

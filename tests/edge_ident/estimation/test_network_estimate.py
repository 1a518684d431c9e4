"""The loop, with stand-ins whose answers are known and with the package's network."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.estimation import network_estimate
from edge_ident.estimation.image import Subsampled, effort_scale
from edge_ident.estimation.manifest import VARIANTS, Variant
from edge_ident.estimation.network import Network, load_network
from edge_ident.estimation.network_estimate import NetworkEstimate, motion_mismatch
from tests.edge_ident.stand_ins import (
    COLUMNS,
    SCALES,
    SHAPES,
    START,
    Answer,
    StandIn,
    nothing,
    reader,
)

Array = NDArray[np.float64]

FEED_DRIVE = np.array([0.12, 0.27, 0.45, 0.03])
"""N·m·s²/rad, N·m·s/rad, N·m, N·m: friction about even, little inertia, as on a slow screw."""


def identify(
    network: Network, effort: Array, columns: Array = COLUMNS, **options: int
) -> NetworkEstimate:
    return network_estimate.estimate(columns, effort, network, **options)


# ---- from one start, reading what the guess leaves of the effort


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_an_exact_reader_needs_one_pass_and_another_to_see_that_nothing_moves(unit: float) -> None:
    stand_in = StandIn(reader(), START)
    found = identify(stand_in, COLUMNS @ (unit * FEED_DRIVE))
    assert found.passes == stand_in.passes == 2
    assert found.trusted
    np.testing.assert_allclose(found.parameters, unit * FEED_DRIVE, rtol=1e-5)


@pytest.mark.parametrize("amplitude", [0.97, 1.03])
def test_a_recording_of_another_amplitude_takes_no_more_passes(amplitude: float) -> None:
    """Answers belong to the network's motion, and are seen through the recording's own."""
    columns = COLUMNS * [amplitude, amplitude, 1.0, 1.0]
    found = identify(StandIn(reader(), START), columns @ FEED_DRIVE, columns)
    assert found.passes == 2
    np.testing.assert_allclose(found.parameters, FEED_DRIVE, rtol=1e-5)


@pytest.mark.parametrize(
    "answer", [reader(0.9), reader(1.1), reader(error=np.array([0.02, -0.02, 0.02, 0.02]))]
)
def test_every_pass_adds_digits(answer: Answer) -> None:
    """Residuals come in shares of the remainder, so what a pass misses shrinks with it."""
    errors = []
    for passes in (1, 2, 3):
        found = identify(StandIn(answer, START), COLUMNS @ FEED_DRIVE, passes=passes)
        assert found.passes == passes
        errors.append(np.linalg.norm((found.parameters - FEED_DRIVE) * SCALES))
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.2 * errors[1]


def test_what_the_model_lacks_does_not_move_the_answer_to_fit_it() -> None:
    """A reader that looks away from the disturbance is not overruled by the better fit."""
    disturbed = COLUMNS @ FEED_DRIVE
    disturbed[60:] += 0.2
    found = identify(StandIn(reader(rows=slice(0, 60)), START), disturbed)
    np.testing.assert_allclose(found.parameters, FEED_DRIVE, rtol=1e-4)
    fitted = np.linalg.lstsq(COLUMNS, disturbed, rcond=None)[0]
    missed = np.linalg.norm(disturbed - COLUMNS @ fitted) / np.linalg.norm(disturbed)
    assert missed < 0.7 * found.relative_residual
    assert np.max(np.abs(fitted / FEED_DRIVE - 1.0)) > 0.1


def test_steps_that_grow_end_the_loop_before_they_count() -> None:
    stand_in = StandIn(reader(2.5), START)
    found = identify(stand_in, COLUMNS @ (np.array([0.9, 0.9, 0.9, 0.1]) / SCALES))
    assert found.passes == stand_in.passes == 2
    once = identify(
        StandIn(reader(2.5), START), COLUMNS @ (np.array([0.9, 0.9, 0.9, 0.1]) / SCALES), passes=1
    )
    np.testing.assert_array_equal(found.parameters, once.parameters)


@pytest.mark.parametrize(("part", "goes_on"), [(0.3, True), (0.1, False)])
def test_a_step_that_grows_after_a_remainder_that_shrank_makes_up_for_the_one_before(
    part: float, goes_on: bool
) -> None:
    """A coarse network reads all but a hundredth, then a part of the rest, then all of it.

    What is left of the rest has 0.7 or 0.9 of its scale; noise shrinks by less than the first.
    """
    shares = iter((0.99, part, 1.0, 1.0))
    stand_in = StandIn(lambda image: reader(next(shares))(image), START)
    found = identify(stand_in, COLUMNS @ FEED_DRIVE)
    error = np.max(np.abs(found.parameters / FEED_DRIVE - 1.0))
    assert (error < 1e-5) == goes_on
    assert found.passes == (4 if goes_on else 3)


def test_a_drive_that_is_the_start_leaves_nothing_to_read() -> None:
    """Its remainder is zero, which has no scale."""
    shares = np.array(START) / effort_scale(SHAPES @ np.array(START), "effort-scale")
    found = identify(StandIn(reader(), tuple(shares)), SHAPES @ shares)
    np.testing.assert_allclose(found.parameters, np.maximum(shares, 0.0) / SCALES, atol=1e-3)


def test_recordings_read_together_are_found_as_each_alone_in_as_many_batches_as_the_longest() -> (
    None
):
    """One drive needs more passes than the other, and goes on alone."""
    drives = [np.array([0.5, 0.5, 0.5, 0.0]) / SCALES, np.array([0.9, 0.1, 0.1, 0.5]) / SCALES]
    alone = [identify(StandIn(reader(0.7), START), COLUMNS @ drive, passes=12) for drive in drives]
    stand_in = StandIn(reader(0.7), START)
    batches: list[int] = []
    answer = stand_in.residual_shares

    def counted(images: NDArray[np.float32]) -> Array:
        batches.append(len(images))
        return answer(images)

    stand_in.residual_shares = counted  # type: ignore[method-assign]
    together = network_estimate.estimate_together(
        [Subsampled(COLUMNS, COLUMNS @ drive) for drive in drives], stand_in, passes=12
    )
    assert alone[0].passes < alone[1].passes == len(batches)
    assert sum(batches) == sum(found.passes for found in alone)
    for found, expected in zip(together, alone, strict=True):
        np.testing.assert_array_equal(found.parameters, expected.parameters)
        assert found.passes == expected.passes


# ---- from random starts, reading guess and measurement


def knowing(truth_nm: Array, part: float) -> Answer:
    """Part of the residual of the guess in the image, for networks without a start."""
    effort = COLUMNS @ truth_nm
    scale = effort_scale(effort, "effort-scale")
    measured, truth = effort / scale, truth_nm * SCALES / scale

    def answer(image: Array) -> Array:
        model = image @ measured / (measured @ measured)
        return part * (np.linalg.lstsq(SHAPES, model, rcond=None)[0] - truth)

    return answer


def test_a_perfect_answer_takes_one_pass() -> None:
    stand_in = StandIn(knowing(FEED_DRIVE, 1.0), None)
    found = identify(stand_in, COLUMNS @ FEED_DRIVE)
    assert found.passes == stand_in.passes == 1
    np.testing.assert_allclose(found.parameters, FEED_DRIVE, atol=1e-4)


def test_a_step_that_goes_too_far_is_halved() -> None:
    found = identify(StandIn(knowing(FEED_DRIVE, 3.0), None), COLUMNS @ FEED_DRIVE)
    assert found.relative_residual < 0.02


def test_a_useless_network_is_not_trusted_and_gets_no_more_passes_than_allowed() -> None:
    stand_in = StandIn(nothing, None)
    found = identify(stand_in, COLUMNS @ FEED_DRIVE, passes=5)
    assert stand_in.passes == found.passes == 5
    assert not found.trusted
    assert "unexplained" in found.reason


def test_the_seed_alone_decides_on_random_starts() -> None:
    network, effort = StandIn(knowing(FEED_DRIVE, 0.7), None), COLUMNS @ FEED_DRIVE
    first, again, other = (identify(network, effort, seed=s, passes=2) for s in (4, 4, 5))
    np.testing.assert_array_equal(first.parameters, again.parameters)
    assert not np.array_equal(first.parameters, other.parameters)


# ---- in either case


@pytest.mark.parametrize(
    "network", [StandIn(reader(), START), StandIn(knowing(FEED_DRIVE, 1.0), None)]
)
def test_what_physics_forbids_never_comes_out(network: StandIn) -> None:
    negative_friction = FEED_DRIVE * np.array([1.0, -1.0, 1.0, 1.0])
    found = identify(network, COLUMNS @ negative_friction)
    assert np.all(found.parameters[:3] > 0.0)
    assert not found.trusted


@pytest.mark.parametrize("start", [START, None])
def test_no_effort_is_an_error(start: tuple[float, ...] | None) -> None:
    with pytest.raises(DataError, match="zero in every sample"):
        identify(StandIn(nothing, start), np.zeros(100))


def test_deviations_grow_with_what_is_left_unexplained() -> None:
    """The stand-in's manifest says 0.001, and 1.0 times the relative residual."""
    effort = COLUMNS @ FEED_DRIVE
    unit = effort_scale(effort, "effort-scale") / SCALES
    sure = identify(StandIn(reader(), START), effort)
    np.testing.assert_allclose(sure.std, 0.001 * unit, rtol=1e-3)
    disturbed = effort + 0.1 * np.cos(np.arange(100.0))
    unit = effort_scale(disturbed, "effort-scale") / SCALES
    unsure = identify(StandIn(reader(), START), disturbed)
    assert unsure.relative_residual > 0.05
    np.testing.assert_allclose(unsure.std, np.hypot(0.001, unsure.relative_residual) * unit)


def test_mismatch_is_zero_for_its_own_motion_and_large_for_another() -> None:
    network = StandIn(nothing, START)
    limit = network.manifest.mismatch_limit
    assert motion_mismatch(COLUMNS, network) == 0.0
    slightly_larger = COLUMNS * [1.02, 1.02, 1.0, 1.0]
    assert motion_mismatch(slightly_larger, network) == pytest.approx(0.02)
    quarter_period_late = np.roll(COLUMNS, 25, axis=0)
    assert motion_mismatch(quarter_period_late, network) > limit


# ---- the network of the package


def random_drives(count: int) -> Array:
    """Parameters (count, 4), SI: any share of friction, little inertia to mostly inertia."""
    return np.random.default_rng(11).uniform(
        [0.05, 0.1, 0.1, -0.2], [1.0, 1.0, 1.0, 0.2], (count, 4)
    )


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_the_packages_network_identifies_drives_at_any_scale(variant: Variant, unit: float) -> None:
    network = load_network(variant)
    for truth in unit * np.vstack([FEED_DRIVE, random_drives(20)]):
        effort = COLUMNS @ truth
        found = identify(network, effort)
        error = (found.parameters - truth) * SCALES / effort_scale(effort, "effort-scale")
        assert np.max(np.abs(error)) < 1e-3
        assert found.trusted
        assert found.passes <= 8
        assert found.relative_residual < 1e-3
        assert found.time_spectral > 0.999


def test_errors_of_the_packages_network_agree_with_its_deviations() -> None:
    network, rng, ratios = load_network(), np.random.default_rng(12), []
    for truth in random_drives(40):
        effort = COLUMNS @ truth
        found = identify(network, effort + 0.002 * rng.normal(size=100))
        ratios.append((found.parameters - truth) / found.std)
    assert 0.2 < np.sqrt(np.mean(np.square(ratios))) < 1.5

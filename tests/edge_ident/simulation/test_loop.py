"""Sampled control around a machine: the board's law, counts, noise, references."""

import numpy as np
import pytest

from edge_ident.errors import DataError
from edge_ident.model.model import BASE, AxisModel, Term
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.loop import Controllers, Counting, named_references, recorded_references
from edge_ident.simulation.simulate import Scenario, reduced_model, simulate_drives, soft_gains
from firmware_interface.gains import CONSERVATIVE_GAINS, AxisGains
from firmware_interface.virtual.controller import AxisController, Setpoint

PERIOD_S = 0.0025
COUNT_RAD = 2 * np.pi / 8400


def test_control_law_is_that_of_the_board_sample_by_sample() -> None:
    gains = [
        AxisGains(
            *(30.0, 4.0, 12.0, 0.01, 0.4, 0.9, 1.4, 0.1, 0.2, 0.6, 0.7, -0.3),
            ripple_cosine=(0.3, 0.0, 0.0, -0.2),
            ripple_sine=(0.1, 0.5, 0.0, 0.0),
            ripple_period_rad=(6.3, 0.3, 1.0, 0.05),
        ),
        AxisGains(200.0, 20.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0),
    ]
    rng = np.random.default_rng(2)
    together = Controllers({"x": gains}, PERIOD_S, np.zeros((1, 2)))
    alone = [AxisController(g, PERIOD_S, 1e9) for g in gains]
    for _ in range(50):
        reference, position = rng.normal(size=3), rng.normal(size=2)
        found = together.effort(reference[:, None], position[None])[0]
        wanted = [
            controller.effort_nm(Setpoint(*reference), p)
            for controller, p in zip(alone, position, strict=True)
        ]
        np.testing.assert_allclose(found, wanted, rtol=1e-11)


def test_soft_gains_of_the_built_in_drive_are_much_like_the_boards_start_up_gains() -> None:
    references = named_references({"x": "rad", "z": "rad"}, "sinusoid")
    for i, axis in enumerate(reduced_model().axes.values()):
        [gains] = soft_gains(axis, references.motion(i), references.period_s)
        assert gains.proportional == pytest.approx(CONSERVATIVE_GAINS.proportional, rel=0.3)
        assert gains.derivative == pytest.approx(CONSERVATIVE_GAINS.derivative, rel=0.3)
        assert gains.inertia_feedforward == CONSERVATIVE_GAINS.inertia_feedforward == 0.0


def test_counting_rounds_to_whole_counts_and_leaves_exact_axes_alone() -> None:
    values = np.array([[0.3, -0.4], [0.3, -0.4]])
    for resolution, expected in (
        ([[0.25], [0.0]], [[0.25, -0.5], [0.3, -0.4]]),
        ([[0.25], [0.25]], [[0.25, -0.5], [0.25, -0.5]]),
        ([[0.0], [0.0]], values),
    ):
        np.testing.assert_array_equal(Counting(np.array(resolution)).counted(values), expected)


def short_references() -> Recording:
    time = PERIOD_S * np.arange(400)
    position = 0.5 * np.sin(3.0 * time + 0.3)
    return Recording(time, {"x": AxisRecord(position, 0 * time, "rad", "N*m")}, "test")


def drives() -> AxisModel:
    values = {"inertia": 0.4, "viscous_friction": 0.9, "coulomb_friction": 1.4, "offset": 0.1}
    return AxisModel((Term(BASE, values),))


def scenario(noise: float = 0.0, seed: int = 0, counts: float | None = None) -> Scenario:
    references = recorded_references(short_references(), {"x": "rad"})
    return Scenario(references, encoder_counts=counts, noise=noise, stiff=True, seed=seed)


def test_records_are_in_counts_of_encoder_and_effort() -> None:
    found = simulate_drives({"x": drives()}, scenario())
    for column, count in ((found.position, COUNT_RAD), (found.effort, 0.004)):
        in_counts = column / count
        np.testing.assert_allclose(in_counts, np.round(in_counts), atol=1e-6)
    assert 0 < np.max(np.abs(found.position - found.true_position)) <= COUNT_RAD / 2 + 1e-12


def test_an_exact_encoder_reads_the_true_position() -> None:
    found = simulate_drives({"x": drives()}, scenario(counts=0.0))
    np.testing.assert_array_equal(found.position, found.true_position)


def test_noise_has_its_share_of_the_effort_and_follows_the_seed() -> None:
    clean, noisy, again, other = (
        simulate_drives({"x": drives()}, scenario(noise, seed)).effort
        for noise, seed in ((0.0, 1), (0.05, 1), (0.05, 1), (0.05, 2))
    )
    share = np.std(noisy - clean) / np.sqrt(np.mean(clean**2))
    assert share == pytest.approx(0.05, rel=0.15)
    np.testing.assert_array_equal(noisy, again)
    assert np.any(noisy != other)


def test_a_stiff_drive_follows_within_a_few_counts() -> None:
    chosen = scenario()
    found = simulate_drives({"x": drives()}, chosen)
    miss = found.true_position[:, 0] - chosen.references.recorded
    assert np.sqrt(np.mean(miss**2)) < 5 * COUNT_RAD


def test_a_recorded_motion_is_reached_smoothly_from_rest() -> None:
    references = recorded_references(short_references(), {"x": "rad"})
    position, velocity, acceleration = references.motion(0)
    assert velocity[0] == acceleration[0] == 0.0
    start = int(np.argmin(np.abs(references.time_s)))
    assert position[start] == pytest.approx(0.5 * np.sin(0.3), abs=1e-4)
    assert velocity[start] == pytest.approx(1.5 * np.cos(0.3), rel=1e-2)
    steps = np.abs(np.diff(acceleration))
    assert np.max(steps) < 0.05 * np.max(np.abs(acceleration)), "no jerk at the seam"
    np.testing.assert_allclose(
        np.gradient(position, PERIOD_S)[1:-1], velocity[1:-1], atol=2e-4 * np.max(velocity)
    )


def test_a_recording_of_another_drive_is_refused() -> None:
    for axes in ({"z": "rad"}, {"x": "m"}):
        with pytest.raises(DataError, match="the model has axis"):
            recorded_references(short_references(), axes)


def test_named_motions_of_axes_in_metres_go_as_far_as_the_built_in_screw() -> None:
    references = named_references({"q": "m"}, "sinusoid")
    assert np.max(np.abs(references.position)) == pytest.approx(0.004, rel=1e-6)
    assert len(references.recorded[0]) == 8742

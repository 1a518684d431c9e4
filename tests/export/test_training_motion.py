"""Motions to train for: the paper's and those of recordings, and how they vary."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.errors import DataError
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording
from export import motion
from export.motion import (
    AMPLITUDE_SPREAD,
    lap_samples,
    measured_position,
    motion_from,
    paper_motion,
    perturbed,
)
from tests.measured import MeasuredData

PERIOD_S = 0.002
COUNT_M = 50e-9


def carriage(
    laps: float = 3.0, samples_a_lap: int = 2000, axes: tuple[str, ...] = ("q",)
) -> Recording:
    """A carriage in metres on two sines that repeat after four seconds."""
    time = PERIOD_S * np.arange(round(laps * samples_a_lap))
    rate = 2.0 * np.pi / (samples_a_lap * PERIOD_S)
    position = 0.1 * np.sin(rate * time) + 0.04 * np.cos(2.0 * rate * time)
    position = COUNT_M * np.round(position / COUNT_M)
    record = AxisRecord(position, np.zeros(len(time)), "m", "N")
    return Recording(time, dict.fromkeys(axes, record), "carriage.csv")


def test_the_papers_motion() -> None:
    paper = paper_motion()
    time = 0.0025 * 8742 * (np.arange(100) + 0.5) / 100
    columns = paper.scaled_regressor(100) * paper.column_scales
    np.testing.assert_allclose(columns[:, 1], 1.80642 * np.cos(0.2875 * time), atol=5e-3)
    np.testing.assert_allclose(paper.column_scales, [0.519345, 1.806416, 1.0, 1.0], rtol=1e-5)
    assert paper.partner is not None
    np.testing.assert_allclose(paper.partner[0], np.roll(paper.velocity, -8742 // 4), atol=2e-3)


# ---- of a recording


def test_a_recordings_motion_is_one_lap_in_the_recordings_units() -> None:
    found = motion_from(carriage(), None, "carriage")
    assert (found.name, found.position_unit, found.effort_unit) == ("carriage", "m", "N")
    assert len(found.position) == 2000
    assert found.count == pytest.approx(COUNT_M)
    assert found.noise == pytest.approx(COUNT_M / np.sqrt(12.0), rel=0.1)
    assert found.largest_lag == 0.0
    assert found.partner is None
    angle = np.pi / 2.0 * found.time_s
    velocity = np.pi / 2.0 * (0.1 * np.cos(angle) - 0.08 * np.sin(2.0 * angle))
    np.testing.assert_allclose(found.velocity, velocity, atol=1e-4 * np.max(velocity))


def test_a_motion_that_does_not_repeat_is_taken_whole() -> None:
    assert len(motion_from(carriage(laps=1.2), None, "once").position) == 2400


def test_laps_of_too_few_samples_are_refused() -> None:
    with pytest.raises(DataError, match="a lap has 60 samples, fewer than 100"):
        motion_from(carriage(laps=9.0, samples_a_lap=60), None, "fast")


def test_uneven_samples_give_the_motion_of_even_ones() -> None:
    even = carriage()
    late = even.time_s + 0.4 * PERIOD_S * np.sin(np.arange(len(even.time_s)))
    late[[0, -1]] = even.time_s[[0, -1]]
    angle = np.pi / 2.0 * late
    position = 0.1 * np.sin(angle) + 0.04 * np.cos(2.0 * angle)
    axis = AxisRecord(position, even.axes["q"].effort, "m", "N")
    found, wanted = (
        motion_from(recording, None, "carriage")
        for recording in (Recording(late, {"q": axis}, "late"), even)
    )
    difference = np.std(found.acceleration - wanted.acceleration)
    assert difference < 1e-3 * np.std(wanted.acceleration)


def test_the_emps_carriage_makes_laps_of_6_24_s(measured_data: MeasuredData) -> None:
    found = motion_from(load_recording(measured_data / "emps_train.csv"), None, "emps")
    assert len(found.position) * found.period_s == pytest.approx(6.24, abs=2e-3)
    assert (found.position_unit, found.effort_unit) == ("m", "N")
    assert found.count == pytest.approx(50e-9)


def test_one_axis_of_several_has_to_be_named() -> None:
    two = carriage(axes=("x", "z"))
    assert motion_from(two, "z", "some").position_unit == "m"
    for wrong in (None, "y"):
        with pytest.raises(DataError, match="there are x, z"):
            motion_from(two, wrong, "some")


def lap(angle: np.ndarray) -> np.ndarray:
    """Nearly twice as fast as it is: the second half differs in a small part only."""
    return np.sin(2.0 * angle) + 0.4 * np.cos(angle)


def back_and_forth(angle: np.ndarray) -> np.ndarray:
    """A trapezoid with dwells at both ends."""
    return np.clip(2.0 * np.sin(angle), -1.0, 1.0)


@pytest.mark.parametrize("shape", [np.sin, lap, back_and_forth])
@pytest.mark.parametrize("offset", [0.0, 50.0])
def test_laps_are_found_wherever_the_axis_is(shape: object, offset: float) -> None:
    assert callable(shape)
    noise = 1e-3 * np.random.default_rng(1).normal(size=3500)
    position = shape(2.0 * np.pi * np.arange(3500) / 1000.0) + noise + offset
    assert lap_samples(position) == pytest.approx(1000, abs=3)


@pytest.mark.parametrize(
    "position",
    [
        np.sin(2.0 * np.pi * np.linspace(0.0, 1.0, 2000)),
        np.sin(2.0 * np.pi * np.linspace(0.0, 1.9, 2000)),
        np.linspace(0.0, 30.0, 2000),
        np.sin(2.0 * np.pi * 10.0 * np.linspace(0.3, 1.0, 2000) ** 2),
        np.cumsum(np.random.default_rng(3).normal(size=2000)),
    ],
    ids=["one lap", "not two laps", "ramp", "sweep", "random walk"],
)
def test_what_does_not_repeat_has_no_laps(position: np.ndarray) -> None:
    assert lap_samples(position) is None


@pytest.mark.filterwarnings("error")
def test_a_standing_axis_has_no_laps() -> None:
    assert lap_samples(np.full(500, 0.3)) is None


# ---- how recordings of one motion differ


def test_motions_differ_in_amplitude_and_stay_consistent() -> None:
    paper = replace(paper_motion(), largest_lag=0.0)
    made = list(perturbed(paper, np.random.default_rng(1), 20))
    amplitudes = [np.max(at.position) / np.max(paper.position) for at in made]
    assert 1.0 - AMPLITUDE_SPREAD <= min(amplitudes) < 0.99
    assert 1.01 < max(amplitudes) <= 1.0 + AMPLITUDE_SPREAD
    for at, amplitude in zip(made, amplitudes, strict=True):
        np.testing.assert_allclose(at.velocity, amplitude * paper.velocity, rtol=1e-5, atol=1e-9)
        np.testing.assert_array_equal(at.direction, np.sign(at.velocity))


def test_half_of_the_papers_motions_lag_and_stand_still_after_reversals() -> None:
    paper = paper_motion()
    made = list(perturbed(paper, np.random.default_rng(1), 30))
    standing = [int(np.count_nonzero(at.velocity == 0.0)) for at in made]
    assert 8 <= np.count_nonzero(standing) <= 22
    largest = max(standing) * paper.period_s
    # behind by 2·lag: cos(0.2875 t) = 1 - 2·0.08/2π after 0.79 s, twice a period, less the rise
    assert 0.5 < largest < 2.0 * 0.79
    for at, samples in zip(made, standing, strict=True):
        derived = np.gradient(at.position, paper.period_s)[1:-1]
        wrong = np.abs(at.velocity[1:-1] - derived) > 1e-3
        assert np.count_nonzero(wrong) <= 2  # the lap is whole but for half a millisecond
        if samples:
            turned = np.flatnonzero(np.diff(np.abs(np.sign(at.velocity))) < 0)
            assert len(turned) == 2
            extremes = np.abs(at.position[turned])
            np.testing.assert_allclose(extremes, np.max(np.abs(at.position)), rtol=1e-3)


def test_lag_is_friction_behind_soft_gains() -> None:
    """The axis follows as far behind as friction makes it, and settles to a shifted motion."""
    paper = paper_motion()
    position, velocity, _ = motion._lagging(paper.position, 0.08, paper.period_s)
    behind = (paper.position - position) * np.sign(paper.velocity)
    fast = np.abs(paper.velocity) > 0.5 * np.max(paper.velocity)
    np.testing.assert_allclose(behind[fast], 0.08, atol=2e-3)
    assert np.max(np.abs(position)) == pytest.approx(2.0 * np.pi - 0.08, abs=1e-3)
    assert np.all(velocity[fast] * paper.velocity[fast] > 0.0)


def test_the_other_axis_is_the_source_where_it_is_known() -> None:
    paper = paper_motion()
    [alone] = perturbed(replace(paper, partner=None), np.random.default_rng(1), 1)
    assert alone.source is None
    [pair] = perturbed(paper, np.random.default_rng(1), 1)
    assert pair.source is not None
    assert paper.partner is not None
    np.testing.assert_array_equal(pair.source.velocity, paper.partner[0])
    np.testing.assert_array_equal(pair.source.acceleration, paper.partner[1])


@pytest.mark.parametrize("noise_counts", [0.2887, 1.0, 3.0])
def test_the_encoder_reads_whole_counts_with_the_recordings_noise(noise_counts: float) -> None:
    paper = paper_motion()
    noisy = replace(paper, noise=noise_counts * paper.count)
    read = measured_position(noisy, paper.position, np.random.default_rng(1))
    counts = read / paper.count
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    assert np.std(read - paper.position) == pytest.approx(noisy.noise, rel=0.05)


def test_a_position_without_counts_is_read_as_it_is_but_for_noise() -> None:
    ideal = replace(paper_motion(), count=0.0, noise=0.0)
    read = measured_position(ideal, ideal.position, np.random.default_rng(1))
    np.testing.assert_array_equal(read, ideal.position)

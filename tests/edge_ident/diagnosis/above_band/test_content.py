"""What lies above the band is found where it is, with its amplitude, and nothing in noise."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.content import BandContent, above_band
from edge_ident.diagnosis.above_band.held import held
from edge_ident.diagnosis.above_band.spectrum import over_time
from edge_ident.diagnosis.measures import TOLERANCE, SpectralLine
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.model import Estimate, Model, base_axis
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording
from edge_ident.simulation.simulate import simulate
from tests.measured import MeasuredData
from tests.repetitions import a_few

Array = NDArray[np.float64]

INERTIA, VISCOUS, COULOMB = 0.5, 0.8, 1.2
NOISE = 0.03
PERIOD_S = 0.0025
COUNT = 2.0 * np.pi / 2**16
TURN = 2.0 * np.pi
ORDERS = (36.0, 72.0)


def recorded(
    seed: int,
    *,
    samples: int = 4000,
    jitter: float = 0.0,
    count: float = COUNT,
    order: tuple[float, float] = (0.0, 1.0),
    line: tuple[float, float] = (0.0, 1.0),
    line_until_s: float = np.inf,
    sweep: tuple[float, float, float] = (0.0, 1.0, 1.0),
) -> Recording:
    """An axis that turns one way at speeds from 1 to 5 rad/s; amplitude and rate of what it has."""
    rng = np.random.default_rng(seed)
    time_s = PERIOD_S * (np.arange(samples) + jitter * rng.uniform(-0.5, 0.5, samples))
    position = 3.0 * time_s - 2.0 / 0.9 * np.cos(0.9 * time_s)
    velocity = 3.0 + 2.0 * np.sin(0.9 * time_s)
    effort = INERTIA * 1.8 * np.cos(0.9 * time_s) + VISCOUS * velocity + COULOMB
    effort = effort + order[0] * np.cos(order[1] * position)
    acting = time_s < line_until_s
    effort = effort + acting * line[0] * np.sin(TURN * line[1] * time_s)
    size, first_hz, last_hz = sweep
    turns = (first_hz + 0.5 * (last_hz - first_hz) * time_s / time_s[-1]) * time_s
    effort = effort + size * np.sin(TURN * turns)
    effort = effort + NOISE * rng.standard_normal(samples)
    axis = AxisRecord(count * np.round(position / count), effort, "rad", "N*m")
    return Recording(time_s, {"x": axis}, "a test")


def content(*recordings: Recording, axis: str = "x") -> BandContent:
    return above_band(recordings, axis, prepare_axis(recordings, axis))


def count_of(found: BandContent) -> int:
    worth = [one for one in found.unsteady if one.share >= TOLERANCE]
    every = (found.orders, found.unnamed_orders, found.lines, worth)
    return sum(len(some) for some in every)


def test_white_noise_has_neither_orders_nor_lines() -> None:
    """The promise is one false alarm in 500 recordings, before the halves are compared."""
    recording = recorded(0)
    data = prepare_axis([recording], "x")
    alarms = 0
    for seed in range(200):
        effort = recorded(seed).axes["x"].effort
        segments = (replace(data.segments[0], raw_effort=effort),)
        alarms += count_of(above_band([recording], "x", replace(data, segments=segments)))
    assert alarms <= 1


def test_noise_that_falls_steeply_has_no_line_where_it_is_highest() -> None:
    """With a wide block alone, two in five records had one."""
    rng, samples, alarms = np.random.default_rng(11), 8000, 0
    frequency_hz = np.fft.rfftfreq(samples, PERIOD_S)
    for _ in range(40):
        spectrum = np.fft.rfft(rng.standard_normal(samples)) / (1.0 + (frequency_hz / 3.0) ** 4)
        noise = np.fft.irfft(spectrum, samples)
        found = over_time(noise, np.ones(samples), PERIOD_S, TURN * 3.3, TURN * 160.0)
        alarms += bool(np.any(found.prominence > 1.0))
    assert alarms <= 3


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_a_line_in_time_is_found_with_its_amplitude(jitter: float) -> None:
    found = content(recorded(1, line=(0.06, 37.3), jitter=jitter))
    (line,) = found.lines
    assert not found.orders
    assert line.rate == pytest.approx(TURN * 37.3, abs=0.1)
    assert abs(line.amplitude - 0.06) < 4.0 * line.std
    assert line.std < 0.006
    assert line.recorded == pytest.approx(line.share, rel=0.1)


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_an_order_is_found_with_its_amplitude_though_the_speed_varies(jitter: float) -> None:
    found = content(recorded(2, order=(0.08, 36.0), jitter=jitter))
    (order,) = found.orders
    assert not found.lines
    assert not found.unnamed_orders
    assert order.rate == pytest.approx(36.0, abs=0.02)
    assert abs(order.amplitude - 0.08) < 4.0 * order.std
    assert order.std < 0.008
    assert order.recorded == pytest.approx(order.share, rel=0.1)
    assert not order.at_one_speed
    assert 0.0 < order.gain[0] <= order.gain[1] < 1.0


def test_an_order_and_a_line_are_told_apart() -> None:
    found = content(recorded(3, order=(0.08, 36.0), line=(0.05, 61.0)))
    assert [round(s.rate) for s in found.orders] == [36]
    assert [round(s.rate / TURN) for s in found.lines] == [61]


@pytest.mark.parametrize(
    ("amplitude", "first_hz", "last_hz"), [(0.03, 25.0, 90.0), (0.06, 110.0, 60.0)]
)
def test_a_sweep_is_found_with_its_amplitude(
    amplitude: float, first_hz: float, last_hz: float
) -> None:
    """The fast one stands out of the noise of a wider octave. It is just worth naming."""
    found = content(recorded(8, sweep=(amplitude, first_hz, last_hz)))
    (line,) = found.unsteady
    assert not found.lines
    assert line.amplitude == pytest.approx(amplitude, rel=0.2)
    low, high = sorted((first_hz, last_hz))
    assert low - 2.0 < line.lowest_hz < low + 10.0
    assert high - 10.0 < line.highest_hz < high + 2.0


def test_the_rounding_of_an_encoder_is_no_order() -> None:
    assert all(count_of(content(recorded(s, count=TURN / 8400))) == 0 for s in range(10))


def test_what_only_one_half_holds_is_not_reported_unless_another_recording_holds_it() -> None:
    half = recorded(5, line=(0.1, 37.3), line_until_s=4.0)
    assert count_of(content(half)) == 0
    (line,) = content(half, recorded(6, line=(0.1, 37.3))).lines
    assert line.rate == pytest.approx(TURN * 37.3, abs=0.1)


def test_a_motion_that_repeats_makes_no_line_at_its_harmonics() -> None:
    """Friction that turns over with the motion has harmonics in every lap."""
    rng = np.random.default_rng(7)
    time_s = PERIOD_S * np.arange(8000)
    rate = TURN / 4.0
    position = 3.0 * np.sin(rate * time_s)
    velocity = 3.0 * rate * np.cos(rate * time_s)
    bristles = COULOMB * np.tanh(velocity / 0.3)
    effort = -INERTIA * rate**2 * position + bristles + 0.01 * rng.standard_normal(len(time_s))
    axis = AxisRecord(COUNT * np.round(position / COUNT), effort, "rad", "N*m")
    assert count_of(content(Recording(time_s, {"x": axis}, "a test"))) == 0


def test_a_weight_along_a_sinusoid_makes_no_order() -> None:
    """It goes on through every reversal, where samples are left out: ten orders were found there,
    the strongest with 1.3 N·m."""
    rng = np.random.default_rng(2)
    time_s = 0.004 * np.arange(6250)
    rate = TURN * 0.12
    position, velocity = 1.3 * np.sin(rate * time_s), 1.3 * rate * np.cos(rate * time_s)
    effort = -0.9 * rate**2 * position + 6.0 * np.sin(position + 0.2)
    effort += 0.8 * velocity + 1.5 * np.sign(velocity) + 0.02 * rng.standard_normal(len(time_s))
    axis = AxisRecord(1e-5 * np.round(position / 1e-5), effort, "rad", "N*m")
    assert count_of(content(Recording(time_s, {"x": axis}, "a test"))) == 0


def test_a_motion_below_the_noise_of_its_encoder_makes_no_line() -> None:
    """Friction jerks the axis at each reversal of a multisine, faster than the encoder shows at any
    one frequency: what was left of that was a line of 3.8 Hz, 0.07 N·m. A real one stays."""
    axis = base_axis(Estimate(np.array([0.36, 0.6, 1.1, 0.3]), np.zeros(4)))
    moved = simulate(Model({"x": axis, "z": axis}), motion="multisine", noise=0.003, seed=12)
    assert content(moved, axis="z").lines == ()
    record = moved.axes["z"]
    vibrating = record.effort + 0.07 * np.sin(TURN * 3.8 * moved.time_s)
    held_too = replace(moved, axes={**moved.axes, "z": replace(record, effort=vibrating)})
    (line,) = content(held_too, axis="z").lines
    assert line.rate == pytest.approx(TURN * 3.8, rel=1e-3)
    assert line.amplitude == pytest.approx(0.07, rel=0.2)


def jolted(seed: int, *, line: float = 0.0, line_hz: float = 1.0) -> Recording:
    """An axis whose speed changes in steps, each within a tenth of a second."""
    rng = np.random.default_rng(seed)
    fine_s = np.arange(0.0, 16.0, 1e-4)
    steps = np.repeat(rng.uniform(-3.0, 3.0, 20), len(fine_s) // 20)
    window = np.hanning(1000)
    velocity = np.convolve(steps, window / np.sum(window), "same")
    position, acceleration = 1e-4 * np.cumsum(velocity), np.gradient(velocity, 1e-4)
    effort = INERTIA * acceleration + VISCOUS * velocity + COULOMB * np.tanh(velocity / 0.01)
    effort += line * np.sin(TURN * line_hz * fine_s)
    at = slice(None, None, 10)
    noise = NOISE * rng.standard_normal(len(fine_s[at]))
    count = TURN / 4000
    axis = AxisRecord(count * np.round(position[at] / count), effort[at] + noise, "rad", "N*m")
    return Recording(fine_s[at], {"x": axis}, "jolts")


def test_jolts_hide_few_lines_and_make_none() -> None:
    """Where the encoder does not resolve a jolt, what is left of it is larger than the line. One of
    the five lines is not in both halves alike."""
    found = 0
    for seed in range(1, 6):
        assert content(jolted(seed)).lines == ()
        for line in content(jolted(seed, line=0.06, line_hz=31.7)).lines:
            assert line.rate == pytest.approx(TURN * 31.7, rel=1e-3)
            assert line.amplitude == pytest.approx(0.06, rel=0.25)
            found += 1
    assert found >= 4


def resting(seed: int, line: float, line_hz: float) -> Recording:
    """An axis that makes the same moves twice, and rests after each of them."""
    rng = np.random.default_rng(seed)
    time_s = PERIOD_S * np.arange(8000)
    ends_s = np.cumsum(rng.uniform(0.05, 1.0, 40))
    moves = np.searchsorted(ends_s / ends_s[-1], np.linspace(0.0, 1.0, 4000))
    speeds = rng.uniform(-2.0, 2.0, 41) * (np.arange(41) % 2)
    window = np.hanning(80)
    lap = np.convolve(speeds[moves], window / np.sum(window), "same")
    velocity = np.tile(lap - np.mean(lap) * np.abs(lap) / np.mean(np.abs(lap)), 2)
    position, acceleration = PERIOD_S * np.cumsum(velocity), np.gradient(velocity, PERIOD_S)
    effort = INERTIA * acceleration + VISCOUS * velocity + COULOMB * np.tanh(velocity / 0.01)
    effort += line * np.sin(TURN * line_hz * time_s) + 0.01 * rng.standard_normal(len(time_s))
    count = TURN / 8400
    axis = AxisRecord(count * np.round(position / count), effort, "rad", "N*m")
    return Recording(time_s, {"x": axis}, "rests")


@pytest.mark.parametrize(
    ("seed", "line_hz"), a_few([(5, 15.88), (5, 31.7), (9, 15.88), (9, 31.7)], [(9, 15.88)])
)
def test_a_line_is_found_through_the_gaps_of_a_motion_that_often_rests(
    seed: int, line_hz: float
) -> None:
    """What leaked through the gaps was the noise that the line had to stand out of: one of a tenth
    of the effort went unsaid, with *adequate*."""
    assert content(resting(seed, 0.0, line_hz)).lines == ()
    (line,) = content(resting(seed, 0.2, line_hz)).lines
    assert line.rate == pytest.approx(TURN * line_hz, rel=1e-3)
    assert line.amplitude == pytest.approx(0.2, rel=0.1)


def test_the_share_in_band_is_that_of_the_variance() -> None:
    alone = content(recorded(8)).share_in_band
    recording = recorded(8, line=(1.0, 60.0))
    effort = recording.axes["x"].effort
    assert alone > 0.99
    expected = alone * (np.var(effort) - 0.5) / np.var(effort)
    assert content(recording).share_in_band == pytest.approx(expected, rel=0.01)


def test_a_recording_in_metres_has_waves_per_metre() -> None:
    recording = recorded(9, order=(0.08, 36.0))
    axis = recording.axes["x"]
    metres = replace(axis, position=0.001 * axis.position, position_unit="m")
    (order,) = content(replace(recording, axes={"x": metres})).orders
    assert order.rate == pytest.approx(36_000.0, rel=1e-3)


@pytest.mark.parametrize(
    "file", ["laas_motor_speed.csv", "laas_uncompensated.csv", "laas_uncompensated_second.csv"]
)
def test_the_motor_has_cogging_of_72_periods_a_turn(measured_data: MeasuredData, file: str) -> None:
    """A fit by hand at 150 Hz finds 0.20 A."""
    found = content(load_recording(measured_data / file), axis="m")
    cogging = found.orders[0]
    assert cogging.rate == pytest.approx(72.0, abs=0.05)
    assert cogging.amplitude == pytest.approx(0.20, rel=0.15)
    assert found.share_in_band < 0.2, "most of the effort lies above the band"


def test_the_ball_screw_shows_the_turn_of_its_motor(measured_data: MeasuredData) -> None:
    """Its lead is 2.5 mm a turn."""
    found = content(load_recording(measured_data / "emps_train.csv"), axis="q")
    (order,) = found.orders
    assert TURN / order.rate == pytest.approx(2.5e-3, rel=2e-3)
    assert all(line.share < 0.01 for line in found.lines)


def test_another_motion_rules_a_line_out_where_it_would_show_it_and_does_not() -> None:
    known = base_axis(Estimate(np.array([INERTIA, VISCOUS, COULOMB, 0.0]), np.full(4, 0.01)))
    line = SpectralLine(None, 37.3, 0.06, 0.006)
    hidden = replace(line, amplitude=0.002)  # by noise
    assert held(recorded(5, line=(0.06, 37.3)), "x", [line], known) == (line,)
    assert held(recorded(6), "x", [line, hidden], known) == (hidden,)


def test_an_order_is_in_every_recording_that_would_show_it() -> None:
    """What one motion makes at its reversals may look like one; a wave of the machine is there."""
    waves = recorded(5, order=(0.06, 31.4))
    assert [o.rate for o in content(waves).orders] == [pytest.approx(31.4, abs=0.05)]
    assert len(content(waves, recorded(6, order=(0.06, 31.4))).orders) == 1
    assert content(waves, recorded(6)).orders == ()
    noisy = recorded(6).axes["x"]
    noise = np.random.default_rng(7).standard_normal(len(noisy.effort))
    noisy = replace(noisy, effort=noisy.effort + 30.0 * NOISE * noise)
    hidden = replace(recorded(6), axes={"x": noisy})
    assert len(content(waves, hidden).orders) == 1


def answered(seed: int) -> Recording:
    """An axis that goes to and fro, pushed by two strong orders, which its controller lets move it:
    most of their effort is inertia."""
    rng = np.random.default_rng(seed)
    fine_s = np.arange(0.0, 16.0, 1e-4)
    wanted = 1.2 * np.sin(1.1 * fine_s) + 0.5 * np.sin(2.9 * fine_s + 1.0)
    ripple = 0.9 * np.cos(ORDERS[0] * wanted) + 0.6 * np.sin(ORDERS[1] * wanted)
    speed = np.gradient(wanted, fine_s)
    moved = -0.5 * ripple / (INERTIA * (400.0 + (ORDERS[0] * speed) ** 2))
    position = wanted + moved
    velocity = np.gradient(position, fine_s)
    acceleration = np.gradient(velocity, fine_s)
    effort = INERTIA * acceleration + VISCOUS * velocity + COULOMB * np.sign(velocity)
    effort += 0.9 * np.cos(ORDERS[0] * position) + 0.6 * np.sin(ORDERS[1] * position)
    at = slice(5, None, 10)
    noise = NOISE * rng.standard_normal(len(fine_s[at]))
    axis = AxisRecord(1e-6 * np.round(position[at] / 1e-6), effort[at] + noise, "rad", "N*m")
    return Recording(fine_s[at] - fine_s[at][0], {"x": axis}, "an answer")


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_an_order_that_moves_the_axis_beside_another_has_its_rate(seed: int) -> None:
    """Neither what the axis answers nor the other order, in the band, pulls it away."""
    found = content(answered(seed))
    order = max(found.orders, key=lambda one: one.amplitude)
    assert abs(order.rate - ORDERS[1]) < 3.0 * order.rate_std
    assert order.rate_std < 2e-4 * ORDERS[1]
    assert not found.lines

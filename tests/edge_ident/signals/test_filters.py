"""Filtering and differentiation against scipy and against analytic motions, ends included."""

import numpy as np
import pytest
import scipy.signal

from edge_ident.signals import filters
from edge_ident.signals.filters import LONG, differentiate, lowpass
from edge_ident.signals.metrics import rms

PERIOD_S = 0.0025


@pytest.mark.parametrize("phase", [0.0, np.pi / 2, 1.0, 4.0])
def test_derivatives_are_exact_up_to_the_ends(phase: float) -> None:
    angle = 0.2875 * PERIOD_S * np.arange(8742) + phase
    position = 2 * np.pi * np.sin(angle)
    velocity, acceleration = 2 * np.pi * 0.2875 * np.cos(angle), -(0.2875**2) * position
    _, v, a = filters.differentiate(position, 20.0, PERIOD_S)
    np.testing.assert_allclose(v, velocity, atol=1e-6 * 1.8)
    np.testing.assert_allclose(a, acceleration, atol=1e-4 * 0.52)


def test_lowpass_is_a_butterworth_run_both_ways() -> None:
    rng = np.random.default_rng(3)
    noise = rng.normal(size=4000)
    section = scipy.signal.butter(4, 5.0, fs=1 / PERIOD_S, output="sos")
    expected = scipy.signal.sosfiltfilt(section, noise)
    filtered = filters.lowpass(noise, 5.0, PERIOD_S)
    middle = slice(400, -400)
    assert np.max(np.abs(filtered - expected)[middle]) < 0.01 * np.max(np.abs(expected))


def test_lowpass_moves_a_signal_by_a_fraction_of_a_sample() -> None:
    time = PERIOD_S * np.arange(6000)
    moved = filters.lowpass(np.sin(3 * time), 20.0, PERIOD_S, delay_s=0.0017)
    np.testing.assert_allclose(moved[500:-500], np.sin(3 * (time - 0.0017))[500:-500], atol=1e-6)


def test_a_filter_of_two_fifths_of_the_sampling_rate_does_not_ring_where_the_record_begins() -> (
    None
):
    """The axis moves there, and its encoder counts."""
    time_s = PERIOD_S * np.arange(8000)
    position, velocity = 6.0 * np.sin(0.3 * time_s + 1.0), 1.8 * np.cos(0.3 * time_s + 1.0)
    read = 1e-3 * np.round(position / 1e-3)
    _, found, _ = filters.differentiate(read, 160.0, PERIOD_S)
    off = (found - velocity) / (1e-3 / PERIOD_S)
    assert np.max(np.abs(off)) < 1.5
    assert rms(off[:200]) < 1.2 * rms(off)


@pytest.mark.parametrize("samples", [3000, 2 * LONG + 1000])
def test_whitening_does_not_feel_how_the_record_is_continued(samples: int) -> None:
    """A constant stays one: the filter passes the lowest frequencies as they are."""
    level = np.full(samples, 3.0)
    found = filters.lowpass(level, 160.0, PERIOD_S, knee_hz=4.0)
    np.testing.assert_allclose(found, level, atol=1e-4)


@pytest.mark.parametrize("samples", [3000, 2 * LONG + 1000])
def test_a_derivative_alone_is_the_same(samples: int) -> None:
    """In one piece and in blocks."""
    position = np.sin(0.02 * np.arange(samples))
    every = filters.differentiate(position, 20.0, PERIOD_S)
    acceleration, velocity = filters.differentiate(position, 20.0, PERIOD_S, orders=(2, 1))
    np.testing.assert_array_equal([velocity, acceleration], every[1:])


@pytest.mark.parametrize("samples", [40, 400, 9001])
@pytest.mark.parametrize("delay_s", [0.0, 0.0013])
def test_a_signal_is_continued_by_reflection_and_turned_in_phase(
    samples: int, delay_s: float
) -> None:
    """Spelled out with numpy's own; a short signal is reflected several times."""
    signal = np.random.default_rng(samples).normal(size=(2, samples))
    margin = int(np.ceil(6 / (5.0 * PERIOD_S)))
    total = filters.fast_length(samples + 2 * margin)
    padded = np.pad(signal, [(0, 0), (margin, total - samples - margin)], mode="reflect")
    frequency = np.fft.rfftfreq(total, PERIOD_S)
    gain = np.exp(-2j * np.pi * frequency * delay_s) / (1.0 + (frequency / 5.0) ** 8)
    expected = np.fft.irfft(np.fft.rfft(padded) * gain, total)[:, margin : margin + samples]
    filtered = filters.lowpass(signal, 5.0, PERIOD_S, delay_s=delay_s)
    np.testing.assert_allclose(filtered, expected, atol=1e-12)


@pytest.mark.parametrize("samples", [100, 2000])
def test_what_starts_and_ends_flat_is_reflected_with_its_sign_turned(samples: int) -> None:
    """A constant rate goes on beyond both ends, so that it stays constant up to them."""
    time = PERIOD_S * np.arange(samples)
    velocity, acceleration = filters.differentiate(0.7 * time, 5.0, PERIOD_S, orders=(1, 2))
    np.testing.assert_allclose(velocity, 0.7, atol=1e-9)
    np.testing.assert_allclose(acceleration, 0.0, atol=1e-7)


# Decimation: what a low rate can hold stays, what it cannot is gone, blocks leave no trace.

STRIDE = 7


def tone(per_rate: float, samples: int = 200_000) -> np.ndarray:
    """A sinusoid whose frequency is given in rates after decimation."""
    return np.sin(2.0 * np.pi * per_rate / STRIDE * np.arange(samples) + 0.3)


@pytest.mark.parametrize("per_rate", [0.001, 0.1, 0.34])
def test_the_pass_band_is_kept_without_delay(per_rate: float) -> None:
    signal = tone(per_rate)
    kept, _ = filters.decimate(signal, signal, STRIDE)
    expected = signal[filters.kept(len(signal), STRIDE)]
    np.testing.assert_allclose(kept, expected, atol=3e-5)


@pytest.mark.parametrize("per_rate", [0.52, 0.9, 3.2])
def test_nothing_is_aliased(per_rate: float) -> None:
    kept, other = filters.decimate(tone(per_rate), tone(0.1), STRIDE)
    assert np.max(np.abs(kept)) < 3e-5
    assert np.max(np.abs(other)) > 0.9


def test_marks_are_kept_with_the_sample_before() -> None:
    mask = np.zeros(1000, dtype=bool)
    mask[filters.kept(len(mask), STRIDE).start + STRIDE + 2] = True
    found = filters.any_of(mask, STRIDE)
    assert np.flatnonzero(found).tolist() == [1]


def test_a_long_record_is_filtered_like_its_middle() -> None:
    """Blocks meet without a seam: truth is a motion whose derivatives are known."""
    time_s = 0.004 * np.arange(300_000)
    motion = np.sin(3.0 * time_s) + 0.1 * np.sin(17.0 * time_s)
    acceleration = -9.0 * np.sin(3.0 * time_s) - 28.9 * np.sin(17.0 * time_s)
    found = differentiate(motion, 50.0, 0.004)[2]
    inside = slice(300, -300)
    np.testing.assert_allclose(found[inside], acceleration[inside], atol=2e-3)
    np.testing.assert_allclose(lowpass(motion, 50.0, 0.004)[inside], motion[inside], atol=1e-6)

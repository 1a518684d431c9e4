"""References are smooth: velocity and acceleration are the derivatives of position."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_interface.motion import (
    STOP_ACCELERATION_RAD_S2,
    Multisine,
    SineComponent,
    Staircase,
    reference,
    stop_duration_s,
    stopping_reference,
)

MULTISINE = Multisine((SineComponent(2.0, 0.9, 0.3), SineComponent(0.5, 3.1, -1.0)))
STAIRCASE = Staircase((1.0, -2.0, -2.0, 0.5), 0.8, 4.0)
STEP_S = 1e-4


@pytest.mark.parametrize("motion", [MULTISINE, STAIRCASE])
@pytest.mark.parametrize("rest_rad", [0.0, -1.7])
def test_derivatives_agree_with_position(motion: Multisine | Staircase, rest_rad: float) -> None:
    times = np.arange(-2.0, 6.0, STEP_S)
    path = reference(motion, times, 2.0, rest_rad)
    rates = np.gradient(path.position_rad, STEP_S)[1:-1]
    np.testing.assert_allclose(rates, path.velocity_rad_s[1:-1], atol=2e-3)
    # the acceleration jumps at the corners of a staircase, so its integral is compared
    speed = path.velocity_rad_s[0] + np.cumsum(path.acceleration_rad_s2) * STEP_S
    np.testing.assert_allclose(speed, path.velocity_rad_s, atol=5e-3)


@pytest.mark.parametrize("motion", [MULTISINE, STAIRCASE])
def test_lead_in_starts_at_rest(motion: Multisine | Staircase) -> None:
    start = reference(motion, [-3.0], 3.0, 0.7)
    assert start.position_rad[0] == pytest.approx(0.7)
    assert start.velocity_rad_s[0] == pytest.approx(0.0, abs=1e-12)
    assert start.acceleration_rad_s2[0] == pytest.approx(0.0, abs=1e-12)


def test_capture_begins_in_full_swing() -> None:
    paper = Multisine((SineComponent(2 * math.pi, 0.2875, math.pi / 2),))
    path = reference(paper, [0.0, 1.0], 5.0, 0.0)
    np.testing.assert_allclose(path.position_rad, 2 * math.pi * np.cos([0.0, 0.2875]))
    np.testing.assert_allclose(
        path.velocity_rad_s, -2 * math.pi * 0.2875 * np.sin([0.0, 0.2875]), atol=1e-12
    )


def test_staircase_dwells_at_its_speeds_then_stands_still() -> None:
    # dwell 0.8 s, ramps |dv|/4: 1 -> -2 takes 0.75 s, -2 -> -2 none, -2 -> 0.5 0.625 s
    times = np.array([0.4, 1.9, 2.9, 4.5, 20.0])
    path = reference(STAIRCASE, times, 1.0, 0.0)
    np.testing.assert_allclose(path.velocity_rad_s, [1.0, -2.0, -2.0, 0.5, 0.0])
    np.testing.assert_array_equal(path.acceleration_rad_s2, 0.0)


@given(st.floats(-4.0, 4.0))
def test_a_stop_ends_at_rest_within_the_deceleration_limit(speed: float) -> None:
    duration = stop_duration_s(speed)
    times = np.linspace(0.0, duration, 2001)
    path = stopping_reference(1.0, speed, times, duration)
    assert path.velocity_rad_s[0] == speed
    assert path.velocity_rad_s[-1] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(path.acceleration_rad_s2).max() <= STOP_ACCELERATION_RAD_S2 * (1 + 1e-9)
    way = np.trapezoid(path.velocity_rad_s, times)
    assert path.position_rad[-1] - 1.0 == pytest.approx(way, abs=1e-6)


def test_the_papers_motion_stops_within_a_quarter_second() -> None:
    assert stop_duration_s(2 * math.pi * 0.2875) == 0.25

"""The drive behind the virtual board: what its parameters promise, and the board's control law."""

import numpy as np
import pytest

from firmware_interface.gains import AxisGains
from firmware_interface.plant import COUNT_RAD, Plant
from firmware_interface.plant.feed_drive import COUNTS_PER_TURN, FEED_DRIVE, feed_drive
from firmware_interface.virtual.controller import AxisController, Setpoint

BODIES = list(FEED_DRIVE.values())


def hold(plant: Plant, effort: list[float], samples: int) -> None:
    for _ in range(samples):
        plant.advance(effort)


def test_the_chain_sums_to_the_documented_rigid_body() -> None:
    whole = [
        [body.inertia, body.viscous_friction, body.coulomb_friction, body.offset] for body in BODIES
    ]
    np.testing.assert_allclose(feed_drive().chain.rigid_body[0], whole)
    assert COUNTS_PER_TURN == 8400


def test_steady_speed_follows_from_the_rigid_body() -> None:
    """Constant torque: speed = (torque - coulomb - offset) / viscous."""
    efforts = [3.0, -2.5]
    plant = Plant(feed_drive())
    hold(plant, efforts, 4000)
    for body, effort, speed in zip(BODIES, efforts, plant.output_rad_s, strict=True):
        friction = np.sign(effort) * body.coulomb_friction
        expected = (effort - friction - body.offset) / body.viscous_friction
        assert speed == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_sticks_below_break_away_and_moves_above(direction: float) -> None:
    plant = Plant(feed_drive())
    hold(plant, [0.0, 0.0], 400)
    rest = np.array(plant.output_rad)
    threshold = [body.offset + direction * body.coulomb_friction for body in BODIES]
    hold(plant, [t - direction * 0.02 for t in threshold], 1200)
    assert np.all(abs(plant.output_rad - rest) < 2 * COUNT_RAD)
    assert plant.output_rad_s == [0.0, 0.0]
    hold(plant, [t + direction * 0.02 for t in threshold], 1200)
    assert np.all(direction * (plant.output_rad - rest) > 20 * COUNT_RAD)


def test_weight_is_held_by_friction_without_effort() -> None:
    plant = Plant(feed_drive())
    hold(plant, [0.0, 0.0], 2000)
    assert np.all(np.abs(plant.output_rad) < COUNT_RAD)


def test_a_new_effort_acts_after_its_delay() -> None:
    """A sample later the drive has gathered as much less speed as the delay is long."""
    speeds = []
    for delay in (0.0, 0.2, 0.4):
        plant = Plant(feed_drive(), delay=delay)
        plant.advance([5.0, 5.0])
        speeds.append(plant.output_rad_s[0])
    assert speeds[0] > speeds[1] > speeds[2] > 0.0
    plant = Plant(feed_drive(), delay=1.0)
    plant.advance([5.0, 5.0])
    assert plant.output_rad_s == [0.0, 0.0]


def test_the_drive_winds_up_by_less_than_an_encoder_count() -> None:
    """At full speed, table against encoder: what lets the model be reduced to four parameters."""
    chain = feed_drive().chain
    load = 1.8 * chain.viscous[1:].sum(0) + chain.coulomb[1:].sum(0) + abs(chain.offset)
    assert np.all((load / chain.stiffness).sum(axis=0) < 0.3 * COUNT_RAD)


def test_controller_follows_the_documented_law() -> None:
    gains = AxisGains(
        *(30.0, 4.0, 5.0, 0.0075, 0.4, 0.9, 1.4, 0.2, 0.1, 0.5, 0.15, -0.3),
        ripple_cosine=(0.2, 0.0, 0.0, 0.0),
        ripple_sine=(0.0, 0.0, 0.0, -0.1),
        ripple_period_rad=(0.25, 1.0, 1.0, 0.1),
    )
    controller, period = AxisController(gains, 0.0025, 100.0), 0.0025
    filtered = integral = last = 0.0
    for k in range(1, 50):
        setpoint = Setpoint(0.3 * np.sin(0.1 * k), 0.2 * np.cos(0.1 * k), -0.1)
        position = 0.29 * np.sin(0.1 * k - 0.05)
        filtered += period / (0.0075 + period) * ((position - last) / period - filtered)
        integral += (setpoint.position_rad - position) * period
        last = position
        expected = (
            30.0 * (setpoint.position_rad - position)
            + 4.0 * (setpoint.velocity_rad_s - filtered)
            + 5.0 * integral
            + 0.4 * setpoint.acceleration_rad_s2
            + 0.9 * setpoint.velocity_rad_s
            - 0.3 * abs(setpoint.velocity_rad_s)
            + (1.4 + 0.5 * np.exp(-((setpoint.velocity_rad_s / 0.15) ** 2)))
            * np.tanh(setpoint.velocity_rad_s / 0.2)
            + 0.1
            + 0.2 * np.cos(2 * np.pi * setpoint.position_rad / 0.25)
            - 0.1 * np.sin(2 * np.pi * setpoint.position_rad / 0.1)
        )
        assert controller.effort_nm(setpoint, position) == pytest.approx(expected)


def test_controller_keeps_to_its_effort_limit() -> None:
    gains = AxisGains(600.0, 0.0, 1000.0, 0.01, 0.0, 0.0, 0.0, 0.1, 0.0)
    controller = AxisController(gains, 0.0025, 12.0)
    for _ in range(1000):
        assert controller.effort_nm(Setpoint(1.0, 0.0, 0.0), 0.0) == 12.0
    # the integral part did not wind up beyond the limit: it is gone within its own time
    efforts = [controller.effort_nm(Setpoint(-0.1, 0.0, 0.0), 0.0) for _ in range(60)]
    assert efforts[-1] == -12.0

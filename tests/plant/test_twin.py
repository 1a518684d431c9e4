"""A sound twin makes the motion of another drive: what it needs is what that one would need."""

import numpy as np
import pytest

from firmware_interface.plant import (
    SAMPLE_S,
    Electronics,
    Recordings,
    Twin,
    draw,
    draw_drives,
    paper,
    simulate,
)
from firmware_interface.plant.drives import LEAD, Array
from firmware_interface.plant.effect import Effect
from firmware_interface.plant.plant import STEPS_PER_SAMPLE

COUNT = 3
DRIVES = draw_drives(COUNT, seed=4)
MOTION = paper(samples=1200, phase_rad=0.9)
AT_ONCE = Electronics(delay_periods=0.0)


def beside(effects: tuple[Effect, ...]) -> tuple[Recordings, Array]:
    """Recordings, and the torque (B, N) that the twins of their first axes need in each period."""
    twin = Twin(DRIVES, MOTION, effects, np.zeros(COUNT, dtype=np.intp))
    made = simulate(DRIVES, MOTION, effects=effects, electronics=AT_ONCE, twin=twin)
    periods = twin.torque.reshape(-1, STEPS_PER_SAMPLE, COUNT).mean(axis=1)
    return made, periods[LEAD : LEAD + MOTION.samples].T


def moving(made: Recordings) -> Array:
    """Where the motor of the first axis moves, (B, N)."""
    return np.abs(made.true_velocity[:, 0]) > 0.05


def test_a_sound_drive_needs_what_was_commanded() -> None:
    made, needed = beside(())
    assert np.allclose(needed[moving(made)], made.true_command[:, 0][moving(made)], atol=1e-9)


def test_a_load_is_the_difference_from_the_twin() -> None:
    """A drift of the offset bends the chain a little, and otherwise adds as much as it is."""
    drift = draw(("offset_drift",), DRIVES, MOTION, seed=3, strength=0.9)
    made, needed = beside(drift)
    clear = moving(made)
    added = (made.true_command[:, 0] - needed)[clear]
    at = (MOTION.clock_s[MOTION.recorded] / SAMPLE_S).round().astype(int)
    acting = np.array([drift[0].table_torque(Clock(SAMPLE_S * row)) for row in at])[:, :, 0].T
    assert added == pytest.approx(acting[clear], abs=0.02 * np.max(np.abs(acting)))


class Clock:
    """A state that tells the time alone."""

    def __init__(self, time_s: float) -> None:
        self.time_s = time_s


def test_a_twin_moves_as_the_encoder_says() -> None:
    """Its speed is that of the shown angle, which errs with the disc."""
    disc = draw(("encoder_eccentricity",), DRIVES, MOTION, seed=3, strength=0.9)
    twin = Twin(DRIVES, MOTION, disc, np.zeros(COUNT, dtype=np.intp))
    made = simulate(DRIVES, MOTION, effects=disc, electronics=AT_ONCE, twin=twin)
    moved = twin.velocity[STEPS_PER_SAMPLE * LEAD :: STEPS_PER_SAMPLE][: MOTION.samples].T
    shown = np.gradient(disc[0].encoder(np.moveaxis(made.true_angle, -1, 0)), SAMPLE_S, axis=0)
    inner = slice(2, -2)
    assert moved[:, inner] == pytest.approx(shown[inner, :, 0].T, abs=0.02)

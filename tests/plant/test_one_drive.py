"""One drive in plain numbers moves as the same drive in a batch does, whatever is hidden in it."""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

from firmware_interface.plant import (
    EFFECTS,
    SAMPLE_S,
    UNKNOWN,
    Effect,
    Mechanism,
    Motion,
    Plant,
    draw,
    draw_drives,
    multisine,
)
from firmware_interface.plant.drives import Array
from firmware_interface.plant.plant import STEPS_PER_SAMPLE, overriding
from tests.plant.side_by_side import side_by_side

DRIVES = draw_drives(1, 51)
MOTION = multisine(1200, seed=52)
LATE = 2
"""Steps until a command acts."""


def efforts() -> Array:
    """Of both axes, (T, 2): swings that break away, turn back and stop."""
    time_s = SAMPLE_S * np.arange(1200)[:, None]
    amplitude = 1.3 * DRIVES.chain.coulomb.sum(axis=0) + 4.0
    return np.asarray(amplitude * np.sin(np.array([5.1, 7.7]) * time_s))


def in_a_batch(hidden: Sequence[Effect], commands: Array) -> tuple[Array, Array]:
    """True and shown angles before each command of a drive without and with each, (T, B, 2)."""
    sound = hidden[0].scaled(0.0)
    drives, effects = side_by_side(DRIVES, (sound, *hidden))
    rest = np.zeros(drives.shape)
    mechanism = Mechanism(drives.chain, effects, SAMPLE_S / STEPS_PER_SAMPLE, rest, rest)
    before, angles, shown = rest, [], []
    for row, command in enumerate(commands):
        time_s = row * SAMPLE_S
        mechanism.at(time_s)
        angles.append(mechanism.angle[0].copy())
        seen = mechanism.angle[0]
        for effect in overriding(effects, "encoder"):
            seen = effect.encoder(seen)
        shown.append(seen.copy())
        acting = np.broadcast_to(command, drives.shape)
        for effect in overriding(effects, "applied"):
            acting = effect.applied(acting, time_s)
        for step in range(STEPS_PER_SAMPLE):
            mechanism.advance(before if step < LATE else acting)
        before = acting
    return np.array(angles), np.array(shown)


@cache
def together() -> tuple[dict[str, Effect], Array, Array, Array]:
    """Every effect, the commands, and what a batch with a drive for each does with them."""
    effects = {
        name: draw([name], DRIVES, MOTION, 53, strength=0.9)[0] for name in (*EFFECTS, *UNKNOWN)
    }
    commands = efforts()
    commands[0] += 0.01  # the clock of the effects runs from the first effort
    return effects, commands, *in_a_batch(list(effects.values()), commands)


def alone(effects: tuple[Effect, ...], commands: Array) -> tuple[Array, Array, Array]:
    """True angle, shown angle and recorded effort, (T, 2)."""
    plant = Plant(DRIVES, effects, lead_in_s=0.0)
    angles, shown, recorded = [], [], []
    for command in commands.tolist():
        angles.append(plant.output_rad)
        shown.append(plant.shown_rad)
        recorded.append(plant.recorded_nm(command))
        plant.advance(command)
    return np.array(angles), np.array(shown), np.array(recorded)


@pytest.mark.parametrize("name", [None, *EFFECTS, *UNKNOWN])
def test_it_moves_as_in_a_batch(name: str | None) -> None:
    effects, commands, angles_together, shown_together = together()
    place = [None, *effects].index(name)
    angles, shown, _ = alone((effects[name],) if name else (), commands)
    assert np.all(np.ptp(angles, axis=0) > 0.05)
    np.testing.assert_allclose(angles, angles_together[:, place], rtol=0, atol=1e-9)
    np.testing.assert_allclose(shown, shown_together[:, place], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["time_delay", "fast_vibration", "fast_chirp"])
def test_its_effort_is_recorded_as_that_of_a_batch(name: str) -> None:
    (effect,) = draw([name], DRIVES, MOTION, 54, strength=0.9)
    if name == "time_delay":
        effect = effect.scaled(float(np.sign(effect.size[0, 0])))
        effect = type(effect)(abs(effect.size))  # a board cannot record what is to come
    commands = efforts()
    commands[0] += 0.01
    stamps = SAMPLE_S * np.arange(len(commands))
    expected = effect.recorded(commands[:, None], stamps)[:, 0]
    _, _, recorded = alone((effect,), commands)
    assert np.std(recorded - commands) > 0.01
    np.testing.assert_allclose(recorded[40:], expected[40:], atol=1e-9)


def test_the_clock_of_the_effects_waits_for_the_first_effort() -> None:
    (cold,) = draw(["warm_up"], DRIVES, MOTION, 55, strength=1.0)
    commands, idle = efforts(), np.zeros((400, 2))
    commands[0] += 0.01
    warm, _, _ = alone((cold,), commands)
    later, _, _ = alone((cold,), np.vstack([idle, commands]))
    moved = later[400:] - later[400]
    np.testing.assert_allclose(moved, warm, atol=5e-4)  # the weight has wound the chain up


def test_a_timed_effect_goes_on_after_its_course() -> None:
    short = Motion("short", *(part[: 800 + 20 + 100] for part in (
        MOTION.position, MOTION.velocity, MOTION.acceleration
    )))  # fmt: skip
    (steps,) = draw(["random_steps"], DRIVES, short, 56, strength=1.0)
    period = len(steps.course) - 800
    (drift,) = draw(["offset_drift"], DRIVES, short, 57, strength=1.0)
    for late in (0.0, 1.0, 7.0):
        assert steps.row(late + period * SAMPLE_S) == steps.row(late)
    assert drift.row(1e3) == len(drift.course) - 1

"""Every effect of the plant does what sets it apart, along the true motion."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from firmware_interface.plant import (
    EFFECTS,
    SAMPLE_S,
    UNKNOWN,
    Effect,
    Electronics,
    Mechanism,
    Motion,
    Recordings,
    draw,
    draw_drives,
    simulate,
)
from firmware_interface.plant.drives import LEAD, TAIL, Array
from firmware_interface.plant.electric_effects import RecordDelay
from tests.plant.balance import Balance, averaged, balance
from tests.plant.side_by_side import copy_of, side_by_side

IDEAL = Electronics(count_rad=0.0, effort_step_nm=0.0)
DRIVES = draw_drives(6, 31)


def swings(slow: float, fast: float = 0.0, samples: int = 2000) -> Motion:
    """To and fro at 0.7 rad/s, with a second, faster swing; z leads x by a quarter period."""
    time_s = SAMPLE_S * np.arange(-LEAD, samples + TAIL)[:, None, None]
    axes = np.array([0.0, np.pi / 2])
    rates = ((slow, 0.7, axes), (fast, 2.3, 2 * axes))
    angles = [(size, rate, rate * time_s + start) for size, rate, start in rates]
    return Motion(
        "swings",
        sum(size * np.sin(angle) for size, _, angle in angles),
        sum(size * rate * np.cos(angle) for size, rate, angle in angles),
        sum(-size * rate**2 * np.sin(angle) for size, rate, angle in angles),
    )


def inflict(name: str, motion: Motion, strength: float = 1.0) -> tuple[Effect, Recordings]:
    (effect,) = draw([name], DRIVES, motion, 32, strength=strength)
    return effect, following(run(effect, motion))


def following(recordings: Recordings) -> Recordings:
    """A drive with a fault still follows."""
    assert np.max(abs(recordings.reference - recordings.true_angle)) < 1.5
    return recordings


@cache
def on_two_swings() -> dict[str, tuple[Effect, Recordings]]:
    """Every effect of which the tests below ask on this motion, simulated at once."""
    motion = swings(1.5, 0.3)
    names = (*LAWS, "gain_drift", "time_delay")
    strengths = {"time_delay": 0.95}
    effects = [
        draw([name], DRIVES, motion, 32, strength=strengths.get(name, 1.0))[0] for name in names
    ]
    drives, spread = side_by_side(DRIVES, effects)
    made = simulate(drives, motion, effects=spread, electronics=IDEAL, steps_per_sample=5)
    count = DRIVES.shape[0]
    return {
        name: (effect, copy_of(made, place, count))
        for place, (name, effect) in enumerate(zip(names, effects, strict=True))
    }


def run(effect: Effect, motion: Motion) -> Recordings:
    return simulate(DRIVES, motion, effects=[effect], electronics=IDEAL, steps_per_sample=5)


def share(missing: Array, expected: Array, where: Array) -> Array:
    """How much of `expected` is in `missing`, (B, A): 1 is all of it."""
    smooth, wanted = averaged(missing) * where, averaged(expected) * where
    return (smooth * wanted).sum(axis=-1) / ((wanted**2).sum(axis=-1) + 1e-12)


def along(values: Array) -> Array:
    return values[..., None]


def stribeck(e: Effect, found: Balance) -> Array:
    return found.direction * along(e.size) / (1 + (found.velocity / along(e.speed)) ** 2)


def asymmetry(e: Effect, found: Balance) -> Array:
    fast = abs(found.velocity) / along(e.peak)
    return along(e.size) * (along(e.peak) * (3 - 6 / (2 + fast)) + along(e.coulomb_per_viscous))


def ripple(e: Effect, found: Balance) -> Array:
    first = np.sin(along(e.per_turn) * found.angle + along(e.phase_rad))
    second = along(e.second) * np.sin(along(e.second_per_turn) * found.angle)
    return along(e.size) * (1 + 0.15 * np.sin(found.angle)) * (first + second)


def position_friction(e: Effect, found: Balance) -> Array:
    place = np.pi * along(e.waves) * (found.angle - along(e.centre)) / along(e.travel)
    harmonics = [0.3**k * np.sin((k + 1) * (place + 0.7) - k * np.pi / 2) for k in range(20)]
    return found.direction * along(e.size) * 0.7 * sum(harmonics)


def position_load(e: Effect, found: Balance) -> Array:
    place = (found.angle - along(e.centre)) / along(e.travel)
    angle = along(e.per_travel) * place
    # height of a weight on a crank and a rod of 2.5 cranks; its change with the angle is torque
    high, low = (-np.cos(a) - np.sqrt(6.25 - np.sin(a) ** 2) for a in (angle + 1e-5, angle - 1e-5))
    taut = (place - 0.2 * np.tanh(place / 0.3)) / 0.8
    return along(e.size) * np.where(along(e.hose) == 1, taut, (high - low) / 2e-5)


def nonlinear_viscous(e: Effect, found: Balance) -> Array:
    fast = abs(found.velocity) / along(e.peak)
    thinned = np.arcsinh(fast / along(e.knee)) / np.arcsinh(1 / along(e.knee))
    churned = fast**3 * np.hypot(1, 0.5) / np.hypot(fast, 0.5)
    return found.direction * along(e.size) * np.where(along(e.grease) == 1, thinned, churned)


def load_friction(e: Effect, found: Balance) -> Array:
    chain = DRIVES.chain
    moving = along(chain.inertia[2]) * found.acceleration + along(chain.offset)
    moving += along(chain.viscous[2]) * found.velocity + along(chain.coulomb[2]) * found.direction
    # the nut bears its own friction too: the load is what moves and that friction
    lost = 0.0 * moving
    for _ in range(60):
        heavy = abs(moving + lost) / along(e.rms)
        lost = found.direction * along(e.size * e.rms) * heavy**0.75
    return lost


def warm_up(e: Effect, found: Balance) -> Array:
    cold = np.exp(-found.time_s / along(e.warms_in_s))
    return along(e.size) * (np.exp(2 * cold) - 1) / (np.exp(2) - 1) * found.velocity


def timed(e: Effect, found: Balance) -> Array:
    rows = e.course[LEAD + 1 : LEAD + 1 + len(found.time_s)]
    return along(e.size) * np.moveaxis(rows, 0, -1)


def fading_order(e: Effect, found: Balance) -> Array:
    return timed(e, found) * np.sin(along(e.per_turn) * found.angle + along(e.phase_rad))


def slipping_order(e: Effect, found: Balance) -> Array:
    slipped = timed(replace(e, size=np.ones(e.size.shape)), found) + along(e.phase_rad)
    return along(e.size) * np.sin(along(e.per_turn) * found.angle + slipped)


def cross_axis(e: Effect, found: Balance) -> Array:
    other = along(e.acceleration) * found.acceleration[:, ::-1]
    other += along(e.velocity) * found.velocity[:, ::-1]
    other += along(e.direction) * found.direction[:, ::-1]
    place = (found.angle - along(e.centre)) / along(e.travel)
    return along(e.size) * (1 + 0.3 * place) * other


def deadband(e: Effect, found: Balance) -> Array:
    return along(e.size) * np.tanh(found.effort / along(e.size))


def saturation(e: Effect, found: Balance) -> Array:
    return found.effort - np.sign(found.effort) * (found.effort**-8 + along(e.limit) ** -8) ** (
        -1 / 8
    )


LAWS: dict[str, Callable[[Effect, Balance], Array]] = {
    "stribeck_friction": stribeck,
    "asymmetric_friction": asymmetry,
    "torque_ripple": ripple,
    "position_dependent_friction": position_friction,
    "position_dependent_load": position_load,
    "nonlinear_viscous": nonlinear_viscous,
    "load_dependent_friction": load_friction,
    "warm_up": warm_up,
    "offset_drift": timed,
    "disturbance_event": timed,
    "slow_wander": timed,
    "timed_vibration": timed,
    "random_steps": timed,
    "chirp": timed,
    "random_bumps": timed,
    "fading_order": fading_order,
    "slipping_order": slipping_order,
    "cross_axis_coupling": cross_axis,
    "actuator_deadband": deadband,
    "actuator_saturation": saturation,
}


@pytest.mark.parametrize("name", LAWS)
def test_missing_torque_follows_the_law_both_ways_at_every_speed(name: str) -> None:
    effect, recordings = on_two_swings()[name]
    found = balance(following(recordings), recordings.base)
    expected = LAWS[name](effect, found)
    where = found.clear(speed=0.08)
    for part in (found.velocity > 0, found.velocity < 0):
        felt = effect.hit & (abs(averaged(expected) * where * part).max(axis=-1) > 0.03)
        assert felt.any()
        missing = share(found.missing, expected, where & part)
        assert np.allclose(missing[felt], 1, atol=0.1)
    sound = abs(averaged(found.missing) * where).max(axis=-1)[~effect.hit]
    assert np.all(sound < 0.1)


def since_reversal(found: Balance) -> Array:
    """Travel since the last reversal, (B, A, N); nan before the first."""
    turns = np.diff(found.direction, axis=-1, prepend=found.direction[..., :1]) != 0
    row = np.maximum.accumulate(np.where(turns, np.arange(turns.shape[-1]), 0), axis=-1)
    travel = abs(found.angle - np.take_along_axis(found.angle, row, axis=-1))
    return np.where(row > 0, travel, np.nan)


def test_presliding_friction_depends_on_travel_since_reversal_alone() -> None:
    level = along(DRIVES.chain.coulomb[2])
    curves = []
    for amplitude in (0.7, 1.4):
        effect, recordings = inflict("presliding_hysteresis", swings(amplitude, 0.0, 3000), 0.8)
        found = balance(recordings, recordings.base)
        travel = since_reversal(found) / along(effect.size)
        # from −2 (friction still of the way before) to 0 (built up), in units of its level
        built = averaged(found.missing * found.direction / level, 9)
        assert abs(np.nanmedian(built[travel > 2.5])) < 0.03
        curves.append([np.nanmedian(built[abs(travel - at) < 0.1]) for at in (0.3, 0.8, 1.3)])
    # elements whose reaches are even from 0 to twice the mean turn round one after another
    at = np.array([0.3, 0.8, 1.3])
    expected = at / 2 * (1 + np.log(4 / at)) - 2
    for slow_or_fast in curves:
        assert np.allclose(slow_or_fast, expected, atol=0.1)


def test_backlash_leaves_the_motor_alone_for_a_fixed_travel_after_reversal() -> None:
    effect, recordings = inflict("backlash", swings(1.4, 0.0, 3000))
    alone = [part[0] for part in (DRIVES.chain.inertia, DRIVES.chain.viscous)]
    alone += [DRIVES.chain.coulomb[0], np.zeros(DRIVES.shape)]
    found = balance(recordings, np.stack(alone, axis=-1))
    travel = since_reversal(found) / along(effect.size)
    missing = averaged(found.missing, 9) / along(DRIVES.chain.coulomb[2])
    free, closed = (travel > 0.2) & (travel < 0.8), (travel > 1.2) & (travel < 1.7)
    assert np.nanmedian(abs(missing)[free]) < 0.05
    assert np.nanmedian(abs(missing)[closed]) > 0.8


def test_gain_drift_scales_everything_alike() -> None:
    effect, recordings = on_two_swings()["gain_drift"]
    found = balance(following(recordings), recordings.base)
    gain = np.stack([effect.gain(t) for t in found.time_s], axis=-1)
    amiss = np.where(found.clear(), averaged(found.missing + (gain - 1) * found.effort), 0)
    assert np.max(abs(amiss)) < 0.1
    assert np.allclose(gain[..., -1], 1 - effect.size, atol=1e-3)
    assert np.allclose(
        recordings.truth / recordings.base, gain.mean(axis=-1)[..., None] ** -1, rtol=0.05
    )


def test_delay_shifts_the_record_and_nothing_else() -> None:
    effect, recordings = on_two_swings()["time_delay"]
    rate = np.gradient(recordings.true_command, SAMPLE_S, axis=-1)
    late = averaged(recordings.true_command - recordings.effort)
    smooth = averaged(rate)
    calm = averaged(abs(rate) > 10, 81) == 0  # not at reversals, where the rate jumps
    shift = (late * smooth * calm).sum(axis=-1) / (smooth**2 * calm).sum(axis=-1)
    assert np.allclose(shift, effect.size, rtol=0.1)
    sound = simulate(DRIVES, swings(1.5, 0.3), electronics=IDEAL, steps_per_sample=5)
    assert np.array_equal(sound.true_angle, recordings.true_angle)


@pytest.mark.parametrize("name", ["coupling_compliance", "backlash"])
def test_ringing_keeps_its_frequency_with_compliance_and_not_with_backlash(name: str) -> None:
    (effect,) = draw([name], DRIVES, swings(1.5), 33, strength=0.9)
    chain = replace(
        DRIVES.chain,
        coulomb=np.zeros_like(DRIVES.chain.coulomb),
        viscous=np.zeros_like(DRIVES.chain.viscous),
        offset=np.zeros(DRIVES.shape),
        damping_ratio=np.zeros_like(DRIVES.chain.damping_ratio),
    )
    effect = replace(effect, loss=np.zeros(DRIVES.shape))
    crossings = []
    for kick in (1.0, 4.0):
        rest = np.zeros(DRIVES.shape)
        mechanism = Mechanism(chain, [effect], 2.5e-4, rest, rest)
        mechanism.velocity[0] = kick
        wound = []
        for _ in range(8000):
            mechanism.advance(rest)
            wound.append(mechanism.angle[0] - mechanism.angle[1])
        crossings.append((np.diff(np.sign(wound), axis=0) != 0).sum(axis=0))
    few, many = np.array(crossings)
    if name == "backlash":
        assert np.all(many > 1.5 * few)
    else:
        assert np.allclose(few, many, rtol=0.1)
        load = DRIVES.chain.inertia[1:].sum(axis=0)
        held = np.sqrt(1 / (effect.size * load)) / (2 * np.pi)
        assert np.allclose(held, 4.0 * 0.005 ** (-0.5 * 0.1))  # strength 0.9 of 1
        swing = np.sqrt((1 / DRIVES.chain.inertia[0] + 1 / load) / effect.size) / (2 * np.pi)
        assert np.allclose(few / 2 / 2.0, swing, rtol=0.15)


@pytest.mark.parametrize("name", ["fast_vibration", "fast_chirp"])
def test_a_line_above_the_band_stands_in_the_measured_effort_alone(name: str) -> None:
    effect, recordings = inflict(name, swings(1.5))
    added = recordings.quiet_effort - recordings.true_command
    assert np.allclose(added.std(axis=-1), effect.size / np.sqrt(2), rtol=0.05)
    spectrum = abs(np.fft.rfft(np.hanning(added.shape[-1]) * added, axis=-1)) ** 2
    slow = np.fft.rfftfreq(added.shape[-1], SAMPLE_S) < 14.0
    assert np.all(spectrum[..., slow].sum(axis=-1) < 0.01 * spectrum.sum(axis=-1))
    sound = simulate(DRIVES, swings(1.5), electronics=IDEAL, steps_per_sample=5)
    assert np.array_equal(sound.true_angle, recordings.true_angle)


def test_a_delay_is_counted_from_a_record_in_step() -> None:
    (effect,) = draw(["time_delay"], DRIVES, swings(1.5), 33, strength=0.5)
    assert isinstance(effect, RecordDelay)
    board = Electronics(count_rad=0.0, effort_step_nm=0.0, delay_periods=0.8)
    seen = effect.beyond(board.effort_shift_s)
    assert np.all(abs(effect.size) >= 1.5 * SAMPLE_S)
    assert np.allclose(seen.size - 1.3 * SAMPLE_S, effect.size)


def test_eccentricity_shows_once_a_turn_and_grows_with_the_square_of_speed() -> None:
    bent = []
    for amplitude in (2.0, 4.0):
        effect, recordings = inflict("encoder_eccentricity", swings(amplitude))
        error = recordings.position - recordings.true_angle
        angle = recordings.true_angle
        once, twice = np.sin(angle + along(effect.phase_rad)), 0.05 * np.sin(2 * angle)
        expected = along(effect.size) * (once + twice)
        assert np.allclose(error, expected, atol=1e-9)
        bent.append(abs(np.diff(error, 2, axis=-1)).max(axis=-1))
    assert np.all((bent[1] / bent[0] > 2.5) & (bent[1] / bent[0] < 6))


def test_payload_changes_the_inertia_at_its_time() -> None:
    effect, recordings = inflict("payload_change", swings(0.7, 0.5), strength=0.9)
    found = balance(recordings, recordings.base)
    late = (found.time_s - along(effect.changes_s)) / 0.2
    after = np.clip(0.5 + late, 0, 1)
    carried = along(effect.size) * np.where(along(effect.taken_up) == 1, after, 1 - after)
    expected = along(effect.inertia) * found.acceleration
    expected += along(effect.coulomb) * found.direction
    felt = share(found.missing, carried * expected, found.clear())
    assert np.allclose(felt, 1, atol=0.1)
    added = recordings.truth - recordings.base
    assert np.allclose(added[..., 0], effect.inertia * carried.mean(axis=-1), rtol=0.01)


def test_strength_runs_from_faint_to_strong_and_spares_the_other_axis() -> None:
    motion = swings(1.5)
    for name in EFFECTS + UNKNOWN:
        (faint,), (strong,) = (
            draw([name], DRIVES, motion, 34, strength=end, one_axis=True) for end in (0.0, 1.0)
        )
        assert np.array_equal(faint.hit, strong.hit), name
        assert np.all(faint.hit.sum(axis=1) == 1), name
        assert np.all(abs(strong.size[strong.hit]) >= 8 * abs(faint.size[faint.hit])), name
        assert np.allclose(strong.scaled(0.4).size, 0.4 * strong.size), name


def test_effects_act_together() -> None:
    motion = swings(1.5, 0.3)
    pair = draw(["torque_ripple", "offset_drift"], DRIVES, motion, 35, strength=0.9)
    recordings = simulate(DRIVES, motion, effects=pair, electronics=IDEAL, steps_per_sample=5)
    found = balance(recordings, recordings.base)
    expected = ripple(pair[0], found) + timed(pair[1], found)
    assert np.allclose(share(found.missing, expected, found.clear()), 1, atol=0.1)

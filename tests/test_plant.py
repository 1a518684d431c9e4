"""The batched plant: its mechanics against a stiff solver, its loop, its recordings."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from firmware_interface.plant import (
    COUNT_RAD,
    SAMPLE_S,
    Chain,
    Drives,
    Electronics,
    Mechanism,
    Motion,
    Noise,
    draw,
    draw_drives,
    draw_electronics,
    draw_noise,
    multisine,
    paper,
    simulate,
    staircase,
)
from firmware_interface.plant.drives import Array
from tests.plant.balance import averaged, balance
from tests.plant.side_by_side import side_by_side

IDEAL = Electronics(count_rad=0.0, effort_step_nm=0.0)


def without_coulomb(drives: Drives) -> Chain:
    return replace(drives.chain, coulomb=np.zeros_like(drives.chain.coulomb))


def solve_stiff(chain: Chain, torque: Array, rate: Array, end_s: float) -> Array:
    """Angles of one drive's three masses at the end, by Radau, pushed by torque·sin(rate·t)."""
    stiffness, damping = chain.stiffness[:, 0, 0], chain.damping[:, 0, 0]
    inertia, viscous = chain.inertia[:, 0, 0], chain.viscous[:, 0, 0]

    def slope(time_s: float, state: Array) -> Array:
        angle, velocity = state[:3], state[3:]
        joint = -stiffness * np.diff(angle) - damping * np.diff(velocity)
        force = -viscous * velocity
        force += [torque * np.sin(rate * time_s) - joint[0], joint[0] - joint[1], joint[1]]
        force[2] -= chain.offset[0, 0]
        return np.concatenate([velocity, force / inertia])

    solution = solve_ivp(slope, (0, end_s), np.zeros(6), "Radau", rtol=1e-9, atol=1e-12)
    return solution.y[:3, -1]


@pytest.mark.parametrize("seed", [1, 2])
def test_linear_chain_moves_as_the_stiff_solver_says(seed: int) -> None:
    chain = without_coulomb(draw_drives(1, seed, axes=1))
    torque, rate, end_s = 2.0, 30.0, 0.5
    expected = solve_stiff(chain, torque, rate, end_s)

    def error(step_s: float) -> float:
        rest = np.zeros((1, 1))
        mechanism = Mechanism(chain, (), step_s, rest, rest)
        for step in range(round(end_s / step_s)):
            mechanism.advance(torque * np.sin(rate * (step + 0.5) * step_s) * np.ones((1, 1)))
        return float(abs(mechanism.angle[:, 0, 0] - expected).max())

    fine, coarse = error(0.5e-4), error(2.5e-4)
    assert coarse < COUNT_RAD / 50
    assert fine < coarse / 4  # at least first order: five times finer


def test_friction_holds_a_mass_still_exactly_and_lets_go_above_its_level() -> None:
    drives = draw_drives(50, 3)
    chain = replace(drives.chain, offset=np.zeros(drives.shape))
    rest = np.zeros(drives.shape)
    whole = chain.coulomb.sum(axis=0)
    held, moved = (Mechanism(chain, (), 2.5e-4, rest, rest) for _ in range(2))
    for _ in range(4000):
        held.advance(0.98 * whole)
        moved.advance(1.05 * whole)
    assert np.all(held.velocity[[0, 2]] == 0)  # the screw between them has no dry friction
    assert np.all(abs(held.angle[0]) < 10 * COUNT_RAD)
    assert np.all(moved.velocity[2] > 0)


def test_energy_never_grows_without_a_torque() -> None:
    drives = draw_drives(50, 4)
    chain = replace(drives.chain, offset=np.zeros(drives.shape))
    mechanism = Mechanism(chain, (), 2.5e-4, np.zeros(drives.shape), np.ones(drives.shape))
    energies = []
    for _ in range(2000):
        mechanism.advance(np.zeros(drives.shape))
        kinetic = (chain.inertia * mechanism.velocity**2).sum(axis=0) / 2
        wound = (chain.stiffness * np.diff(mechanism.angle, axis=0) ** 2).sum(axis=0) / 2
        energies.append(kinetic + wound)
    energy = np.array(energies)
    assert np.all(np.diff(energy, axis=0) < 1e-3 * energy[:-1] + 1e-8)
    assert np.all(energy[-1] < 0.5 * energy[0])


def test_a_sound_drive_obeys_the_rigid_body_along_its_true_motion() -> None:
    drives = draw_drives(20, 5)
    recordings = simulate(drives, multisine(3000), electronics=IDEAL)
    found = balance(recordings, recordings.base)
    missing = np.where(found.clear(), abs(averaged(found.missing)), 0).max(axis=-1)
    share = missing / found.effort.std(axis=-1)
    assert np.median(share) < 0.006
    assert np.max(share) < 0.03


def test_a_sound_drive_winds_up_by_less_than_an_encoder_count() -> None:
    chain = draw_drives(300, 6).chain
    load = 1.8 * chain.viscous[1:].sum(0) + chain.coulomb[1:].sum(0) + abs(chain.offset)
    assert np.all((load / chain.stiffness).sum(axis=0) < COUNT_RAD)


def test_finer_steps_change_nothing_that_noise_would_not_hide() -> None:
    drives, motion = draw_drives(30, 7), multisine(200)
    names = ("stribeck_friction", "presliding_hysteresis", "backlash")
    faults = [draw([name], drives, motion, 8)[0] for name in names]
    copies, effects = side_by_side(drives, [faults[0].scaled(0.0), *faults])
    coarse, fine = (
        simulate(copies, motion, effects=effects, electronics=IDEAL, steps_per_sample=steps).effort
        for steps in (10, 30)
    )
    errors = (coarse - fine).std(axis=-1) / fine.std(axis=-1)
    for name, error in zip(("nothing", *names), np.split(errors, 4), strict=True):
        assert np.median(error) < 2e-3, name
        assert np.quantile(error, 0.9) < 0.02, name


def test_recordings_repeat_by_seed_and_differ_between_seeds() -> None:
    motion = paper(50)

    def run(drive_seed: int, effect_seed: int, noise_seed: int) -> Array:
        drives = draw_drives(3, drive_seed)
        effects = draw(["torque_ripple"], drives, motion, effect_seed)
        noise = Noise(0.05)
        return simulate(drives, motion, effects=effects, noise=noise, seed=noise_seed).effort

    first = run(1, 2, 3)
    assert np.array_equal(first, run(1, 2, 3))
    for other in (run(9, 2, 3), run(1, 9, 3), run(1, 2, 9)):
        assert not np.array_equal(first, other)


def test_a_drive_does_the_same_alone_and_in_a_batch_of_others() -> None:
    motion = paper(300)
    drives = draw_drives(4, 10)
    alone = Drives(
        Chain(**{key: value[..., :1, :] for key, value in vars(drives.chain).items()}),
        replace(
            drives.control,
            **{key: value[:1] for key, value in vars(drives.control).items()},
        ),
    )
    together = simulate(drives, motion).effort[:1]
    assert np.allclose(simulate(alone, motion).effort, together, atol=1e-9)


def test_position_comes_in_counts_and_effort_in_steps() -> None:
    recordings = simulate(draw_drives(5, 11), paper(400))
    counts = recordings.position / COUNT_RAD
    assert np.allclose(counts, np.round(counts), atol=1e-6)
    assert np.max(abs(recordings.position - recordings.true_angle)) <= COUNT_RAD / 2 + 1e-12
    steps = recordings.effort / 0.004
    assert np.allclose(steps, np.round(steps), atol=1e-6)
    assert recordings.position.shape == recordings.effort.shape == (5, 2, 400)


def test_a_command_acts_when_its_board_says() -> None:
    drives = draw_drives(16, 14)
    delays = np.resize([0.0, 0.2, 1.0, 1.4], (16, 1))
    made = simulate(drives, multisine(3000), electronics=replace(IDEAL, delay_periods=delays))
    assert np.allclose(made.effort_shift_s, (0.5 + delays[:, 0]) * SAMPLE_S)
    velocity = made.true_velocity
    columns = [np.gradient(velocity, SAMPLE_S, axis=-1), velocity, np.sign(velocity)]
    rigid = made.base[..., 3:] + sum(
        made.base[..., place, None] * column for place, column in enumerate(columns)
    )
    calm = averaged(abs(np.diff(np.sign(velocity), prepend=0.0)), 161) == 0
    left = []
    for periods in (0.5, 0.7, 1.5, 1.9):
        clock = made.time_s + periods * SAMPLE_S
        in_step = np.apply_along_axis(partial(np.interp, made.time_s, clock), -1, made.quiet_effort)
        left.append((np.where(calm, averaged(in_step - rigid), 0) ** 2).mean(axis=(-1, -2)))
    assert np.mean(np.argmin(left, axis=0) == np.resize([0, 1, 2, 3], 16)) > 0.9


def test_boards_and_noise_are_drawn_for_every_drive() -> None:
    drives = draw_drives(40, 15)
    boards, noise = draw_electronics(drives.shape, 16), draw_noise(40, 17)
    made = simulate(drives, paper(1500), electronics=boards, noise=noise, seed=18)
    count = np.asarray(boards.count_rad)
    counts = made.position / count[..., None]
    assert np.allclose(counts, np.round(counts), atol=1e-4)
    at_output = np.isclose(count[:, 0], COUNT_RAD)
    assert 8 <= at_output.sum() <= 32
    assert np.all(count[~at_output] < COUNT_RAD / 4.9)
    shifts = made.effort_shift_s / SAMPLE_S
    assert shifts.min() >= 0.5
    assert shifts.max() <= 1.5
    assert len(np.unique(shifts)) > 5
    share = (made.effort - made.quiet_effort).std(axis=-1)
    share /= np.sqrt((made.quiet_effort**2).mean(axis=-1))
    assert np.allclose(share, noise.share, rtol=0.1)
    assert np.min(noise.share) < 0.008
    assert np.max(noise.share) > 0.03


@pytest.mark.parametrize("correlation_s", [0.0, 0.05])
def test_noise_has_its_share_and_its_correlation(correlation_s: float) -> None:
    drives, motion = draw_drives(10, 12), paper(4000)
    noise = Noise(0.05, correlation_s)
    recordings = simulate(drives, motion, noise=noise, seed=1, steps_per_sample=5)
    added = recordings.effort - recordings.true_command
    share = added.std(axis=-1) / np.sqrt((recordings.true_command**2).mean(axis=-1))
    assert np.allclose(share, 0.05, rtol=0.25)
    lag = 20
    correlation = (added[..., lag:] * added[..., :-lag]).mean(-1) / added.var(axis=-1)
    expected = np.exp(-lag * SAMPLE_S / correlation_s) if correlation_s else 0.0
    assert abs(correlation.mean() - expected) < 0.05


@pytest.mark.parametrize("motion", [paper(), multisine(), staircase()], ids=lambda m: m.name)
def test_references_are_their_own_derivatives(motion: Motion) -> None:
    step = np.diff(motion.position, axis=0) / SAMPLE_S
    assert np.max(abs(step - (motion.velocity[1:] + motion.velocity[:-1]) / 2)) < 0.02
    change = np.diff(motion.velocity, axis=0) / SAMPLE_S
    assert np.max(abs(change - (motion.acceleration[1:] + motion.acceleration[:-1]) / 2)) < 0.02
    assert np.max(abs(motion.velocity)) < 2.01


def test_the_papers_motion_starts_anywhere_in_the_period_for_each_drive() -> None:
    phases = np.array([0.0, 1.0, 2.0])
    motion = paper(2186, phase_rad=phases)
    start = motion.position[motion.recorded][0]
    assert np.allclose(start[:, 0], 2 * np.pi * np.sin(phases))
    assert np.allclose(start[:, 1], 2 * np.pi * np.cos(phases))
    recordings = simulate(draw_drives(3, 13), paper(50, phase_rad=phases))
    assert np.max(abs(recordings.true_angle - recordings.reference)) < 0.5

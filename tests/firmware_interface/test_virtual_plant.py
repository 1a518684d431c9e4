"""The plant against an independent integrator, energy, and what its parameters promise."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from firmware_interface.gains import AxisGains
from firmware_interface.virtual.controller import AxisController, Setpoint
from firmware_interface.virtual.feed_drive import (
    COUNTS_PER_TURN,
    FEED_DRIVE,
    GEAR_RATIO,
    LEAD_M_PER_RAD,
    AxisMechanics,
    axis_matrices,
    reduced_truth,
)
from firmware_interface.virtual.plant import AxisMatrices, Plant, matrix_exponential

STEP_S = 0.0005
SUBSTEPS = 5
ONE_COUNT_RAD = 2 * np.pi / COUNTS_PER_TURN
AXES = list(FEED_DRIVE.values())


def plant(*axes: AxisMechanics) -> Plant:
    return Plant([axis_matrices(axis) for axis in axes], STEP_S, SUBSTEPS)


def without_coulomb(axis: AxisMechanics) -> AxisMechanics:
    return replace(axis, motor_coulomb=0.0, gearbox_coulomb=0.0, guide_coulomb=0.0)


def hold(machine: Plant, effort: list[float], samples: int) -> None:
    before = np.array(effort)
    for _ in range(samples):
        machine.advance(before, before)


def state_matrix(model: AxisMatrices) -> np.ndarray:
    n = len(model.inertia)
    inverse = np.linalg.inv(model.inertia)
    return np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-inverse @ model.stiffness, -inverse @ model.damping],
        ]
    )


@pytest.mark.parametrize("axis", AXES)
def test_matrix_exponential_agrees_with_scipy(axis: AxisMechanics) -> None:
    matrix = state_matrix(axis_matrices(axis)) * STEP_S
    exact = expm(matrix)
    np.testing.assert_allclose(matrix_exponential(matrix), exact, atol=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize("axis", AXES)
def test_linear_part_agrees_with_an_implicit_runge_kutta(axis: AxisMechanics) -> None:
    """Radau (order 5, for stiff systems) on the same equations, effort steps included."""
    axis = without_coulomb(axis)
    model, machine = axis_matrices(axis), plant(axis)
    n = len(model.inertia)
    matrix, inverse = state_matrix(model), np.linalg.inv(model.inertia)
    efforts = [2.0, -3.0, 0.5]
    state, before = np.zeros(2 * n), 0.0
    for effort in efforts:
        for torque, span in ((before, STEP_S), (effort, STEP_S * (SUBSTEPS - 1))):
            force = model.constant_nm + torque * np.eye(n)[0]
            drive = np.concatenate([np.zeros(n), inverse @ force])
            state = solve_ivp(
                lambda _, y, drive=drive: matrix @ y + drive,
                (0.0, span), state, method="Radau", rtol=1e-9, atol=1e-13, jac=matrix,
            ).y[:, -1]  # fmt: skip
        machine.advance(np.array([before]), np.array([effort]))
        before = effort
    np.testing.assert_allclose(machine.state[:n], state[:n], rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(machine.state[n:], state[n:], rtol=1e-5, atol=1e-7)


def test_energy_put_in_is_energy_stored_when_nothing_dissipates() -> None:
    axis = replace(
        without_coulomb(FEED_DRIVE["x"]),
        motor_viscous=0.0, gearbox_viscous=0.0, screw_viscous=0.0, loss_factor_s=0.0,
        drive_offset=0.0,
    )  # fmt: skip
    model, machine = axis_matrices(axis), plant(axis)
    effort = 1.5
    hold(machine, [effort], 200)
    n = len(model.inertia)
    position, velocity = machine.state[:n], machine.state[n:]
    stored = 0.5 * (velocity @ model.inertia @ velocity + position @ model.stiffness @ position)
    assert stored == pytest.approx(effort * position[0], rel=1e-9)


def test_friction_never_adds_energy() -> None:
    """Coasting from full speed, the stored energy only falls."""
    machine, model = (
        plant(FEED_DRIVE["x"]),
        axis_matrices(replace(FEED_DRIVE["x"], drive_offset=0.0)),
    )
    hold(machine, [4.0], 600)
    n = len(model.inertia)
    energies = []
    for _ in range(400):
        machine.advance(np.zeros(1), np.zeros(1))
        q, v = machine.state[:n], machine.state[n:]
        energies.append(0.5 * (v @ model.inertia @ v + q @ model.stiffness @ q))
    energies = np.array(energies)
    assert energies[0] > 0.5
    assert np.all(np.diff(energies) <= 1e-6 * energies[0])
    assert energies[-1] < 1e-4 * energies[0]


def test_steady_speed_follows_from_the_reduced_parameters() -> None:
    """Constant torque: speed = (torque - coulomb - offset) / viscous."""
    efforts = [3.0, -2.5]
    machine = plant(*AXES)
    hold(machine, efforts, 4000)
    for axis, effort, speed in zip(AXES, efforts, machine.output_rad_s, strict=True):
        truth = reduced_truth(axis)
        friction = np.sign(effort) * truth.coulomb_friction
        expected = (effort - friction - truth.offset) / truth.viscous_friction
        assert speed == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_sticks_below_break_away_and_moves_above(direction: float) -> None:
    truths = [reduced_truth(axis) for axis in AXES]
    machine = plant(*AXES)
    hold(machine, [0.0, 0.0], 400)
    rest = machine.output_rad
    threshold = [t.offset + direction * t.coulomb_friction for t in truths]
    hold(machine, [t - direction * 0.02 for t in threshold], 1200)
    assert np.all(np.abs(machine.output_rad - rest) < ONE_COUNT_RAD)
    assert np.all(np.abs(machine.output_rad_s) < 1e-5)
    hold(machine, [t + direction * 0.02 for t in threshold], 1200)
    assert np.all(direction * (machine.output_rad - rest) > ONE_COUNT_RAD)


def test_weight_is_held_by_friction_without_effort() -> None:
    machine = plant(*AXES)
    hold(machine, [0.0, 0.0], 2000)
    assert np.all(np.abs(machine.output_rad) < ONE_COUNT_RAD)


def test_a_new_effort_comes_one_substep_late() -> None:
    machine = Plant([axis_matrices(axis) for axis in AXES], STEP_S, 1)
    machine.advance(np.zeros(2), np.full(2, 5.0))
    assert np.all(np.abs(machine.output_rad_s) < 1e-6)


def test_whole_samples_equal_their_substeps() -> None:
    """The shortcut for samples without a change between sliding and sticking is exact."""
    efforts = 2.5 * np.sin(np.arange(700)[:, None] * [0.02, 0.013])
    whole, single = plant(*AXES), Plant([axis_matrices(axis) for axis in AXES], STEP_S, 1)
    for before, effort in pairwise(efforts):
        whole.advance(before, effort)
        for _ in range(SUBSTEPS):  # one sub-step a sample: the effort is always the old one
            single.advance(before, before)
            before = effort
        np.testing.assert_allclose(whole.state, single.state, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("axis", AXES)
def test_deformation_stays_below_one_encoder_count(axis: AxisMechanics) -> None:
    """At full speed, motor against encoder: what lets the model be reduced."""
    machine = plant(axis)
    truth = reduced_truth(axis)
    effort = truth.coulomb_friction + truth.offset + truth.viscous_friction * 1.8
    hold(machine, [effort], 2000)
    assert abs(machine.state[0] - machine.state[1]) < ONE_COUNT_RAD
    assert abs(machine.state[2] - machine.state[1]) < ONE_COUNT_RAD


def test_reduced_truth_is_what_the_matrices_sum_to() -> None:
    """Rigid motion: all rotations equal, table and support move with the screw, base at rest."""
    for axis in AXES:
        model, truth = axis_matrices(axis), reduced_truth(axis)
        rigid = np.array([1.0, 1.0, 1.0, 1.0, 0.0, 1.0])[: len(model.inertia)]
        assert rigid @ model.inertia @ rigid == pytest.approx(truth.inertia)
        assert rigid @ model.damping @ rigid == pytest.approx(truth.viscous_friction)
        assert rigid @ model.stiffness @ rigid == pytest.approx(0.0, abs=1e-9)
        assert -rigid @ model.constant_nm == pytest.approx(truth.offset)
        assert np.abs(rigid @ model.joints) @ model.coulomb_nm == pytest.approx(
            truth.coulomb_friction
        )


def test_parameters_are_those_of_the_papers_machine() -> None:
    assert GEAR_RATIO == 131.25
    assert 2 * np.pi * LEAD_M_PER_RAD == pytest.approx(0.004)
    x, z = (reduced_truth(axis) for axis in AXES)
    assert (x.inertia, z.inertia) == pytest.approx((0.43, 0.38), abs=0.01)
    assert z.offset == pytest.approx(0.1, abs=0.01)


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

"""Equations of motion: against scipy's stiff solver, closed forms, and the books of energy."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from edge_ident.errors import ModelError
from edge_ident.model.model import BASE, AxisModel, Term
from edge_ident.simulation.machine import Machine

PERIOD_S = 0.0025
INERTIA, VISCOUS, COULOMB, OFFSET = 0.4, 0.9, 1.4, 0.1


def axis(
    *effects: Term, coulomb: float | np.ndarray = COULOMB, offset: float = OFFSET
) -> AxisModel:
    base = {
        "inertia": INERTIA,
        "viscous_friction": VISCOUS,
        "coulomb_friction": coulomb,
        "offset": offset,
    }
    return AxisModel((Term(BASE, base), *effects))


def machine(*axes: AxisModel, drives: int = 1, longest_step_s: float = np.inf) -> Machine:
    return Machine(
        {"xyz"[i]: model for i, model in enumerate(axes)},
        np.zeros((len(axes), drives)),
        np.full(len(axes), 3.0),
        PERIOD_S,
        0.0,
        longest_step_s,
    )


def run(plant: Machine, efforts: list[float]) -> np.ndarray:
    """Position and velocity (N, 2) of the first axis after every sample."""
    rows = []
    for effort in efforts:
        command = np.full(plant.position.shape, effort)
        plant.advance(command, command)
        rows.append([plant.position[0, 0], plant.velocity[0, 0]])
    return np.array(rows)


def stiffly(rates: Callable[[float, np.ndarray], list[float]], start: list[float], end_s: float):
    solution = solve_ivp(rates, (0.0, end_s), start, method="Radau", rtol=1e-10, atol=1e-12)
    return solution.y[:, -1]


def test_compliant_axis_agrees_with_a_stiff_solver() -> None:
    """Two masses, spring and damper, viscous friction: linear."""
    share, rate, ratio, effort = 0.25, 90.0, 0.05, 2.0
    term = Term(
        "coupling_compliance",
        {
            "load_inertia": share,
            "rate": rate,
            "damping_ratio": ratio,
            "deceleration": 0.0,
            "damping_rate": 0.0,
            "weight": 0.0,
        },
    )
    spring, damper = share * rate**2, 2 * ratio * share * rate

    def rates(_: float, y: np.ndarray) -> list[float]:
        motor, motor_speed, load, load_speed = y
        pull = spring * (motor - load) + damper * (motor_speed - load_speed)
        push = effort - OFFSET - VISCOUS * motor_speed - pull
        return [motor_speed, push / (INERTIA - share), load_speed, pull / share]

    exact = stiffly(rates, [0.0] * 4, 0.2)
    found = run(machine(axis(term, coulomb=0.0)), [effort] * 80)[-1]
    np.testing.assert_allclose(found, exact[:2], rtol=2e-4)


def smooth_model() -> AxisModel:
    """Everything that is smooth as long as the axis slides forward."""
    return axis(
        Term("stribeck_friction", {"level": 0.6, "speed": 0.3}),
        Term("nonlinear_viscous", {"level": 0.2, "exponent": 2.0}),
        Term("torque_ripple", {"cosine": 0.3, "sine": 0.1, "period": 0.4}),
    )


def smooth_rates(_: float, y: np.ndarray) -> list[float]:
    position, speed = y
    angle = 2 * np.pi * position / 0.4
    friction = COULOMB + 0.6 * np.exp(-((speed / 0.3) ** 2))
    load = VISCOUS * speed + OFFSET + 0.2 * speed**2 + 0.3 * np.cos(angle) + 0.1 * np.sin(angle)
    return [speed, (4.0 - friction - load) / INERTIA]


def test_friction_curve_and_ripple_agree_with_a_stiff_solver() -> None:
    exact = stiffly(smooth_rates, [0.0, 0.0], 0.5)
    found = run(machine(smooth_model()), [4.0] * 200)[-1]
    np.testing.assert_allclose(found, exact[:2], rtol=1e-5)


def test_bristles_agree_with_a_stiff_solver() -> None:
    def rates(_: float, y: np.ndarray) -> list[float]:
        position, speed = y
        shares = np.minimum(position / reaches, 1.0)
        friction = COULOMB - 0.8 + 0.8 * float(np.mean(shares))
        return [speed, (4.0 - friction - VISCOUS * speed - OFFSET) / INERTIA]

    # a gamma distribution of second order: one that falls off as r·exp(-r)
    shares = (np.arange(10) + 0.5) / 10
    reaches = 0.025 * np.array(
        [brentq(lambda r, p=p: 1 - (1 + r) * np.exp(-r) - p, 0.0, 20.0) for p in shares]
    )
    exact = stiffly(rates, [0.0, 0.0], 0.5)
    term = Term("presliding_hysteresis", {"level": 0.8, "distance": 0.05})
    found = run(machine(axis(term)), [4.0] * 200)[-1]
    np.testing.assert_allclose(found, exact, rtol=1e-3)


def test_order_of_convergence_is_four() -> None:
    exact = stiffly(smooth_rates, [0.0, 0.0], 20 * PERIOD_S)
    errors = [
        np.abs(run(machine(smooth_model(), longest_step_s=step), [4.0] * 20)[-1, 0] - exact[0])
        for step in (PERIOD_S, PERIOD_S / 2, PERIOD_S / 4)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 3.5), orders


@pytest.mark.parametrize("braking_effort", [-0.3, -1.1, -1.9, -2.77, -4.6])
def test_an_axis_that_stops_within_a_step_turns_or_stays_exactly(braking_effort: float) -> None:
    """Without viscous friction it slides on parabolas, whenever within a step it comes to rest."""
    base = {"inertia": INERTIA, "viscous_friction": 0.0, "coulomb_friction": COULOMB, "offset": 0.0}
    found = run(machine(AxisModel((Term(BASE, base),))), [3.0] * 40 + [braking_effort] * 80)[-1]
    forward_s = 40 * PERIOD_S
    top = (3.0 - COULOMB) / INERTIA * forward_s
    stop_s = top * INERTIA / (COULOMB - braking_effort)
    back = min(braking_effort + COULOMB, 0.0) / INERTIA
    left_s = 80 * PERIOD_S - stop_s
    exact = [0.5 * top * (forward_s + stop_s) + 0.5 * back * left_s**2, back * left_s]
    np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-12)


def test_a_stuck_axis_does_not_creep_until_static_friction_is_exceeded() -> None:
    plant = machine(axis(Term("stribeck_friction", {"level": 0.5, "speed": 0.1})))
    just_below, above = COULOMB + 0.5 + OFFSET - 1e-6, COULOMB + 0.5 + OFFSET + 0.05
    held = run(plant, [just_below] * 400)
    assert np.all(held == 0.0)
    assert run(plant, [above] * 40)[-1, 1] > 0.01


def test_work_put_in_is_stored_and_dissipated() -> None:
    """Sliding, sticking and turning under a swinging effort, on a spring."""
    stiffness = 0.8
    spring = {"stiffness": stiffness, "curvature": 0.0, "cosine": 0.0, "sine": 0.0, "period": 1.0}
    plant = machine(axis(Term("position_dependent_load", spring), offset=0.0), longest_step_s=1e-3)
    efforts = 3.5 * np.sin(2 * np.pi * 1.0 * PERIOD_S * np.arange(1000))
    position, velocity = run(plant, efforts.tolist()).T
    work = float(np.sum(efforts * np.diff(position, prepend=0.0)))
    lost = np.trapezoid(VISCOUS * velocity**2 + COULOMB * np.abs(velocity), dx=PERIOD_S)
    stored = 0.5 * INERTIA * velocity[-1] ** 2 + 0.5 * stiffness * position[-1] ** 2
    assert np.any(velocity == 0.0), "it must stick at times"
    assert np.sum(np.diff(np.sign(velocity)) != 0) >= 5
    assert work == pytest.approx(lost + stored, rel=1e-3)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_constant_speed_takes_viscous_coulomb_and_offset(direction: float) -> None:
    skewed = machine(axis(Term("asymmetric_friction", {"difference": 0.2})))
    speed = direction * 1.3
    effort = VISCOUS * speed + 0.2 * abs(speed) + COULOMB * direction + OFFSET
    assert run(skewed, [effort] * 2500)[-1, 1] == pytest.approx(speed, rel=1e-4)


def test_drives_that_start_at_speed_coast_to_rest_against_their_friction() -> None:
    """Without viscous friction v²/2 = friction/inertia·way, each from its own speed."""
    speed = np.array([[1.0, -2.0]])
    base = Term(BASE, {**axis(offset=0.0).terms[0].values, "viscous_friction": 0.0})
    plant = Machine(
        {"x": AxisModel((base,))}, np.zeros((1, 2)), np.array([2.0]), PERIOD_S, 0.0, velocity=speed
    )
    run(plant, [0.0] * 300)
    assert np.all(plant.velocity == 0.0)
    way = speed * np.abs(speed) * INERTIA / (2.0 * COULOMB)
    assert plant.position == pytest.approx(way, rel=1e-6)


def test_each_drive_may_have_a_time_of_its_own() -> None:
    """A payload comes when a drive's own clock says so, and brings its weight."""
    values = {"time": 5.0, "inertia": 0.0, "coulomb_friction": 0.0, "offset": 1.0}
    plant = machine(axis(Term("payload_change", values)), drives=2)
    plant.set_time(np.array([4.0, 4.99]))
    run(plant, [COULOMB + OFFSET + 0.5] * 100)
    assert plant.velocity[0, 0] > 0.1
    assert plant.velocity[0, 1] == 0.0


def test_axes_coupled_both_ways_follow_the_joint_inertia_matrix() -> None:
    """Each pulls the other; at first the accelerations are those of M⁻¹·f."""
    coupling = {"inertia": 0.15, "viscous_friction": 0.0, "coulomb_friction": 0.0}
    plant = machine(
        axis(Term("cross_axis_coupling", coupling, source_axis="y"), coulomb=0.0, offset=0.0),
        axis(Term("cross_axis_coupling", coupling, source_axis="x"), coulomb=0.0, offset=0.0),
    )
    command = np.array([[2.0], [-0.5]])
    plant.advance(command, command)
    matrix = np.array([[INERTIA, 0.15], [0.15, INERTIA]])
    expected = np.linalg.solve(matrix, command)[:, 0] * PERIOD_S
    np.testing.assert_allclose(plant.velocity[:, 0], expected, rtol=1e-2)


def test_a_stuck_axis_bears_what_its_neighbour_pulls() -> None:
    coupling = Term(
        "cross_axis_coupling",
        {"inertia": 0.15, "viscous_friction": 0.0, "coulomb_friction": 0.0},
        source_axis="x",
    )
    plant = machine(axis(coulomb=0.0, offset=0.0), axis(coupling, offset=0.0))
    acceleration = 2.0 / INERTIA
    assert 0.15 * acceleration < COULOMB
    command = np.array([[2.0], [0.0]])
    plant.advance(command, command)
    assert plant.velocity[1, 0] == 0.0


def test_many_drives_at_once_are_those_drives_one_by_one() -> None:
    levels = np.array([0.2, 0.9, 1.4])
    speeds = np.array([0.1, 0.2, 0.4])

    def model(level: float | np.ndarray, speed: float | np.ndarray) -> AxisModel:
        return axis(
            Term("presliding_hysteresis", {"level": level, "distance": 0.02}),
            Term("stribeck_friction", {"level": 0.3 * level, "speed": speed}),
        )

    efforts = (3.0 * np.sin(9.0 * PERIOD_S * np.arange(160))).tolist()
    together = machine(model(levels, speeds), drives=3, longest_step_s=1e-3)
    run(together, efforts)
    for i in range(3):
        alone = machine(model(levels[i], speeds[i]), longest_step_s=1e-3)
        run(alone, efforts)
        assert alone.position[0, 0] == pytest.approx(together.position[0, i], rel=1e-12)


def test_effects_that_take_all_inertia_are_refused() -> None:
    term = Term(
        "payload_change", {"time": 3.0, "inertia": -0.5, "coulomb_friction": 0.0, "offset": 0.0}
    )
    with pytest.raises(ModelError, match=r"inertia of -0\.1"):
        machine(axis(term))


def test_a_source_axis_that_is_not_there_is_refused() -> None:
    values = {"inertia": 0.1, "viscous_friction": 0.0, "coulomb_friction": 0.0}
    with pytest.raises(ModelError, match="no other axis is w"):
        machine(axis(Term("cross_axis_coupling", values, source_axis="w")), axis())

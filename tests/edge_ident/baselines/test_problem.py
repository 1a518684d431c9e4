"""The closed-loop simulation: exact steps, friction that sticks, a drive that obeys."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from edge_ident.baselines.problem import Course, Response, simulate
from edge_ident.errors import DataError

PERIOD_S = 0.0025
DRIVE = np.array([0.43, 0.9, 1.4, 0.1])


def sine(samples: int = 4000, rate: float = 1.5, amplitude: float = 2.0) -> Course:
    angle = rate * PERIOD_S * np.arange(samples)
    return Course(
        amplitude * np.sin(angle),
        amplitude * rate * np.cos(angle),
        -amplitude * rate**2 * np.sin(angle),
    )


def brute_force(response: Response, sample: int) -> tuple[float, float]:
    """One sample by many small steps that stop a velocity from crossing zero."""
    inertia, viscous, coulomb, offset = DRIVE
    pull = response.effort[sample] - offset
    x, v = response.position[sample], response.velocity[sample]
    substeps = 4000
    step_s = PERIOD_S / substeps
    for _ in range(substeps):
        if v == 0.0 and abs(pull) <= coulomb:
            break
        direction = np.sign(v) or np.sign(pull)
        after = v + step_s * (pull - viscous * v - coulomb * direction) / inertia
        after = 0.0 if after * direction < 0 else after
        x, v = x + step_s * 0.5 * (v + after), after
    return x, v


def test_sliding_one_way_agrees_with_an_adaptive_solver() -> None:
    """Held efforts replayed through scipy's solver end at the same state."""
    response = simulate(DRIVE, sine(samples=200), PERIOD_S)
    assert np.all(response.velocity > 0)
    inertia, viscous, coulomb, offset = DRIVE
    state = np.array([response.position[0], response.velocity[0]])
    for effort in response.effort[:-1]:
        solution = solve_ivp(
            lambda _, s, u=effort: [s[1], (u - viscous * s[1] - coulomb - offset) / inertia],
            (0.0, PERIOD_S),
            state,
            rtol=1e-10,
            atol=1e-12,
        )
        state = solution.y[:, -1]
    np.testing.assert_allclose(state, [response.position[-1], response.velocity[-1]], rtol=1e-8)


def test_every_reversal_agrees_with_many_small_steps() -> None:
    response = simulate(DRIVE, sine(), PERIOD_S)
    crossings = np.flatnonzero(np.diff(np.sign(response.velocity)))
    assert len(crossings) >= 4
    for sample in crossings:
        x, v = brute_force(response, sample)
        assert response.position[sample + 1] == pytest.approx(x, abs=1e-7)
        assert response.velocity[sample + 1] == pytest.approx(v, abs=1e-5)


def test_an_axis_at_rest_stays_there_below_coulomb_friction() -> None:
    stiffness = DRIVE[0] * (0.3 / PERIOD_S) ** 2
    for push, moves in ((0.9, False), (1.1, True)):
        away = np.full(2000, push * DRIVE[2] / stiffness)
        away[0] = 0.0
        response = simulate(DRIVE, Course(away, 0 * away, 0 * away), PERIOD_S)
        assert np.any(response.position != 0.0) == moves
        assert abs(response.velocity[-1]) < 1e-9


def test_the_drive_obeys_and_its_effort_is_that_of_the_model() -> None:
    """Away from reversals the effort is the inverse model's, half a sample later."""
    course = sine()
    response = simulate(DRIVE, course, PERIOD_S)
    assert np.max(np.abs(response.position - course.position)) < 1e-3
    inverse = DRIVE @ [
        course.acceleration,
        course.velocity,
        np.sign(course.velocity),
        np.ones(4000),
    ]
    between = 0.5 * (inverse[1:] + inverse[:-1])
    steady = np.abs(course.velocity[:-1]) > 0.5
    np.testing.assert_allclose(response.effort[:-1][steady], between[steady], atol=2e-3)


def test_zero_friction_is_a_drive_too() -> None:
    frictionless = np.array([0.43, 0.0, 0.0, 0.0])
    response = simulate(frictionless, sine(), PERIOD_S)
    np.testing.assert_allclose(response.position, sine().position, atol=1e-4)


@pytest.mark.parametrize(
    ("index", "value", "name"),
    [(0, 0.0, "inertia"), (1, -0.1, "viscous"), (2, -1.0, "coulomb")],
)
def test_impossible_drives_are_refused(index: int, value: float, name: str) -> None:
    impossible = DRIVE.copy()
    impossible[index] = value
    with pytest.raises(DataError, match=name):
        simulate(impossible, sine(), PERIOD_S)

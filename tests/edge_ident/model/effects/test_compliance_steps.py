"""A load on a spring with dry friction: many samples at once are the same as one by one."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.model.effects import named
from edge_ident.model.motion import Motion

PERIOD_S = 0.004
RATE, RATIO, DECELERATION, DAMPING, WEIGHT = 25.0, 0.05, 1.5, 0.3, 0.2


def swinging() -> Motion:
    """Two sines, some of whose reversals are slower than the load's ringing, others quicker."""
    time_s = PERIOD_S * np.arange(3000)
    parts = [
        (size * rate**n, rate * time_s + 0.5 * n * np.pi)
        for n in range(3)
        for size, rate in ((1.0, 1.3), (0.05, 11.0))
    ]
    waves = [size * np.sin(angle) for size, angle in parts]
    return Motion.known(time_s, *(waves[k] + waves[k + 1] for k in (0, 2, 4)))


def pull_one_by_one(motion: Motion) -> NDArray[np.float64]:
    """Spring and damper on a load, from the exact response to straight inputs."""
    ratio = RATIO + 0.5 * DAMPING / RATE
    system = np.array([[0.0, 1.0], [-(RATE**2), -2.0 * ratio * RATE]])
    decay, held, rising = exact_step(system, PERIOD_S)
    load = motion.acceleration + DAMPING * motion.velocity + WEIGHT
    state = np.array([(load[0] + DECELERATION * np.sign(motion.velocity[0])) / RATE**2, 0.0])
    states = [state]
    for k in range(1, len(load)):
        free = decay @ state + held * load[k - 1] + rising * (load[k] - load[k - 1])
        # the load's speed is the drive's less that of the lag
        stops = (motion.velocity[k] - free[1]) / held[1]
        state = free + held * np.clip(stops, -DECELERATION, DECELERATION)
        states.append(state)
    lag, speed = np.array(states).T
    return np.asarray(RATE * (RATE * lag + 2.0 * RATIO * speed))


def exact_step(system: NDArray[np.float64], step_s: float) -> tuple[NDArray[np.float64], ...]:
    """What a step leaves of a state, and its responses to an input of one and to one that rises."""
    values, vectors = np.linalg.eig(system)
    back = np.linalg.inv(vectors)
    power = np.exp(values * step_s)
    held = (power - 1.0) / values
    rising = (held - step_s) / (values * step_s)
    decay, held, rising = ((vectors * x @ back).real for x in (power, held, rising))
    return decay, held[:, 1], rising[:, 1]


def test_friction_is_the_same_for_many_samples_at_once() -> None:
    motion = swinging()
    values = {
        "load_inertia": 1.0, "rate": RATE, "damping_ratio": RATIO, "deceleration": DECELERATION,
        "damping_rate": DAMPING, "weight": WEIGHT,
    }  # fmt: skip
    arrays = {name: np.full((2, 1), value) for name, value in values.items()}
    found = named("coupling_compliance").resistance(motion, arrays)
    carried = motion.acceleration + DAMPING * motion.velocity + WEIGHT
    wanted = pull_one_by_one(motion) - carried - DECELERATION * motion.direction
    assert found == pytest.approx(np.stack([wanted, wanted]), abs=1e-9 * np.max(np.abs(wanted)))


@pytest.mark.parametrize("per_sample", [1.0, 3.0, 4.0, 6.0, 20.0, 400.0, 4e3])
def test_a_spring_that_samples_do_not_resolve_adds_next_to_nothing(per_sample: float) -> None:
    """Friction of its load keeps the direction of the motion: all that is left is at reversals."""
    motion = swinging()
    values = {
        "load_inertia": 1.0, "rate": per_sample / PERIOD_S, "damping_ratio": 0.1,
        "deceleration": DECELERATION, "damping_rate": DAMPING, "weight": WEIGHT,
    }  # fmt: skip
    arrays = {name: np.array([[value]]) for name, value in values.items()}
    with np.errstate(all="raise", under="ignore"):
        added = named("coupling_compliance").resistance(motion, arrays)
    # twenty reversals, each with a ringing of few samples, in three thousand
    assert np.sqrt(np.mean(added**2)) < 0.2 * DECELERATION
    assert np.median(np.abs(added)) < 0.02 * DECELERATION

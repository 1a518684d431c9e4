"""What sets each effect apart along a known motion, and the order in which effects compose."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import BASE, AxisModel, Term
from edge_ident.model.motion import Motion

INERTIA, VISCOUS, COULOMB, OFFSET = 0.4, 0.9, 1.4, 0.1
PERIOD_S = 0.0025
BASE_TERM = Term(
    BASE,
    {
        "inertia": INERTIA,
        "viscous_friction": VISCOUS,
        "coulomb_friction": COULOMB,
        "offset": OFFSET,
    },
)


def sine(
    amplitude: float = 1.0, rate: float = 2.0, phase: float = 0.0, samples: int = 4000
) -> Motion:
    time = PERIOD_S * np.arange(samples)
    angle = rate * time + phase
    position = amplitude * np.sin(angle)
    return Motion.known(time, position, amplitude * rate * np.cos(angle), -(rate**2) * position)


def constant_speed(speed: float) -> Motion:
    time = PERIOD_S * np.arange(2000)
    return Motion.known(time, speed * time, np.full(2000, speed), np.zeros(2000))


def added(motion: Motion, *terms: tuple[str, dict[str, float]]) -> np.ndarray:
    """Effort that effects add to the base model's."""
    axis = AxisModel((BASE_TERM, *(Term(effect, values) for effect, values in terms)))
    return inverse_effort(axis, motion) - inverse_effort(AxisModel((BASE_TERM,)), motion)


def test_stribeck_bump_is_below_its_speed_and_opposes_both_directions() -> None:
    for speed, share in ((0.05, np.exp(-0.25)), (0.1, np.exp(-1.0)), (1.0, 0.0)):
        for sign in (1, -1):
            effort = added(
                constant_speed(sign * speed), ("stribeck_friction", {"level": 0.5, "speed": 0.1})
            )
            np.testing.assert_allclose(effort, sign * 0.5 * share, atol=1e-12)


def test_presliding_is_the_same_at_any_rate_and_builds_up_over_its_distance() -> None:
    values = {"level": 0.8, "distance": 0.05}
    slow, fast = (
        added(sine(rate=rate, samples=samples), ("presliding_hysteresis", values))
        for rate, samples in ((1.0, 4000), (4.0, 1000))
    )
    np.testing.assert_allclose(slow[::4], fast, atol=2e-3)
    motion = sine()
    turn = int(np.argmax(motion.velocity < 0))
    back = motion.position[turn - 1] - motion.position
    after = turn + int(np.argmax(back[turn:] > 0.05))
    lag = added(motion, ("presliding_hysteresis", values))[after] / 0.8
    assert lag == pytest.approx(2 * np.exp(-1.0), abs=0.02), "still pushes the old way"


def test_presliding_builds_up_as_an_exponential_of_the_distance() -> None:
    motion = sine(samples=3000)
    values = {"level": 0.8, "distance": 0.05}
    found = added(motion, ("presliding_hysteresis", values)) + 0.8 * np.sign(motion.velocity)
    back = (motion.velocity < 0) & (np.arange(3000) < 1400)
    travelled = np.max(motion.position) - motion.position[back]
    np.testing.assert_allclose(
        found[back], 0.8 * (1.0 - 2.0 * (1.0 - np.exp(-travelled / 0.05))), atol=0.05
    )


def test_presliding_remembers_a_reversal_until_it_is_passed_again() -> None:
    def friction(*turns: int) -> tuple[np.ndarray, np.ndarray]:
        """Position and friction, in steps of 0.001 from turn to turn (in steps)."""
        legs = [np.arange(a, b, np.sign(b - a)) * 1e-3 for a, b in pairwise(turns)]
        velocity = np.repeat(np.sign(np.diff(turns)), [len(leg) for leg in legs])
        position = np.concatenate(legs)
        motion = Motion.known(1e-2 * np.arange(len(position)), position, velocity, 0.0 * position)
        values = {"level": 0.8, "distance": 0.05}
        return position, added(motion, ("presliding_hysteresis", values)) + 0.8 * velocity

    position, looped = friction(0, 1000, 960, 970, 500)
    _, straight = friction(0, 1000, 500)
    begins, passed = 1040, 1060  # at 0.96, and there again
    assert position[passed] == pytest.approx(0.96)
    np.testing.assert_allclose(looped[passed:], straight[begins:], atol=1e-12)
    assert np.all(looped[begins + 1 : passed] > straight[begins] + 1e-3), "a loop inside"


def test_backlash_leaves_only_the_near_side_for_the_width_of_the_gap() -> None:
    gap = {"gap": 0.1, "load_inertia": 0.2, "deceleration": 4.5, "damping_rate": 0.0, "weight": 0.0}
    motion = sine(rate=0.5, samples=6000)
    effort = added(motion, ("backlash", gap))
    turn = int(np.argmax(motion.velocity < 0))
    travelled = motion.position[turn] - motion.position
    # the shaft between is let go first
    between = (travelled > 0.001) & (travelled < 0.099) & (motion.velocity < 0)
    inside = np.flatnonzero(between & (np.arange(6000) > turn))
    near_side = -(0.2 * motion.acceleration - 0.9)
    np.testing.assert_allclose(effort[inside], near_side[inside], atol=1e-9)
    beyond = (travelled > 0.13) & (motion.velocity < -0.05) & (np.arange(6000) < 2 * turn)
    np.testing.assert_allclose(effort[beyond], 0.0, atol=0.01)


def test_the_impact_at_the_end_of_the_gap_passes_the_loads_momentum() -> None:
    motion = sine(rate=0.5, samples=6000)
    effort = added(
        motion,
        (
            "backlash",
            {
                "gap": 0.1,
                "load_inertia": 0.2,
                "deceleration": 4.5,
                "damping_rate": 0.0,
                "weight": 0.0,
            },
        ),
    )
    turn = int(np.argmax(motion.velocity < 0))
    hit = turn + int(np.argmax(np.abs(effort[turn + 5 :]))) + 5
    contact = effort + 0.2 * motion.acceleration + 0.9 * np.sign(motion.velocity)
    np.testing.assert_allclose(contact[hit - 20 : hit - 4], 0.0, atol=1e-9)
    # until the load has come to the drive's speed, its friction acts as well
    impulse = np.sum(contact[hit - 4 : hit + 40]) * PERIOD_S
    friction = 0.9 * 41 * PERIOD_S * np.sign(motion.velocity[hit])
    assert impulse == pytest.approx(0.2 * motion.velocity[hit + 40] + friction, rel=0.03)


def test_a_motion_smaller_than_the_gap_does_not_move_the_load() -> None:
    motion = sine(amplitude=0.02, rate=4.0)
    effort = added(
        motion,
        (
            "backlash",
            {
                "gap": 0.1,
                "load_inertia": 0.2,
                "deceleration": 4.5,
                "damping_rate": 0.0,
                "weight": 0.0,
            },
        ),
    )
    bare = 0.2 * motion.acceleration + 0.9 * np.sign(motion.velocity)
    away = (np.abs(motion.position) < 0.0199) & (np.arange(4000) > 1500)
    np.testing.assert_allclose(effort[away], -bare[away], atol=1e-3)


def test_ripple_repeats_in_position_at_any_speed_and_direction() -> None:
    ripple = ("torque_ripple", {"cosine": 0.2, "sine": 0.1, "period": 0.25})
    for speed in (0.3, -1.7):
        motion = constant_speed(speed)
        angle = 2 * np.pi * motion.position / 0.25
        expected = 0.2 * np.cos(angle) + 0.1 * np.sin(angle)
        np.testing.assert_allclose(added(motion, ripple), expected, atol=1e-12)


def test_position_dependent_friction_flips_with_direction_and_load_does_not() -> None:
    wave = {"cosine": 0.2, "sine": 0.0, "period": 0.7}
    forward, backward = constant_speed(0.5), constant_speed(-0.5)
    friction = ("position_dependent_friction", {"gradient": 0.1, **wave})
    load = ("position_dependent_load", {"stiffness": 0.1, "curvature": 0.0, **wave})
    np.testing.assert_allclose(added(forward, friction), added(forward, load), atol=1e-12)
    np.testing.assert_allclose(added(backward, friction), -added(backward, load), atol=1e-12)


def test_coupling_compliance_is_a_second_mass_on_a_spring() -> None:
    """Against the equation of the load's own motion, by an adaptive solver."""
    inertia, rate, ratio = 0.2, 12.0, 0.1
    motion = sine(rate=3.0, phase=0.4, samples=1500)
    values = {
        "load_inertia": inertia,
        "rate": rate,
        "damping_ratio": ratio,
        "deceleration": 0.0,
        "damping_rate": 0.0,
        "weight": 0.0,
    }
    found = added(motion, ("coupling_compliance", values))

    def acceleration(time: float) -> float:
        return -9.0 * np.sin(3.0 * time + 0.4)

    def rates(time: float, y: np.ndarray) -> list[float]:
        return [y[1], acceleration(time) - 2 * ratio * rate * y[1] - rate**2 * y[0]]

    lag = solve_ivp(
        rates, (0, motion.time_s[-1]), [acceleration(0.0) / rate**2, 0.0],
        t_eval=motion.time_s, rtol=1e-9, atol=1e-12,
    ).y  # fmt: skip
    pull = rate**2 * lag[0] + 2 * ratio * rate * lag[1]
    # the two start alike but for the damper, which is at rest in one and not in the other
    np.testing.assert_allclose(found, inertia * (pull - motion.acceleration), atol=0.02)


def test_a_delay_shifts_the_whole_effort() -> None:
    motion = sine()
    total = inverse_effort(AxisModel((BASE_TERM,)), motion)
    late = total + added(motion, ("time_delay", {"delay": 4 * PERIOD_S}))
    np.testing.assert_allclose(late[4:], total[:-4], atol=1e-12)


def test_eccentricity_costs_effort_that_grows_with_the_square_of_the_speed() -> None:
    values = {"cosine": 0.0, "sine": 0.01, "period": 1.0}
    peaks = []
    for speed in (0.5, 1.0):
        effort = added(constant_speed(speed), ("encoder_eccentricity", values))
        peaks.append(np.max(np.abs(effort)))
    # viscous friction takes a smaller part, a quarter period apart
    viscous = [speed * VISCOUS * 0.01 * 2 * np.pi for speed in (0.5, 1.0)]
    inertial = np.sqrt(np.square(peaks) - np.square(viscous))
    assert inertial[1] / inertial[0] == pytest.approx(4.0, rel=0.15)
    assert inertial[1] == pytest.approx(INERTIA * 0.01 * (2 * np.pi) ** 2, rel=0.15)


def test_deadband_flips_with_the_effort_not_with_the_velocity() -> None:
    motion = sine(rate=8.0)
    total = inverse_effort(AxisModel((BASE_TERM,)), motion)
    effort = added(motion, ("actuator_deadband", {"width": 0.3}))
    np.testing.assert_allclose(effort, 0.3 * np.sign(total))
    assert np.any(np.sign(total) != np.sign(motion.velocity))


def test_saturation_touches_only_what_exceeds_the_limit() -> None:
    motion = sine()
    total = inverse_effort(AxisModel((BASE_TERM,)), motion)
    effort = added(motion, ("actuator_saturation", {"limit": 2.5}))
    np.testing.assert_allclose(effort[np.abs(total) <= 2.5], 0.0)
    assert np.max(np.abs(total + effort)) == pytest.approx(2.5)


def test_load_dependent_friction_is_a_share_of_what_passes_through() -> None:
    motion = sine(rate=6.0)
    lost = added(motion, ("load_dependent_friction", {"share": 0.3}))
    transmitted = INERTIA * motion.acceleration + OFFSET + lost
    np.testing.assert_allclose(lost, 0.3 * np.abs(transmitted) * np.sign(motion.velocity))


def at_speed(speed: float, *terms: tuple[str, dict[str, float]]) -> np.ndarray:
    """Whole effort of a drive at constant speed."""
    axis = AxisModel((BASE_TERM, *(Term(effect, values) for effect, values in terms)))
    return inverse_effort(axis, constant_speed(speed))


def test_warm_up_is_viscous_friction_that_decays_at_its_rate() -> None:
    warm_up = ("warm_up", {"excess": 0.4, "time_constant": 3.0})
    time = PERIOD_S * np.arange(2000)
    cold, doubled = added(constant_speed(0.5), warm_up), added(constant_speed(1.0), warm_up)
    np.testing.assert_allclose(doubled, 2.0 * cold)
    assert cold[0] == pytest.approx(0.2)
    decay = solve_ivp(lambda _, y: -y / 3.0, (0, time[-1]), [0.2], t_eval=time, rtol=1e-9)
    np.testing.assert_allclose(cold, decay.y[0], rtol=1e-5)


def test_offset_drift_does_not_heed_the_motion_and_settles() -> None:
    drift = ("offset_drift", {"rate": 0.2, "curvature": 0.0, "time_constant": 1.5})
    moving, standing = added(sine(), drift), added(constant_speed(0.0), drift)
    np.testing.assert_allclose(moving[:2000], standing)
    assert moving[0] == 0.0
    assert (moving[1] - moving[0]) / PERIOD_S == pytest.approx(0.2, rel=2e-3)
    assert moving[-1] == pytest.approx(0.2 * 1.5, rel=2e-3)  # 10 s are 6.7 time constants
    half = moving[round(1.5 * np.log(2.0) / PERIOD_S)]
    assert half == pytest.approx(0.5 * 0.2 * 1.5, rel=2e-3)
    straight = added(sine(), ("offset_drift", {"rate": 0.2, "curvature": -0.01}))
    np.testing.assert_allclose(np.diff(straight, 2) / PERIOD_S**2, -0.02, rtol=1e-4)


def test_friction_by_direction_is_larger_forward_by_what_it_is_smaller_backward() -> None:
    asymmetry = ("asymmetric_friction", {"difference": 0.2})
    forward, backward = (
        (at_speed(2.0 * way, asymmetry) - at_speed(way, asymmetry))[0] / way for way in (1, -1)
    )
    assert forward == pytest.approx(VISCOUS + 0.2)
    assert backward == pytest.approx(VISCOUS - 0.2)
    np.testing.assert_allclose(at_speed(1e-9, asymmetry), COULOMB + OFFSET)


@pytest.mark.parametrize("exponent", [0.5, 2.0])
def test_nonlinear_friction_brakes_both_ways_by_its_power_of_the_speed(exponent: float) -> None:
    friction = ("nonlinear_viscous", {"level": 0.3, "exponent": exponent})
    slow, fast, back = (added(constant_speed(speed), friction)[0] for speed in (0.7, 2.1, -0.7))
    assert slow > 0.0
    assert back == pytest.approx(-slow)
    assert np.log(fast / slow) / np.log(3.0) == pytest.approx(exponent)
    assert added(constant_speed(1.0), friction)[0] == pytest.approx(0.3)


def test_a_payload_makes_another_axis_of_this_one_from_its_time_on() -> None:
    payload = {"inertia": 0.1, "coulomb_friction": 0.2, "offset": 0.3}
    loaded = {name: BASE_TERM.values[name] + payload.get(name, 0.0) for name in BASE_TERM.values}
    motion = sine()
    before, after = (inverse_effort(AxisModel((Term(BASE, v),)), motion)
                     for v in (BASE_TERM.values, loaded))  # fmt: skip
    term = Term("payload_change", {"time": 4.0, **payload})
    found = inverse_effort(AxisModel((BASE_TERM, term)), motion)
    np.testing.assert_allclose(found[:1600], before[:1600])
    np.testing.assert_allclose(found[1600:], after[1600:])


def test_a_push_gives_its_momentum_once_and_without_a_jump() -> None:
    push = {"time": 2.0, "duration": 1.0, "level": 0.7}
    motion = sine()
    effort = added(motion, ("disturbance_event", push))
    during = (motion.time_s > 2.0) & (motion.time_s < 3.0)
    assert not effort[~during].any()
    assert np.sum(effort) * PERIOD_S == pytest.approx(0.7 * 1.0 / 2.0, rel=1e-6)
    assert motion.time_s[np.argmax(effort)] == pytest.approx(2.5)
    assert np.max(effort) == pytest.approx(0.7)
    assert np.max(np.abs(np.diff(effort))) < 1.05 * np.pi * 0.7 * PERIOD_S


def test_gain_drift_scales_all_that_acts_and_the_delay_comes_last() -> None:
    """Whatever the order in the file: resistances, then the actuator, then the record."""
    motion = sine()
    terms = [
        ("time_delay", {"delay": 2 * PERIOD_S}),
        ("gain_drift", {"rate": 0.05, "curvature": 0.0}),
        ("stribeck_friction", {"level": 0.5, "speed": 0.1}),
    ]
    stribeck = inverse_effort(AxisModel((BASE_TERM, Term(*terms[2]))), motion)
    scaled = stribeck * (1 + 0.05 * motion.time_s)
    found = inverse_effort(AxisModel((BASE_TERM, *(Term(*term) for term in terms))), motion)
    np.testing.assert_allclose(found[2:], scaled[:-2], atol=1e-12)

"""Gains: the promised poles and margins, checked against simulations that share no formula."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from edge_ident.control.compensation import plant_of
from edge_ident.control.gain_design import (
    GAIN_MARGIN,
    PHASE_MARGIN_RAD,
    QUANTIZATION_SHARE,
    Ground,
    design,
    left_alone,
    worst_margins,
)
from edge_ident.control.position_loop import LoopHardware, open_loop
from edge_ident.errors import GainError
from edge_ident.model.effects import named
from edge_ident.model.inverse import inertia_of_poses
from edge_ident.model.model import AxisModel, Estimate, SupportedRange, Term, base_axis

HARDWARE = LoopHardware(0.0025, 0.0005, 2 * math.pi / 8400, 12.0)
PARAMETERS = np.array([0.43, 0.9, 1.4, 0.03])


def axis(inertia_std: float = 0.0, parameters: np.ndarray = PARAMETERS) -> AxisModel:
    return base_axis(Estimate(parameters, np.array([inertia_std, 0.0, 0.0, 0.0])))


def step_loop(gain: float, delay_samples: int, designed, samples: int = 4000) -> np.ndarray:
    """Position error after a push: the sampled law around the continuous axis, by simulation."""
    g = designed.gains
    inertia, viscous = PARAMETERS[:2]
    period = HARDWARE.sample_period_s
    plant = (
        np.array([[0.0, 1.0], [0.0, -viscous / inertia]]),
        np.array([[0.0], [1.0 / inertia]]),
        np.eye(2),
        np.zeros((2, 1)),
    )
    a, b, *_ = scipy.signal.cont2discrete(plant, period)
    state, filtered, last = np.array([0.0, 0.1]), 0.0, 0.0
    queue = [0.0] * delay_samples
    smoothing = period / (g.velocity_filter_s + period)
    trace = np.empty(samples)
    for k in range(samples):
        filtered += smoothing * ((state[0] - last) / period - filtered)
        last = state[0]
        queue.append(-gain * (g.proportional * state[0] + g.derivative * filtered))
        state = a @ state + b[:, 0] * queue.pop(0)
        trace[k] = state[0]
    return trace


def test_margins_quantization_and_poles_are_as_promised() -> None:
    found = design(axis(0.02), HARDWARE)
    assert found.phase_margin_rad >= PHASE_MARGIN_RAD
    assert found.gain_margin >= GAIN_MARGIN
    assert found.quantization_effort_nm <= QUANTIZATION_SHARE * HARDWARE.effort_limit_nm
    gains = found.gains
    closed = [PARAMETERS[0], PARAMETERS[1] + gains.derivative, gains.proportional]
    np.testing.assert_allclose(np.abs(np.roots(closed)), found.bandwidth_rad_s, rtol=1e-6)
    assert gains.coulomb_feedforward == PARAMETERS[2]


def test_what_is_left_alone_has_the_margins_of_its_own_loop() -> None:
    """A run showed those of the design that it did not write beside the gains in force."""
    soft = design(axis(0.02), HARDWARE, 4.0)
    kept = left_alone(soft.gains, axis(0.02), HARDWARE, "nothing better is promised")
    assert kept.gains == soft.gains
    assert kept.bandwidth_rad_s == pytest.approx(4.0, rel=0.01)
    assert (kept.phase_margin_rad, kept.gain_margin) == pytest.approx(
        (soft.phase_margin_rad, soft.gain_margin), rel=0.05
    )
    assert kept.kept == "nothing better is promised"


def test_nothing_is_left_of_a_constant_acceleration() -> None:
    """The sampled law on the continuous axis, half a sample and the delay late."""
    gains, period = design(axis(), HARDWARE).gains, HARDWARE.sample_period_s
    inertia, viscous = PARAMETERS[:2]
    steps = 20
    late = round(HARDWARE.control_delay_s / period * steps)
    position = speed = filtered = last = effort = 0.0
    errors = []
    for k in range(800):
        time = k * period
        difference = (position - last) / period
        filtered += period / (gains.velocity_filter_s + period) * (difference - filtered)
        last = position
        errors.append(2.0 * time**2 / 2.0 - position)
        following = (
            gains.proportional * errors[-1]
            + gains.derivative * (2.0 * time - filtered)
            + gains.inertia_feedforward * 2.0
            + gains.viscous_feedforward * 2.0 * time
        )
        for step in range(steps):
            acting = effort if step < late else following
            speed += (acting - viscous * speed) / inertia * period / steps
            position += speed * period / steps
        effort = following
    print(errors[-1])
    # feed-forward of the whole inertia leaves 3 mrad
    assert abs(errors[-1]) < 5e-5


def test_gain_margin_is_where_a_simulated_loop_turns_unstable() -> None:
    found = design(axis(), HARDWARE)
    no_delay = LoopHardware(0.0025, 0.0, 2 * math.pi / 8400, 12.0)
    exact = design(axis(), no_delay, found.bandwidth_rad_s)
    stable = step_loop(0.97 * exact.gain_margin, 0, exact)
    unstable = step_loop(1.03 * exact.gain_margin, 0, exact)
    assert np.max(np.abs(stable[-500:])) < 1e-3 * np.max(np.abs(stable))
    assert np.max(np.abs(unstable[-500:])) > np.max(np.abs(unstable[:500]))


def test_delay_costs_bandwidth() -> None:
    slow = LoopHardware(0.0025, 0.020, 2 * math.pi / 8400, 1e6)
    quick = LoopHardware(0.0025, 0.0005, 2 * math.pi / 8400, 1e6)
    assert design(axis(), slow).bandwidth_rad_s < 0.5 * design(axis(), quick).bandwidth_rad_s


def test_doubt_about_the_inertia_is_paid_for_in_filtering() -> None:
    """Margins hold at both ends of its interval: what filters less delays less."""
    sure = design(axis(), HARDWARE, 8.0)
    unsure = design(axis(0.05), HARDWARE, 8.0)
    assert unsure.gains.velocity_filter_s < sure.gains.velocity_filter_s
    assert unsure.phase_margin_rad > PHASE_MARGIN_RAD


@pytest.mark.parametrize(
    ("parameters", "std", "bandwidth", "message"),
    [
        ([-0.1, 0.9, 1.4, 0.0], 0.01, None, "no gains follow from inertia"),
        ([0.4, 0.9, -1.4, 0.0], 0.01, None, "no gains follow from inertia"),
        ([0.4, 0.9, 1.4, 0.0], 0.3, None, "no gains follow from inertia"),
        ([0.4, 0.9, 1.4, 0.0], 0.01, 150.0, "leaves a phase margin of"),
        ([0.4, 0.9, 1.4, 0.0], 0.01, 1e300, "leaves a phase margin of"),
    ],
)
def test_doubtful_gains_are_refused(
    parameters: list[float], std: float, bandwidth: float | None, message: str
) -> None:
    with pytest.raises(GainError, match=message) as error:
        design(axis(std, np.array(parameters)), HARDWARE, bandwidth)
    assert error.value.exit_code == 1


@pytest.mark.parametrize("units", [("m", "N"), ("rad", "A")])
def test_a_board_gets_no_gains_in_other_units(units: tuple[str, str]) -> None:
    other = base_axis(Estimate(PARAMETERS, np.zeros(4)), *units)
    with pytest.raises(GainError, match=rf"in {units[0]} and {units[1]}"):
        design(other, HARDWARE)


@pytest.mark.parametrize("poles_rad_s", [10.0, None])
def test_the_usual_bandwidths_are_in_proportion_to_the_frequency_of_the_poles(
    poles_rad_s: float | None,
) -> None:
    """As docs/method.md says of the built-in drive."""
    found = design(axis(), HARDWARE, poles_rad_s)
    omega, loop = open_loop(found.gains, plant_of(axis()), HARDWARE)
    closed, sensitivity = np.abs(loop / (1.0 + loop)), np.abs(1.0 / (1.0 + loop))
    poles_rad_s, three_db = found.bandwidth_rad_s, math.sqrt(0.5)
    for begins, low, high in (
        (np.abs(loop) < 1.0, 1.9, 2.0),
        ((closed < three_db) & (omega > poles_rad_s), 3.2, 3.4),
        (sensitivity > three_db, 1.3, 1.3),
    ):
        assert low - 0.1 < omega[np.argmax(begins)] / poles_rad_s < high + 0.1


def test_the_margins_hold_in_every_pose_that_was_seen() -> None:
    """Where the cosine of another joint's angle vanished, a crane has six times the inertia that it
    has with its boom up: gains for that, with 50° by their own account, made it unstable there."""
    turning = dict.fromkeys((p.name for p in named("pose_dependent_inertia").parameters), 0.0)
    pose = Term("pose_dependent_inertia", {**turning, "turning_cosine_2": 1.5}, source_axis="luff")
    base = axis(parameters=np.array([1.75, 0.9, 1.4, 0.03]))
    slew = AxisModel((*base.terms, pose), *base.units)
    seen = SupportedRange((0.9, 1.45), (-1.0, 1.0), (-9.0, 9.0), (-9.0, 9.0))
    luff = AxisModel((replace(base.terms[0], supported=seen),), *base.units)
    least, most = inertia_of_poses(slew, {"luff": luff})
    assert least == pytest.approx(1.75 + 1.5 * np.cos(2.9), rel=1e-3)
    assert most == pytest.approx(1.75 + 1.5 * np.cos(1.8), rel=1e-3)
    assert inertia_of_poses(slew, {})[1] == pytest.approx(3.25), "anywhere on a turn"
    gains = design(slew, HARDWARE, ground=Ground(others={"luff": luff})).gains
    for inertia in (least, most):
        there = axis(parameters=np.array([inertia, 0.9, 1.4, 0.03]))
        phase_margin_rad, gain_margin = worst_margins(gains, there, HARDWARE)
        assert phase_margin_rad > 0.99 * PHASE_MARGIN_RAD
        assert gain_margin > GAIN_MARGIN
    assert least < gains.inertia_feedforward + gains.derivative * 0.01 < most

"""The control law: each term as documented, off without a trace, and the same however it is run."""

import math
from dataclasses import replace

import numpy as np
import pytest
from law_cases import (
    NEUTRAL,
    PERIOD_S,
    documented_feedforward,
    drawn_gains,
    drawn_way,
    of_map_3,
    old_feedforward,
    rows,
    stepped,
)

from edge_ident.simulation.loop import Controllers
from firmware_interface.control_law import (
    NOTHING,
    Memory,
    deadband_nm,
    exact_effort_nm,
    feedforward_nm,
)
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Reference
from firmware_interface.virtual.controller import AxisController, Setpoint

SEEDS = range(5)
AT_REST = Setpoint(0.0, 0.0, 0.0)


def effort(gains: AxisGains, own: Setpoint, other: Setpoint = AT_REST) -> float:
    """Feed-forward without a past."""
    return float(feedforward_nm(gains, own, other=other))


# ---- off


@pytest.mark.parametrize("seed", SEEDS)
def test_with_the_new_terms_off_efforts_are_those_of_map_3_to_the_last_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gains, way, other = of_map_3(drawn_gains(rng)), drawn_way(rng), drawn_way(rng)
    wanted = [old_feedforward(gains, own) for own in rows(way)]
    assert [
        effort(gains, own, by) for own, by in zip(rows(way), rows(other), strict=True)
    ] == wanted
    assert feedforward_nm(gains, way, np, other).tolist() == pytest.approx(wanted, abs=1e-13)
    assert deadband_nm(gains, 3.7) == 3.7
    assert NOTHING.after(gains, 0.1) == NOTHING


@pytest.mark.parametrize(
    "idle",
    [
        {"friction_top_speed_rad_s": 0.3},
        {"table_start_rad": 0.7, "table_step_rad": 0.01, "table_fade_speed_rad_s": 0.1},
        {
            "ripple_fade_speed_rad_s": (0.1,) * 4,
            "ripple_cosine": (0.0,) * 4,
            "ripple_sine": (0.0,) * 4,
        },
        {"presliding_distance_rad": 0.01, "backlash_distance_rad": 0.01},
        {"deadband_smoothing": 0.01},
        {"transmitted_inertia": 1.0, "transmitted_friction": 1.0},
    ],
    ids=lambda idle: next(iter(idle)),
)
def test_what_only_shapes_a_term_does_nothing_without_it(idle: dict[str, object]) -> None:
    rng = np.random.default_rng(0)
    known = {name: idle[name] for name in ("ripple_cosine", "ripple_sine") if name in idle}
    gains = replace(of_map_3(drawn_gains(rng)), **known)  # type: ignore[arg-type]
    way, other = drawn_way(rng), drawn_way(rng)
    found, _ = exact_effort_nm(replace(gains, **idle), way, other)  # type: ignore[arg-type]
    assert np.array_equal(found, exact_effort_nm(gains, way, other)[0])


def test_simulated_loops_with_the_new_terms_off_command_what_they_did() -> None:
    rng = np.random.default_rng(1)
    plain = AxisGains(*rng.uniform(0.1, 5.0, 9).tolist())
    law = Controllers({"x": [plain], "z": [plain]}, PERIOD_S, np.zeros((2, 1)))
    last, filtered, integral = 0.0, 0.0, 0.0
    for own in rows(drawn_way(rng, 0.5)):
        position = float(rng.normal())
        share = PERIOD_S / (plain.velocity_filter_s + PERIOD_S)
        filtered += share * ((position - last) / PERIOD_S - filtered)
        last, error = position, own.position_rad - position
        integral += plain.integral * error * PERIOD_S
        wanted = (
            plain.proportional * error
            + plain.derivative * (own.velocity_rad_s - filtered)
            + integral
            + plain.inertia_feedforward * own.acceleration_rad_s2
            + plain.viscous_feedforward * own.velocity_rad_s
            + plain.coulomb_feedforward
            * float(np.tanh(own.velocity_rad_s / plain.coulomb_smoothing_rad_s))
            + plain.offset_feedforward
        )
        reference = np.repeat(np.array(own)[:, None], 2, axis=1)
        assert law.effort(reference, np.full((2, 1), position))[0, 0] == wanted


# ---- on


@pytest.mark.parametrize("seed", SEEDS)
def test_all_terms_together_are_the_documented_ones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gains, way, other = drawn_gains(rng), drawn_way(rng), drawn_way(rng)
    z = b = 0.0
    last, wanted = way.position_rad[0], []
    for own, by in zip(rows(way), rows(other), strict=True):
        z, b = stepped(gains, z, b, own.position_rad - last)
        last = own.position_rad
        total = documented_feedforward(gains, own, by, z, b)
        wanted.append(total + gains.deadband_inverse * math.tanh(total / gains.deadband_smoothing))
    found, memory = exact_effort_nm(gains, way, other)
    np.testing.assert_allclose(found, wanted, atol=1e-9)
    np.testing.assert_allclose(memory, (z, b), atol=1e-12)


TERMS = {
    "friction curve": {
        "friction_forward": tuple(0.1 * k for k in range(12)),
        "friction_backward": tuple(0.5 - 0.1 * k for k in range(12)),
        "friction_top_speed_rad_s": 2.0,
    },
    "load table": {"load_table": tuple(math.sin(k) for k in range(24)), "table_step_rad": 0.1},
    "local friction": {
        "local_friction_table": tuple(math.cos(k) for k in range(24)),
        "table_step_rad": 0.1,
        "table_start_rad": -1.2,
    },
    "fading table": {
        "load_table": (1.0,) * 24,
        "table_start_rad": -10.0,
        "table_fade_speed_rad_s": 0.5,
    },
    "fading ripple": {
        "ripple_cosine": (1.0, 0.0, 0.5, 0.0),
        "ripple_sine": (0.0, 0.0, 0.5, 0.25),
        "ripple_fade_speed_rad_s": (0.5, 0.0, 1.0, 0.0),
    },
    "cross": {
        "cross_inertia_feedforward": -0.2,
        "cross_viscous_feedforward": 0.3,
        "cross_coulomb_feedforward": -0.4,
    },
    "transmission": {
        "transmission_loss": 0.6,
        "transmitted_inertia": 0.3,
        "transmitted_friction": 0.5,
        "viscous_feedforward": 0.7,
        "coulomb_feedforward": 0.9,
        "offset_feedforward": -0.4,
    },
}


@pytest.mark.parametrize("term", TERMS)
def test_each_term_alone_is_the_documented_one(term: str) -> None:
    gains = replace(NEUTRAL, **TERMS[term])  # type: ignore[arg-type]
    rng = np.random.default_rng(2)
    for own, by in zip(rows(drawn_way(rng)), rows(drawn_way(rng)), strict=True):
        assert effort(gains, own, by) == pytest.approx(
            documented_feedforward(gains, own, by, 0.0, 0.0), abs=1e-12
        )


def test_without_the_other_axis_cross_terms_are_left_out() -> None:
    gains = replace(NEUTRAL, **TERMS["cross"])  # type: ignore[arg-type]
    assert feedforward_nm(gains, Setpoint(1.0, 2.0, 3.0)) == 0.0


def test_the_transmission_takes_more_where_it_drives_and_less_where_it_is_driven() -> None:
    """At full speed, of 1 N*m that passes with a loss of a half."""
    gains = replace(NEUTRAL, offset_feedforward=1.0, transmission_loss=0.5)
    assert effort(gains, Setpoint(0.0, 9.0, 0.0)) == pytest.approx(2.0)
    assert effort(gains, Setpoint(0.0, -9.0, 0.0)) == pytest.approx(1.0 / 1.5)


def test_the_inverse_of_the_dead_band_acts_on_the_whole_effort_and_within_the_limit() -> None:
    gains = replace(NEUTRAL, proportional=10.0, deadband_inverse=0.5, deadband_smoothing=0.1)
    law = AxisController(gains, PERIOD_S, 12.0)
    found = law.effort_nm(Setpoint(0.05, 0.0, 0.0), 0.0)
    assert found == pytest.approx(0.5 + 0.5 * math.tanh(5.0))
    assert law.effort_nm(Setpoint(1.18, 0.0, 0.0), 0.0) == 12.0


# ---- ranges


def jumps(gains: AxisGains, column: int, values: np.ndarray) -> np.ndarray:
    """Differences of the effort along position or velocity, the rest moving forward."""
    setpoint = [np.full(len(values), 0.5), np.full(len(values), 0.5), np.zeros(len(values))]
    setpoint[column] = values
    return np.abs(np.diff(feedforward_nm(gains, Reference(*setpoint), np)))


@pytest.mark.parametrize("table", ["load_table", "local_friction_table"])
def test_tables_over_position_end_without_a_jump_and_act_nowhere_beyond(table: str) -> None:
    gains = replace(NEUTRAL, table_start_rad=-1.0, table_step_rad=0.1, **{table: (3.0,) * 24})
    for beyond in (-1.1, -1.2, -50.0, 1.4, 1.5, 50.0):
        assert effort(gains, Setpoint(beyond, 1.0, 0.0)) == pytest.approx(0.0, abs=1e-12)
    assert effort(gains, Setpoint(-1.05, 9.0, 0.0)) == pytest.approx(1.5)
    assert effort(gains, Setpoint(1.35, 9.0, 0.0)) == pytest.approx(1.5)
    fine = np.linspace(-2.0, 2.0, 40_001)
    assert jumps(gains, 0, fine).max() <= 3.0 / 0.1 * 1.0001e-4


def test_the_friction_curve_ends_without_a_jump_and_acts_nowhere_beyond() -> None:
    top = 0.8
    gains = replace(
        NEUTRAL,
        friction_top_speed_rad_s=top,
        friction_forward=(3.0,) * 12,
        friction_backward=(-2.0,) * 12,
    )
    end = top * (12.0 / 11.0) ** 2
    for beyond in (end, -end, 2.0, -2.0, 100.0):
        assert effort(gains, Setpoint(0.0, beyond, 0.0)) == pytest.approx(0.0, abs=1e-9)
    assert effort(gains, Setpoint(0.0, top, 0.0)) == pytest.approx(3.0)
    assert effort(gains, Setpoint(0.0, -top, 0.0)) == pytest.approx(2.0)
    fine = np.linspace(-1.5, 1.5, 30_001)
    assert jumps(gains, 1, fine).max() <= 3.0 * 1.0001e-4 * (1.0 / 0.05 + 11.0 / top)


@pytest.mark.parametrize(
    "fading",
    [
        {"load_table": (3.0,) * 24, "table_fade_speed_rad_s": 0.5},
        {"ripple_cosine": (0.0, 3.0, 0.0, 0.0), "ripple_fade_speed_rad_s": (0.0, 0.5, 0.0, 0.0)},
    ],
    ids=["table", "ripple"],
)
def test_what_fades_with_speed_is_whole_up_to_it_and_gone_at_twice_it(
    fading: dict[str, object],
) -> None:
    gains = replace(NEUTRAL, **fading)  # type: ignore[arg-type]
    found = [effort(gains, Setpoint(0.0, v, 0.0)) for v in (0.0, 0.5, -0.5, 0.75, 1.0, -1.0, 9.0)]
    assert found == [3.0, 3.0, 3.0, 1.5, 0.0, 0.0, 0.0]
    assert jumps(gains, 1, np.linspace(-2.0, 2.0, 40_001)).max() <= 3.0 / 0.5 * 1.0001e-4


# ---- memory


def test_presliding_builds_up_over_its_distance_and_turns_over_after_a_reversal() -> None:
    gains = replace(NEUTRAL, presliding_feedforward=2.0, presliding_distance_rad=0.01)
    forward = Memory().after(gains, 0.01)
    assert forward.presliding == pytest.approx(1.0 - math.exp(-1.0))
    assert forward.after(gains, 0.0) == forward
    full = forward.after(gains, 1.0)
    assert full.presliding == pytest.approx(1.0)
    assert full.after(gains, -0.01).presliding == pytest.approx(-1.0 + 2.0 * math.exp(-1.0))
    assert feedforward_nm(gains, AT_REST, memory=full) == pytest.approx(2.0)


def test_the_law_follows_the_reference_and_the_backlash() -> None:
    gains = replace(
        NEUTRAL, proportional=10.0, backlash_offset_rad=0.02, backlash_distance_rad=0.001
    )
    law = AxisController(gains, PERIOD_S, 12.0)
    law.reset(0.0)
    assert law.effort_nm(Setpoint(0.1, 0.0, 0.0), 0.1) == pytest.approx(10.0 * 0.02)
    assert law.effort_nm(Setpoint(0.05, 0.0, 0.0), 0.05) == pytest.approx(-10.0 * 0.02)
    law.exchange(gains, 0.05)
    assert law.effort_nm(Setpoint(0.05, 0.0, 0.0), 0.05) == 0.0


@pytest.mark.parametrize("seed", SEEDS)
def test_a_stretch_is_the_same_as_its_samples_and_its_parts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gains, way = drawn_gains(rng), drawn_way(rng).position_rad
    way[200:300] = way[200]
    memory, z = NOTHING, []
    for before, after in zip(way[:-1].tolist(), way[1:].tolist(), strict=True):
        memory = memory.after(gains, after - before)
        z.append(memory)
    whole = NOTHING.along(gains, way)
    np.testing.assert_allclose(np.transpose(whole), z, atol=1e-12)
    first = NOTHING.along(gains, way[:700])
    np.testing.assert_allclose(first.last.along(gains, way[699:]).last, memory, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_simulated_drives_are_commanded_as_by_the_board(seed: int) -> None:
    rng = np.random.default_rng(seed)
    drives = [drawn_gains(rng) for _ in range(3)]
    ways = [drawn_way(rng, 1.0), drawn_way(rng, 1.0)]
    start = [float(way.position_rad[0]) for way in ways]
    position = np.tile(np.array(start)[:, None], 3)
    together = Controllers({"x": drives, "z": [drives[0]]}, PERIOD_S, position)
    single = [AxisController(gains, PERIOD_S, 1e12) for gains in drives]
    for law in single:
        law.reset(start[0])
    for own, other in zip(*map(rows, ways), strict=True):
        read = position + rng.normal(scale=0.01, size=(2, 3))
        found = together.effort(np.array([own, other]).T, read)
        wanted = [
            law.effort_nm(own, float(p), other) for law, p in zip(single, read[0], strict=True)
        ]
        np.testing.assert_allclose(found[0], wanted, rtol=1e-9, atol=1e-9)

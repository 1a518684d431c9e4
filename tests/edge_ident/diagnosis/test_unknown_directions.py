"""What an axis does while nobody knows whereto it slides must not reach the fit, and no more than
that may be left out."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.bandwidth import tapered, unknown_directions
from edge_ident.identification.identify import identify
from edge_ident.model.effects import named
from edge_ident.model.motion import Motion
from edge_ident.signals.recording import AxisRecord, Recording

Array = NDArray[np.float64]

PERIOD_S = 2.5e-3
COUNT = 7.5e-4
NOISE = COUNT / np.sqrt(12.0)
CUTOFF_HZ = 6.0
NO_TURNS = np.array([], int)


def counted(position: Array) -> Array:
    return COUNT * np.round(position / COUNT)


def test_turning_points_and_standstills_are_undecided_and_slow_creep_is_not() -> None:
    time = PERIOD_S * np.arange(4000)
    parabola = 0.25 * (time[:800] - 1.0) ** 2
    creep = parabola[-1] + 30.0 * COUNT * np.arange(1, 1601) * PERIOD_S
    stop = np.full(1600, creep[-1])
    position = counted(np.concatenate([parabola, creep, stop]))
    unknown, _ = unknown_directions(position, NO_TURNS, NOISE, 0.0, CUTOFF_HZ, PERIOD_S)
    near = np.abs(position - position[400]) <= 8.0 * NOISE
    assert np.array_equal(np.flatnonzero(unknown[:800]), np.flatnonzero(near[:800]))
    assert not unknown[830:2360].any(), "30 counts a second"
    assert unknown[2400:3990].all()


def test_a_short_rest_before_the_axis_moves_on_as_before_is_undecided() -> None:
    """It returns from nowhere, and it rests for less than half a cut-off period."""
    time = PERIOD_S * np.arange(-400, 400)
    position = counted(0.25 * time**3)
    _, unknown = unknown_directions(position, np.array([400]), NOISE, 0.0, CUTOFF_HZ, PERIOD_S)
    near = np.abs(position - position[400]) <= 8.0 * NOISE
    assert unknown[near].all()
    assert not unknown[np.abs(position) > 0.01].any()
    away, _ = unknown_directions(position + time, NO_TURNS, NOISE, 0.0, CUTOFF_HZ, PERIOD_S)
    assert not away.any()


def test_what_is_unknown_fades_out_and_in() -> None:
    mask = np.zeros(400, dtype=np.bool_)
    mask[200:210] = True
    faded = tapered(mask, 20.0)
    assert np.all(faded[200:210] == pytest.approx(1.0))
    assert np.all(faded[:155] == 0.0)
    assert np.all(faded[255:] == 0.0)
    assert np.max(np.abs(np.diff(faded))) < 0.06


@pytest.mark.parametrize("held", [-0.9, 0.0, 0.9])
def test_friction_may_do_what_it_likes_while_the_axis_stands(held: float) -> None:
    """A drive rests between its moves; its friction holds it with any part of its level."""
    rng = np.random.default_rng(3)
    samples, rest = 1200, 300
    angle = np.linspace(0.0, 2.0 * np.pi, samples, endpoint=False)
    speeds = [np.append(s * (1.0 - np.cos(angle)), np.zeros(rest)) for s in (0.9, -0.6, 0.5, -1.1)]
    v = np.tile(np.concatenate(speeds), 2)
    a = np.gradient(v, PERIOD_S)
    x = PERIOD_S * (np.cumsum(v) - 0.5 * v)
    level = np.where(v == 0.0, held, np.sign(v))
    effort = 0.4 * a + 0.8 * v + 1.5 * level + 0.2 + 0.02 * rng.standard_normal(len(v))
    time = PERIOD_S * np.arange(len(v))
    record = Recording(time, {"x": AxisRecord(counted(x), effort, "rad", "N*m")}, "by hand")
    axis = diagnose([record]).axes["x"]
    assert axis.verdict is Verdict.ADEQUATE
    assert axis.base.estimate.parameters == pytest.approx([0.4, 0.8, 1.5, 0.2], rel=0.03)


def test_a_load_behind_play_is_carried_in_step() -> None:
    """Away from reversals it is part of the axis: play adds nothing there, no delay either."""
    time = 5e-3 * np.arange(2000)
    rate = 2.0 * np.pi * 0.8
    x, v, a = np.sin(rate * time), rate * np.cos(rate * time), -(rate**2) * np.sin(rate * time)
    one = {
        "gap": 0.01,
        "load_inertia": 0.3,
        "deceleration": 4.0,
        "damping_rate": 1.0,
        "weight": 0.5,
        "contact_rate": 300.0,
    }
    values = {name: np.array([[value]]) for name, value in one.items()}
    added = named("backlash").resistance(Motion.known(time, x, v, a), values).ravel()
    pushed = (v * a > 0.0) & (np.abs(v) > 0.5 * rate) & (time > 2.0)
    half_a_sample = 0.5 * 5e-3 * 0.3 * rate**3
    assert np.count_nonzero(pushed) > 100
    assert np.median(np.abs(added[pushed])) < 0.25 * half_a_sample


def moved_and_held() -> Recording:
    """Moves of several lengths and speeds. While the controller holds a place, the axis creeps on
    by little, and friction is less and less of what it is in motion."""
    rng = np.random.default_rng(5)
    pieces, held = [np.zeros(1)], [np.zeros(1, np.bool_)]
    for k in range(14):
        move, rest = (int(seconds / 1e-3) for seconds in (rng.uniform(0.3, 0.9), 0.6))
        s, creep = np.arange(1, move + 1) / move, 2e-3 * np.arange(1, rest + 1) * 1e-3
        way = (-1.0) ** k * rng.uniform(0.3, 1.0)
        pieces.append(pieces[-1][-1] + way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2))
        pieces.append(pieces[-1][-1] + np.copysign(creep, way))
        held += [np.zeros(move, np.bool_), np.ones(rest, np.bool_)]
    position, still = np.concatenate(pieces), np.concatenate(held)
    velocity = np.gradient(position, 1e-3)
    friction = 1.1 * np.sign(velocity)
    begins = np.maximum.accumulate(np.where(still, 0, np.arange(len(still))))
    friction *= np.where(still, np.exp(-(np.arange(len(still)) - begins) / 200.0), 1.0)
    effort = 0.2 * np.gradient(velocity, 1e-3) + 0.8 * velocity + friction + 0.1
    effort += 0.02 * rng.standard_normal(len(effort))
    read = np.round(position / 1e-6) * 1e-6
    return Recording(1e-3 * np.arange(len(read)), {"x": AxisRecord(read, effort, "m", "N")}, "held")


def test_what_holds_a_creeping_axis_is_no_friction_of_its_motion() -> None:
    record = moved_and_held()
    assert diagnose([record]).axes["x"].verdict is Verdict.ADEQUATE
    found = identify(record).axes["x"]
    assert found.trusted
    assert found.estimate.parameters == pytest.approx([0.2, 0.8, 1.1, 0.1], rel=0.02)

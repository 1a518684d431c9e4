"""The axis as it is, from all of its motions: a line, and what repeats where something does."""

from dataclasses import replace

import numpy as np
import pytest

import edge_ident
from edge_ident.identification.effective import _SPEED, _Rows, effective_axis
from edge_ident.signals.recording import Recording


@pytest.fixture(scope="module")
def motions() -> tuple[Recording, Recording]:
    return edge_ident.simulate(), edge_ident.simulate(motion="multisine")


def with_more(recording: Recording, load: float, friction: float) -> Recording:
    """The same with a wave over the stroke, in the load and in the friction of axis x."""
    x = recording.axes["x"]
    direction = np.tanh(np.gradient(x.position, recording.time_s) / 0.02)
    wave = np.sin(2.0 * np.pi * x.position / 6.0)
    more = replace(x, effort=x.effort + load * wave + friction * wave * direction)
    return replace(recording, axes={**recording.axes, "x": more})


def sticking(recording: Recording, friction: float, reach: float) -> Recording:
    """The same with friction that gives way by `reach` at reversals before it slides."""
    x = recording.axes["x"]
    wound = np.empty(len(x.position))
    state = 0.0
    for k, step in enumerate(np.diff(x.position, prepend=x.position[0])):
        state = min(max(state + step / reach, -1.0), 1.0)
        wound[k] = state
    more = replace(x, effort=x.effort + friction * wound)
    return replace(recording, axes={**recording.axes, "x": more})


@pytest.mark.parametrize("reach", [0.01, 0.05])
def test_what_sticks_at_reversals_says_nothing_of_slow_moves(
    motions: tuple[Recording, Recording], reach: float
) -> None:
    """Samples are slow near reversals alone: of 4.4 N·m of friction 0.4 were left for slow moves,
    and a third of the inertia was gone."""
    found = effective_axis([with_more(sticking(m, 3.0, reach), 0.3, 0.0) for m in motions], "x")
    inertia, _, coulomb, offset = found.model.parameters
    assert inertia == pytest.approx(0.43, rel=0.15)
    assert found.repeating is not None
    at, still = np.zeros(4), np.array([0.005, 0.02, 0.05, 0.1])
    for way in (1.0, -1.0):
        more = found.repeating.effort(at, way * still, np.full(4, way))
        assert way * (more + offset) + coulomb == pytest.approx(np.full(4, 4.4), rel=0.2)


def test_the_line_has_what_a_line_can_have(motions: tuple[Recording, Recording]) -> None:
    rows = _Rows.of(motions, "x", (), 0.0)
    rng = np.random.default_rng(3)
    numbers = rng.standard_normal((2, rows.columns.shape[1]))
    numbers[:, _SPEED] *= np.any(rows.columns[:, _SPEED], axis=0)
    moved = rows.with_all_in_line(numbers)
    over_speed = rows.columns[:, _SPEED] @ moved[:, _SPEED].T
    line = np.linalg.lstsq(rows.columns[:, 1:4], over_speed, rcond=None)[0]
    assert np.all(np.abs(line) < 0.02)
    before, after = (rows.columns @ each.T for each in (numbers, moved))
    assert np.std(after - before) < 0.02 * np.std(before)


def test_nothing_repeats_on_a_machine_that_is_a_rigid_body(
    motions: tuple[Recording, Recording],
) -> None:
    found = effective_axis(motions, "x")
    assert found.repeating is None
    inertia, viscous, coulomb, _ = found.model.parameters
    assert (inertia, viscous, coulomb) == pytest.approx((0.43, 0.90, 1.40), rel=0.02)
    assert found.spread.shape[1] == 4


def test_one_sinusoid_with_a_spring_does_not_hide_the_inertia_from_two_motions(
    motions: tuple[Recording, Recording],
) -> None:
    spring = [
        replace(m, axes={"x": replace(a, effort=a.effort + 0.05 * a.position)})
        for m in motions
        for a in (m.axes["x"],)
    ]
    alone, both = (effective_axis(some, "x").model for some in (spring[:1], spring))
    assert alone.parameters[0] < 0.2  # an acceleration of 0.083 per rad
    assert both.parameters[0] == pytest.approx(0.43, rel=0.05)
    assert both.terms[0].std["inertia"] < 0.05


def test_what_repeats_is_found_and_its_entries_are_the_wave(
    motions: tuple[Recording, Recording],
) -> None:
    found = effective_axis([with_more(motion, 0.3, 0.0) for motion in motions], "x")
    assert found.repeating is not None
    at = np.linspace(-4.0, 4.0, 50)
    still, forward = np.full(50, 0.5), np.ones(50)
    both = [found.repeating.effort(at, way * still, way * forward) for way in (1.0, -1.0)]
    load = 0.5 * (both[0] + both[1])
    wave = 0.3 * np.sin(2.0 * np.pi * at / 6.0)
    assert np.std(load - np.mean(load) - wave) < 0.3 * np.std(wave)


def test_friction_that_differs_between_two_motions_is_known_to_drift(
    motions: tuple[Recording, Recording],
) -> None:
    first, second = motions
    x = second.axes["x"]
    direction = np.tanh(np.gradient(x.position, second.time_s) / 0.02)
    warm = replace(second, axes={"x": replace(x, effort=x.effort - 0.2 * direction)})
    coulomb, offset = effective_axis([first, warm], "x").drift
    assert 0.03 < coulomb < 0.3
    assert offset < 0.03
    assert not effective_axis([first], "x").drift.any()

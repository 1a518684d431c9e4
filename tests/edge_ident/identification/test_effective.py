"""The axis as it is, from all of its motions: a line, and what repeats where something does."""

from dataclasses import replace

import numpy as np
import pytest

import edge_ident
from edge_ident.identification.effective import effective_axis
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

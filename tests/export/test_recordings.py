"""Recordings to train on: what effects add, beside a motion that is seen through an encoder."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from edge_ident.estimation.image import effort_scale
from edge_ident.model.effect import Scale
from edge_ident.model.effects import catalogue
from edge_ident.model.model import Term
from export import recordings
from export.drives import efforts
from export.motion import paper_motion
from export.recordings import Recordings, make_recordings

PAPER = paper_motion()
POINTS = 60
Draw = Callable[[Scale], dict[str, np.ndarray]]


def make(motions: int = 2, drives: int = 2, largest_lag: float = 0.08) -> Recordings:
    motion, rng = replace(PAPER, largest_lag=largest_lag), np.random.default_rng(1)
    return make_recordings(motion, POINTS, rng, motions=motions, drives=drives)


@pytest.fixture(scope="module")
def made() -> Recordings:
    """Every effect of the catalogue, on motions without lag."""
    return make(largest_lag=0.0)


def with_one_effect(monkeypatch: pytest.MonkeyPatch, name: str, draw: Draw) -> Recordings:
    """Recordings in which the catalogue holds one effect, its values drawn by the test."""

    def term(name: str, rng: object, scale: Scale, source_axis: str) -> Term:
        source = source_axis if catalogue()[name].needs_source else None
        return Term(name, draw(scale), source_axis=source)

    monkeypatch.setattr(recordings, "catalogue", lambda: {name: catalogue()[name]})
    monkeypatch.setattr(recordings, "random_term", term)
    return make()


def test_without_effects_nothing_is_added() -> None:
    made = make(motions=3, drives=0)
    assert made.effects == ()
    assert made.parameters.shape == (3, 0, 0, 4)
    assert made.added.shape == (3, 0, 0, POINTS)
    assert made.measured.shape == made.true.shape == (3, POINTS, 4)


def test_every_effect_of_the_catalogue_adds_something_finite(made: Recordings) -> None:
    assert made.effects == tuple(catalogue())
    assert made.added.shape == (2, len(catalogue()), 2, POINTS)
    assert np.all(np.isfinite(made.added))
    assert np.all(np.max(np.abs(made.added), axis=-1) > 0.0)
    # up to three tenths of the effort by most
    assert 0.02 < np.median(effort_scale(made.added, "effort-scale")) < 0.3


def test_drives_with_effects_have_base_efforts_of_scale_one(made: Recordings) -> None:
    shares = made.parameters.reshape(2, -1, 4)
    for columns, drives in zip(made.true, shares, strict=True):
        scale = effort_scale(efforts(columns, drives), "effort-scale")
        np.testing.assert_allclose(scale, 1.0, atol=0.03)  # some of the step at reversals is lost
    assert np.all(made.parameters[..., :3] > 0.0)


def test_what_an_effect_adds_is_beside_the_base_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """Viscous friction to the power of one is more viscous friction, through the same filter."""
    made = with_one_effect(
        monkeypatch,
        "nonlinear_viscous",
        lambda scale: {
            "level": 0.25 * scale.viscous_friction,
            "exponent": np.ones_like(scale.inertia),
        },
    )
    more = 0.25 * made.parameters[:, 0, :, 1:2] * made.true[:, None, :, 1]
    np.testing.assert_allclose(made.added[:, 0], more, atol=2e-4)


def test_the_other_axis_acts_with_its_own_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    def carried(scale: Scale) -> dict[str, np.ndarray]:
        none = np.zeros_like(scale.inertia)
        return {"inertia": scale.inertia, "viscous_friction": none, "coulomb_friction": none}

    made = with_one_effect(monkeypatch, "cross_axis_coupling", carried)
    # a quarter of a period ahead of this axis's acceleration, -sin: the middles of 60 intervals
    angle = 2.0 * np.pi * (np.arange(POINTS) + 0.5) / POINTS
    inertia = made.parameters[:, 0, :, :1]
    np.testing.assert_allclose(
        made.added[:, 0] / inertia, -np.cos(angle) + 0.0 * inertia, atol=0.05
    )


def test_effects_that_need_another_axis_are_left_out_where_there_is_none() -> None:
    alone = replace(PAPER, partner=None)
    made = make_recordings(alone, POINTS, np.random.default_rng(1), motions=1, drives=1)
    assert set(catalogue()) - set(made.effects) == {
        name for name, effect in catalogue().items() if effect.needs_source
    }


def test_the_encoder_spoils_the_acceleration_a_little_and_no_more() -> None:
    made = make(motions=6, drives=0)
    noise = np.std(made.measured[..., 0] - made.true[..., 0]) / np.std(made.true[..., 0])
    assert 0.005 < noise < 0.1
    assert np.max(np.abs(made.measured[..., 1] - made.true[..., 1])) < 0.02


def test_lag_shows_at_the_reversals_alone() -> None:
    prompt, late = (
        make(motions=8, drives=0, largest_lag=lag).measured[..., 2] for lag in (1e-9, 0.08)
    )
    difference = np.max(np.abs(late - prompt), axis=0)
    reversals = np.r_[13:21, 43:51]
    assert np.max(difference[reversals]) > 0.3
    assert np.max(np.delete(difference, reversals)) < 0.15


def test_the_generator_alone_decides_and_progress_is_told() -> None:
    seen: list[tuple[int, int]] = []
    first, again, other = (
        make_recordings(
            PAPER,
            POINTS,
            np.random.default_rng(seed),
            motions=2,
            drives=0,
            on_progress=lambda *at: seen.append(at),
        )
        for seed in (5, 5, 6)
    )
    np.testing.assert_array_equal(first.measured, again.measured)
    assert not np.array_equal(first.measured, other.measured)
    assert seen == 3 * [(1, 2), (2, 2)]

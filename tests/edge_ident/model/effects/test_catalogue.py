"""The catalogue as a whole: what every effect's file must hold, and random strengths."""

import importlib
import math
from dataclasses import replace

import numpy as np
import pytest

from edge_ident.errors import ModelError
from edge_ident.model.effect import scale_of
from edge_ident.model.effects import catalogue, named, random_term
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.model.model_files import unit_of
from edge_ident.model.motion import Motion
from firmware_interface.plant import EFFECTS

DRIVES = 60
NAMES = sorted(catalogue())


def multisine(shift: float) -> Motion:
    """20 s with accelerations, such as show most effects."""
    time = 0.005 * np.arange(4000)
    parts = [
        (amplitude, rate, shift * rate + i)
        for i, (amplitude, rate) in enumerate([(2.0, 0.63), (0.9, 1.9), (0.3, 5.3), (0.1, 11.0)])
    ]
    return Motion.known(
        time,
        sum(a * np.sin(w * time + p) for a, w, p in parts),
        sum(a * w * np.cos(w * time + p) for a, w, p in parts),
        sum(-a * w * w * np.sin(w * time + p) for a, w, p in parts),
    )


MOTION, OTHER = multisine(0.0), multisine(0.4)


def random_drives() -> np.ndarray:
    rng = np.random.default_rng(3)
    low, high = [0.2, 0.3, 0.5, -0.3], [0.8, 2.0, 3.0, 0.3]
    return rng.uniform(low, high, (DRIVES, 4))


def drawn(name: str, seed: int = 0) -> tuple[AxisModel, np.ndarray]:
    """Drives with an effect at random strength, and the efforts that it adds (D, N)."""
    parameters = random_drives()
    m = MOTION
    scale = scale_of(parameters, m.time_s, m.position, m.velocity, m.acceleration)
    base = Term(BASE, dict(zip(PARAMETERS, parameters.T, strict=True)))
    axis = AxisModel((base, random_term(name, np.random.default_rng(seed), scale, "z")))
    added = inverse_effort(axis, m, {"z": OTHER}) - inverse_effort(AxisModel((base,)), m)
    return axis, added


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_is_tied_to_time_if_a_later_record_meets_another_effort(name: str) -> None:
    axis, added = drawn(name)
    later = replace(MOTION, time_s=MOTION.time_s + MOTION.time_s[-1])
    base = AxisModel(axis.terms[:1])
    then = inverse_effort(axis, later, {"z": OTHER}) - inverse_effort(base, later)
    # the impacts of a play follow rounding errors of the clock
    differs = np.sqrt(np.mean((then - added) ** 2)) > 0.05 * np.sqrt(np.mean(added**2))
    assert named(name).tied_to_time is bool(differs)


def test_the_independent_plant_knows_the_same_effects() -> None:
    # no axis of a feed drive turns another one, or moves more here than there; its encoders are on
    # the motors
    of_others = {
        "pose_dependent_inertia", "position_dependent_inertia", "noncollocated_compliance"
    }  # fmt: skip
    assert set(EFFECTS) == set(NAMES) - of_others


@pytest.mark.parametrize("name", NAMES)
def test_a_file_states_physics_source_and_bounded_parameters(name: str) -> None:
    text = importlib.import_module(f"edge_ident.model.effects.{name}").__doc__ or ""
    assert text.splitlines()[0].endswith(".")
    assert "\nSource: " in text
    for parameter in named(name).parameters:
        assert -math.inf < parameter.low < parameter.high < math.inf
        assert "{" not in unit_of(parameter, "m", "A")


@pytest.mark.parametrize("name", NAMES)
def test_random_strengths_are_physical_and_range_from_faint_to_strong(name: str) -> None:
    axis, added = drawn(name)
    for parameter in named(name).parameters:
        values = axis.terms[1].values[parameter.name]
        assert np.shape(values) == (DRIVES,)
        assert np.all((values >= parameter.low) & (values <= parameter.high))
    share = np.sqrt(
        np.mean(added**2, axis=1) / np.mean(inverse_effort(axis, MOTION, {"z": OTHER}) ** 2, axis=1)
    )
    assert np.all(np.isfinite(added))
    assert 0.002 < np.median(share) < 0.3
    assert np.percentile(share, 95) > 3 * np.percentile(share, 5)
    assert share.max() < 1.0


@pytest.mark.parametrize("name", NAMES)
def test_one_drive_of_many_is_that_drive_alone(name: str) -> None:
    axis, _ = drawn(name)
    together = inverse_effort(axis, MOTION, {"z": OTHER})
    terms = tuple(
        Term(t.effect, {k: float(v[7]) for k, v in t.values.items()}, source_axis=t.source_axis)
        for t in axis.terms
    )
    alone = inverse_effort(AxisModel(terms), MOTION, {"z": OTHER})
    np.testing.assert_allclose(alone, together[7], rtol=1e-9, atol=1e-9)


def test_strengths_follow_the_seed() -> None:
    first, again, other = (drawn("torque_ripple", seed)[1] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)


def test_an_unknown_effect_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ModelError, match="no effect 'wear'") as caught:
        named("wear")
    assert all(name in caught.value.next_step for name in NAMES)


def test_a_coupled_axis_without_its_partner_is_refused() -> None:
    values = {"inertia": 0.1, "viscous_friction": 0.0, "coulomb_friction": 0.0}
    base = Term(BASE, dict(zip(PARAMETERS, (0.4, 0.9, 1.4, 0.1), strict=True)))
    axis = AxisModel((base, Term("cross_axis_coupling", values, source_axis="z")))
    with pytest.raises(ModelError, match="needs the motion of axis z"):
        inverse_effort(axis, MOTION)

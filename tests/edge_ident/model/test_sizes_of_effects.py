"""Sizes that no machine has are no causes, however well they fit."""

import numpy as np
import pytest

from edge_ident.model.effects import catalogue, named
from edge_ident.model.search import Excitation, Span

EXCITATION = Excitation(
    lowest=-3.0,
    travel=6.0,
    speed=2.0,
    typical_speed=1.0,
    acceleration=4.0,
    effort=8.0,
    resolution=1e-5,
    duration_s=20.0,
    cutoff_hz=8.0,
    sampling_s=1e-3,
    base=np.array([0.5, 1.0, 1.0, 0.1]),
    spans=(Span(0, 0.0, 20.0),),
)


def eccentric(degrees: float) -> dict[str, np.ndarray]:
    turn = 2.0 * np.pi
    return {"cosine": np.radians([degrees]), "sine": np.zeros(1), "period": np.array([turn])}


@pytest.mark.parametrize(("degrees", "possible"), [(0.3, True), (3.0, True), (4.8, False)])
def test_an_encoder_is_not_off_its_centre_by_degrees(degrees: float, possible: bool) -> None:
    search = named("encoder_eccentricity").search
    assert search.possible(eccentric(degrees), EXCITATION) is possible


def test_a_size_counts_in_units_of_its_machine() -> None:
    """The drive could have moved 8 N·m over 4 rad/s²."""
    search = named("coupling_compliance").search
    sizes = [search.possible({"load_inertia": np.array([x])}, EXCITATION) for x in (1.9, 2.1)]
    assert sizes == [True, False]


def test_sizes_are_of_parameters_that_an_effect_has() -> None:
    for effect in catalogue().values():
        for largest in effect.search.largest:
            assert set(largest.parameters) <= {p.name for p in effect.parameters}

"""Values that a recording allows, and those that no machine has."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.model.effects import named
from edge_ident.model.search import Excitation, Span

EXCITATION = Excitation(
    lowest=-1.5,
    travel=3.0,
    speed=2.0,
    typical_speed=1.0,
    acceleration=3.0,
    effort=5.0,
    resolution=1e-3,
    duration_s=20.0,
    cutoff_hz=6.0,
    sampling_s=0.0025,
    base=np.array([0.4, 0.9, 1.4, 0.0]),
    spans=(Span(0, 0.0, 20.0),),
)


@pytest.mark.parametrize(
    ("amplitude", "allowed"), [(1e-5, False), (0.01, True), (0.062, True), (0.064, False)]
)
def test_an_eccentric_encoder_reads_more_than_a_trace_and_less_than_a_hundredth_of_a_turn(
    amplitude: float, allowed: bool
) -> None:
    values = {"cosine": 0.6 * amplitude, "sine": 0.8 * amplitude, "period": 2.0 * np.pi}
    arrays = {name: np.array([value]) for name, value in values.items()}
    assert named("encoder_eccentricity").search.possible(arrays, EXCITATION) is allowed


def test_however_fast_an_axis_is_there_are_places_to_try() -> None:
    """A narrow band passes nothing that is as narrow as a third of the travel."""
    fast = replace(EXCITATION, typical_speed=100.0)
    assert set(fast.places()["width"]) == {0.32 * fast.travel}
    assert len(set(EXCITATION.places()["width"])) > 1

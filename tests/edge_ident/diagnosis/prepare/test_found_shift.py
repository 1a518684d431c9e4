"""The shift that the diagnosis finds, without one and with a ripple that is known."""

import numpy as np
import pytest

from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.prepare.timing import whole_shift
from edge_ident.drive.motions import MotionName
from edge_ident.model.effects.torque_ripple import EFFECT as RIPPLE
from edge_ident.model.model import AxisModel, Term
from edge_ident.simulation.simulate import reduced_model, simulate
from tests.edge_ident.diagnosis.select.test_search_parts import (
    PERIOD_S,
    TEMPLATE,
    recorded,
    rigid,
    swing,
)
from tests.repetitions import a_few


@pytest.mark.parametrize("motion", a_few(["sinusoid", "multisine", "staircase"], ["sinusoid"]))
def test_a_rigid_drive_without_noise_is_in_step(motion: MotionName) -> None:
    """In closed loop, with the rounding of encoder and effort; the shift is that of the board.

    Effort and motion fade with the same weight at unknown directions, or a shift of up to a sample
    appears, nine standard deviations.
    """
    recording = simulate(reduced_model(), motion)
    for name in ("x", "z"):
        (segment,) = prepare_axis([recording], name).segments
        found = whole_shift(segment, TEMPLATE)
        assert abs(found.shift_s) < 3.0 * found.std_s, name
        if motion != "sinusoid":
            assert abs(found.shift_s) < 0.1 * segment.raw_period_s, name


@pytest.mark.parametrize("moved", [-1.5, -0.5, 0.0, 0.5, 1.5])
def test_a_known_ripple_is_late_as_well(moved: float) -> None:
    """Two fifths of the effort, and most of its rate: wherever the effort was moved to before, and
    although the ripple is known as it looks there, the same shift is found at once."""
    t, x, v, a = swing()
    ripple = {"cosine": 0.9, "sine": 0.0, "period": 0.3}
    effort = rigid(v, a) + ripple["cosine"] * np.cos(2.0 * np.pi / ripple["period"] * x)
    late = np.interp(t - 0.4 * PERIOD_S, t, effort)
    (segment,) = prepare_axis([recorded(t, x, late, noise=0.01)], "x").segments
    known = AxisModel((*TEMPLATE.terms, Term(RIPPLE.name, ripple)))
    found = whole_shift(segment.in_step(moved * PERIOD_S), known)
    assert found.shift_s / PERIOD_S == pytest.approx(0.4, abs=0.1)

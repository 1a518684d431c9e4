"""The shift that the diagnosis finds in a recording without one."""

import numpy as np
import pytest

from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.prepare.timing import whole_shift
from edge_ident.drive.motions import MotionName
from edge_ident.simulation.flexible import reduced_model
from edge_ident.simulation.simulate import simulate
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
        found = whole_shift(segment, np.zeros(len(segment.sample_index)))
        assert abs(found.shift_s) < 3.0 * found.std_s, name
        if motion != "sinusoid":
            assert abs(found.shift_s) < 0.1 * segment.raw_period_s, name

"""What a diagnosis says of the shift between effort and motion, of what is minor, and of what a
plan can show."""

from dataclasses import replace

import pytest

from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import NotTestable
from edge_ident.diagnosis.wording import can_be_planned, facts, timing_sentence, verdict_sentence
from edge_ident.model.motion import EVEN_SHIFT, NO_SHIFT, Timing
from tests.edge_ident.diagnosis import hand_made


@pytest.mark.parametrize(
    ("timing", "said"),
    [
        (Timing(0.00125, 0.5, 0.02), "late by 0.50 ± 0.02 samples (1.25 ms)"),
        (Timing(-0.00125, -0.5, 0.02), "early by 0.50"),
        (Timing(-1e-6, -4e-4, 0.006), "in step with the motion, ± 0.006 samples"),
        (Timing(0.0, 0.0, EVEN_SHIFT), "does not show"),
        (NO_SHIFT, "the delay in the model"),
    ],
)
def test_the_shift_is_said_in_words(timing: Timing, said: str) -> None:
    assert said in timing_sentence(timing)


def test_what_is_left_of_an_unexplained_axis_is_left_beside_what_is_minor() -> None:
    """A chain as stiff as a sound drive's, and something else."""
    axis = hand_made.axis(Verdict.UNEXPLAINED, hand_made.ripple())
    axis = replace(axis, minor=axis.causes, causes=(), noise_floor=0.002)
    assert verdict_sentence(axis) == "unexplained: no known effect fits beside torque ripple"
    assert facts(axis)[0].startswith("the residual falls from ")


@pytest.mark.parametrize(
    ("effect", "axes", "expected"),
    [
        ("backlash", 1, True),
        ("cross_axis_coupling", 2, True),
        ("cross_axis_coupling", 1, False),
        ("warm_up", 2, False),
    ],
)
def test_a_plan_is_advised_only_for_what_a_motion_of_these_axes_shows(
    effect: str, axes: int, expected: bool
) -> None:
    axis = next(iter(hand_made.diagnosis().axes.values()))
    missing = (NotTestable(effect, "not excited", "record another motion"),)
    assert can_be_planned(replace(axis, not_testable=missing), axes) is expected

"""The effort of one recording is late, and that of another is not."""

import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.signals.recording import AxisRecord, Recording
from tests.edge_ident.diagnosis.test_other_zero import arm
from tests.repetitions import a_few

PERIOD_S = 4e-3


def late(recording: Recording, samples: int) -> Recording:
    """The recording with its effort stamped so many samples late."""
    axis = recording.axes["x"]
    record = AxisRecord(axis.position[samples:], axis.effort[:-samples], "rad", "N*m")
    return Recording(recording.time_s[samples:], {"x": record}, recording.source)


@pytest.mark.parametrize("weight", a_few([0.0, 4.0], [4.0]))
def test_the_recording_that_is_late_is_named(weight: float) -> None:
    pair = [arm(1, weight=weight), late(arm(2, weight=weight), 5)]
    axis = diagnose(pair).axes["x"]
    (said,) = [each for each in axis.findings if each.code == "timing_differs"]
    assert not axis.verdict.complete
    assert said.message.startswith("the effort of 2.csv is 20")
    assert "ms later, beside its motion, than that of 1.csv" in said.message


def test_a_late_recording_that_judges_another_is_named() -> None:
    axis = diagnose([arm(1)], validate=late(arm(2), 5)).axes["x"]
    (said,) = [each for each in axis.findings if each.code == "timing_differs"]
    assert said.message.startswith("the effort of 2.csv is 20")
    assert not said.blocks


def test_recordings_that_are_late_alike_have_one_delay() -> None:
    axis = diagnose([late(arm(k), 5) for k in (1, 2)]).axes["x"]
    assert "timing_differs" not in {each.code for each in axis.findings}
    assert "time_delay" in [cause.term.effect for cause in axis.causes]

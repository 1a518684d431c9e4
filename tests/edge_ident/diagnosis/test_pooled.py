"""Recordings that no diagnosis may look at together are refused, by file and axis."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.pooled import check_pooled
from edge_ident.errors import DataError
from edge_ident.signals.recording import AxisRecord, Recording

TIME_S = 0.01 * np.arange(400)


def recording(source: str, *units: str, phase: float = 0.0, axis: str = "x") -> Recording:
    position, effort = np.sin(TIME_S + phase), np.cos(TIME_S + phase)
    return Recording(TIME_S, {axis: AxisRecord(position, effort, *units)}, source)


FIRST = recording("first", "rad", "N*m")


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (recording("other", "m", "N", phase=1.0), "axis x is in rad and N\\*m in first, and in m"),
        (recording("other", "rad", "N*m", phase=1.0, axis="y"), "other has axes y"),
        (replace(FIRST, source="copy"), "first and copy hold the same recording"),
    ],
)
def test_what_does_not_belong_together_is_refused(other: Recording, said: str) -> None:
    between = recording("between", "rad", "N*m", phase=2.0)
    with pytest.raises(DataError, match=said):
        check_pooled([FIRST, between, other])
    with pytest.raises(DataError, match=said):
        diagnose([FIRST], validate=other)


def test_one_axis_may_rest_as_it_did_before() -> None:
    rest = AxisRecord(np.sin(TIME_S), np.cos(TIME_S), "rad", "N*m")
    pair = [replace(each, axes={**each.axes, "z": rest}) for each in (
        FIRST, recording("other", "rad", "N*m", phase=1.0)
    )]  # fmt: skip
    check_pooled(pair)

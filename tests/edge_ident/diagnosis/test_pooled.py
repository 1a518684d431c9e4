"""Recordings that no diagnosis may look at together are refused, by file and axis."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.pooled import check_pooled
from edge_ident.errors import DataError
from edge_ident.identification.identify import identify
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


def test_what_is_not_there_cannot_be_diagnosed() -> None:
    with pytest.raises(DataError, match="no recording"):
        diagnose([])
    with pytest.raises(DataError, match="first has no axis y and z"):
        diagnose([FIRST], only=["x", "y", "z"])


@pytest.mark.parametrize("tolerance", [-0.01, np.nan, np.inf])
def test_a_senseless_tolerance_is_refused(tolerance: float) -> None:
    with pytest.raises(DataError, match="a tolerance of"):
        diagnose([FIRST], tolerance=tolerance)


@pytest.mark.parametrize("samples", [2, 24, 199])
def test_too_few_samples_are_refused(samples: int) -> None:
    axis = FIRST.axes["x"]
    few = AxisRecord(axis.position[:samples], axis.effort[:samples], *axis.units)
    short = Recording(TIME_S[:samples], {"x": few}, "short")
    for look in (lambda: diagnose([short]), lambda: identify(short)):
        with pytest.raises(DataError, match=f"short: {samples} samples are not enough"):
            look()


def test_one_axis_may_rest_as_it_did_before() -> None:
    rest = AxisRecord(np.sin(TIME_S), np.cos(TIME_S), "rad", "N*m")
    pair = [replace(each, axes={**each.axes, "z": rest}) for each in (
        FIRST, recording("other", "rad", "N*m", phase=1.0)
    )]  # fmt: skip
    check_pooled(pair)

"""Recordings that no diagnosis may look at together are refused, by file and axis."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.recording_checks import check_pooled
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
    with pytest.raises(DataError, match="tolerance is"):
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


def noisy(samples: int, *, seed: int, rest: int = 0) -> AxisRecord:
    """A coarse recording, of a motion that begins after a rest that is all the same."""
    angle, rng = 0.01 * np.maximum(np.arange(samples) - rest, 0), np.random.default_rng(seed)
    effort = np.cos(angle) + 0.01 * rng.standard_normal(samples)
    effort[:rest] = 0.0
    return AxisRecord(np.round(np.sin(angle), 2), np.round(effort, 2), "rad", "N*m")


def cut(axis: AxisRecord, begin: int, end: int, source: str) -> Recording:
    part = AxisRecord(axis.position[begin:end], axis.effort[begin:end], *axis.units)
    return Recording(0.01 * np.arange(end - begin), {"x": part}, source)


def test_pieces_that_overlap_are_no_two_recordings() -> None:
    axis = noisy(4000, seed=1)
    for pieces in (
        (cut(axis, 0, 2000, "head"), cut(axis, 1500, 4000, "tail")),
        (cut(axis, 1500, 4000, "tail"), cut(axis, 0, 2000, "head")),
        (cut(axis, 0, 4000, "head"), cut(axis, 1500, 2000, "tail")),
    ):
        with pytest.raises(DataError, match="500 rows are the same") as refused:
            check_pooled(pieces)
        assert "head, from 15 s on" in refused.value.cause
        assert "tail, from 0 s on" in refused.value.cause


def test_the_same_motion_and_the_same_rest_are_no_copy() -> None:
    check_pooled([cut(noisy(4000, seed=s, rest=2000), 0, 4000, str(s)) for s in (1, 2)])
    axis = noisy(4000, seed=1)
    check_pooled([cut(axis, 0, 2050, "head"), cut(axis, 1950, 4000, "tail")])

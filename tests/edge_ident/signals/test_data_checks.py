"""What a recording is refused for, and what looks like it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import edge_ident
from edge_ident.errors import DataError
from edge_ident.signals.data_checks import check_motions
from edge_ident.signals.recording import AxisRecord, Recording
from tests.test_bad_recordings import sound

TIME_S = 2e-3 * np.arange(4000)
SWING = 0.5 * np.cos(2.0 * np.pi * 0.5 * TIME_S)


def motion(first: int, last: int, value: float) -> Recording:
    """A motor under a smooth effort and a weight, of which some samples have another value."""
    effort = 3.0 + SWING + 0.01 * np.random.default_rng(1).standard_normal(len(SWING))
    effort[first:last] = value
    position = 1e-3 * np.round(1e3 * np.cumsum(np.cumsum(SWING)) * 4e-4)
    return Recording(TIME_S, {"x": AxisRecord(position, effort, "rad", "A")}, "by hand")


@pytest.mark.parametrize(("first", "last"), [(0, 1), (0, 2), (3999, 4000), (3998, 4000)])
def test_a_drive_that_is_switched_on_or_off_is_no_spike(first: int, last: int) -> None:
    check_motions(motion(first, last, 0.0))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_an_effort_that_rises_steeply_at_the_end_is_no_spike(count: int) -> None:
    cut = motion(0, 0, 0.0)
    cut.axes["x"].effort[-count:] += 4.0 * np.array([1.0, 2.5, 4.5])[:count]
    check_motions(cut)


@pytest.mark.parametrize("row", [1, 2000, 3998])
def test_a_spike_is_one_anywhere(row: int) -> None:
    with pytest.raises(DataError, match=f"row {row}: a spike"):
        check_motions(motion(row, row + 1, 40.0))


def test_many_spikes_are_no_usual_effort() -> None:
    """Where one sample of 150 was another value, that was what is usual, and a motor was said to
    saturate."""
    hit = motion(0, 0, 0.0)
    hit.axes["x"].effort[75::150] += 5.0
    with pytest.raises(DataError, match="27 in all"):
        check_motions(hit)


# A recording that is made in memory is checked where it is first used.

GOOD = sound()
USES: dict[str, Callable[[Recording], object]] = {
    "identify": edge_ident.identify,
    "diagnose": lambda recording: edge_ident.diagnose([recording]),
    "compare": lambda recording: edge_ident.compare(recording, methods=["least_squares"]),
    "simulate": lambda recording: edge_ident.simulate(motion=recording),
}


def with_gap(values: NDArray[np.float64], value: float) -> NDArray[np.float64]:
    changed = values.copy()
    changed[100] = value
    return changed


def made(**changed: Any) -> Recording:
    time_s = changed.pop("time_s", GOOD.time_s)
    axis = AxisRecord(GOOD.position, GOOD.effort, "rad", "N*m")
    return Recording(time_s, {"x": replace(axis, **changed)}, "memory")


BAD = {
    "effort missing": (made(effort=with_gap(GOOD.effort, np.nan)), "row 100, axis x, effort: not"),
    "position missing": (made(position=with_gap(GOOD.position, np.nan)), "axis x, position: not"),
    "infinite effort": (made(effort=with_gap(GOOD.effort, np.inf)), "axis x, effort: not a finite"),
    "speed missing": (made(velocity=with_gap(GOOD.effort, np.nan)), "axis x, velocity: not"),
    "time missing": (made(time_s=with_gap(GOOD.time_s, np.nan)), "row 100, time_s: not a finite"),
    "time goes back": (made(time_s=GOOD.time_s[::-1]), "row 1, time_s: time goes from"),
    "a list": (made(position=list(GOOD.position)), "axis x, position: a list, not a vector"),
    "times in a list": (made(time_s=list(GOOD.time_s)), "time_s: a list, not a vector"),
    "a matrix": (made(effort=GOOD.effort[:, None]), r"effort: an array of shape \(4000, 1\)"),
    "counts": (made(position=np.arange(4000)), "position: an array of .* type int64"),
    "too few efforts": (made(effort=GOOD.effort[:-1]), "effort: 3999 values, and 4000 time stamps"),
    "a short reference": (made(reference=GOOD.position[:-1]), "reference: 3999 values"),
    "degrees": (made(position_unit="deg"), "its position is in 'deg'"),
    "a unit's other spelling": (made(effort_unit="Nm"), "its effort is in 'Nm'"),
    "no axis": (Recording(GOOD.time_s, {}, "memory"), "it has no axis"),
    "too short": (
        Recording(
            GOOD.time_s[:50],
            {"x": AxisRecord(GOOD.position[:50], GOOD.effort[:50], "rad", "N*m")},
            "memory",
        ),
        "50 samples are not enough",
    ),
}


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("kind", BAD)
def test_what_is_no_recording_is_refused_with_its_reason(kind: str, use: str) -> None:
    recording, sentence = BAD[kind]
    with pytest.raises(DataError, match=sentence) as caught:
        USES[use](recording)
    assert caught.value.next_step


@pytest.mark.parametrize("kind", ["degrees", "a unit's other spelling", "too few efforts"])
def test_what_no_file_can_hold_is_not_saved(kind: str, tmp_path: Path) -> None:
    recording, sentence = BAD[kind]
    with pytest.raises(DataError, match=sentence):
        edge_ident.save_recording(recording, tmp_path / "made.csv")
    assert list(tmp_path.iterdir()) == []


def test_single_precision_is_enough() -> None:
    axis = made(effort=GOOD.effort.astype(np.float32))
    assert edge_ident.identify(axis, diagnose=False).trusted

"""A recording that is made in memory is checked where it is first used."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import edge_ident
from edge_ident import AxisRecord, Recording
from edge_ident.errors import DataError
from tests.test_bad_recordings import sound

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

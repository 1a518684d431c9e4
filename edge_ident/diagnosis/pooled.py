"""Whether recordings can be pooled: fitted together, or used to validate each other."""

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.signals.data_checks import check_usable
from edge_ident.signals.recording import Recording
from edge_ident.support.words import listed

Array = NDArray[np.float64]

_ROWS: Final = 16
"""In a row whose equal bits tell where two recordings may be one."""
_COPIED: Final = 0.1
"""Of what changes in the shorter recording, from which an equal stretch is a copy: noise makes any
chance of it vanish, and at rest nothing changes."""


def check_pooled(recordings: Sequence[Recording]) -> None:
    """Refuse what no model can be fitted to.

    Raises
    ------
    DataError
        An effort never changes, axes or units differ, or two recordings hold the same samples.
    """
    for recording in recordings:
        check_usable(recording)
    for one, other in combinations(recordings, 2):
        _check_pair(one, other)


def _check_pair(one: Recording, other: Recording) -> None:
    if set(other.positions) != set(one.positions):
        raise DataError(
            f"{other.source} has axes {', '.join(other.positions)}, {one.source} has "
            f"{', '.join(one.positions)}",
            "give recordings of the same machine, or rename columns with --column",
        )
    shared = {n: (axis, other.axes[n]) for n, axis in one.axes.items() if n in other.axes}
    for name, (axis, there) in shared.items():
        units, others = axis.units, there.units
        if units != others:
            raise DataError(
                f"axis {name} is in {listed(units)} in {one.source}, and in {listed(others)} in "
                f"{other.source}",
                "convert one of them: edge-ident import, with --unit, --resolution or "
                "--torque-constant",
            )
    if not shared:
        return
    if all(np.array_equal(a.effort, b.effort) for a, b in shared.values()):
        raise DataError(
            f"{one.source} and {other.source} hold the same recording",
            "give it once: a copy shows nothing new, and would make the intervals too narrow",
        )
    begin, begin_there, count = _longest_copy(*(_rows(each, shared) for each in (one, other)))
    if count:
        raise DataError(
            f"{count} rows are the same in {one.source}, from {one.time_s[begin]:.4g} s on, and in "
            f"{other.source}, from {other.time_s[begin_there]:.4g} s on",
            "cut them off one of the recordings: a copy shows nothing new, makes the intervals too "
            "narrow, and tests no model",
        )


def _rows(recording: Recording, names: Iterable[str]) -> Array:
    """Position and effort of the axes of these names, (N, 2 K)."""
    axes = [recording.axes[name] for name in names]
    return np.column_stack([each for axis in axes for each in (axis.position, axis.effort)])


def _longest_copy(one: Array, other: Array) -> tuple[int, int, int]:
    """The longest stretch of the same rows: where it begins in each, and how many there are; none
    where it holds little of what changes in either.

    The lag at which most short stretches agree is the only one that is looked at.
    """
    _, here, there = np.intersect1d(_keys(one), _keys(other), return_indices=True)
    if not len(here):
        return 0, 0, 0
    lags, votes = np.unique(here - there, return_counts=True)
    lag = int(lags[np.argmax(votes)])
    first, second = max(lag, 0), max(-lag, 0)
    count = min(len(one) - first, len(other) - second)
    same = np.all(one[first : first + count] == other[second : second + count], axis=1)
    run = np.cumsum(~same)
    changed, changed_there = _changed(one), _changed(other)
    changes = np.bincount(run, weights=same * changed[first : first + count])
    if max(changes) <= _COPIED * min(np.sum(changed), np.sum(changed_there)):
        return 0, 0, 0
    (places,) = np.nonzero(same & (run == np.argmax(changes)))
    return first + int(places[0]), second + int(places[0]), len(places)


def _keys(rows: Array) -> NDArray[np.uint64]:
    """A number for each `_ROWS` rows that follow each other, the same for the same bits."""
    odd = np.random.default_rng(0).integers(2**63, size=(2, max(_ROWS, rows.shape[1])))
    of_column, of_row = 2 * odd.astype(np.uint64) + 1
    bits = np.ascontiguousarray(rows + 0.0).view(np.uint64) @ of_column[: rows.shape[1]]
    return np.asarray(np.convolve(bits, of_row[:_ROWS], "valid"))


def _changed(rows: Array) -> NDArray[np.bool_]:
    """Whether a row differs from the one before, (N,)."""
    return np.asarray(np.any(np.diff(rows, axis=0, prepend=rows[:1]) != 0.0, axis=1))

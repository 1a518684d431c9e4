"""Pairs of recordings of one machine: two files, or the halves of one."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording

Array = NDArray[np.float64]

_SECOND: Final = "_second"  # what the name of a second recording ends with
_FIRST: Final = "_first"  # what the name of a first recording may end with
# Files of one machine whose names do not say so.
_SAME_MACHINE: Final = (("laas_motor_speed", "laas_uncompensated"),)
_COLUMNS: Final = ("position", "effort", "reference", "velocity", "temperature_c")


@dataclass(frozen=True)
class Pair:
    """Two recordings of one machine.

    Attributes
    ----------
    name : str
    first, second : Recording
        With the same axes in the same units.
    """

    name: str
    first: Recording
    second: Recording

    @property
    def directions(self) -> Iterator[tuple[str, Recording, Recording]]:
        """A label, the recording to fit, and the one to score on; both ways round."""
        yield f"{self.name}, 1 to 2", self.first, self.second
        yield f"{self.name}, 2 to 1", self.second, self.first


def pairs_in(folder: Path) -> Iterator[Pair]:
    """Pairs of a folder's CSV and NPZ files, in the order of their names.

    `NAME_second` belongs to `NAME` or `NAME_first`. A file that has no such partner is cut in half.
    """
    files = {
        path.stem: path for path in sorted(folder.iterdir()) if path.suffix in (".csv", ".npz")
    }
    known = [(a, b) for a, b in _SAME_MACHINE if {a, b} <= files.keys()]
    named = list(_by_name(files))
    partnered = {stem for pair in named for stem in pair}
    for first, second in [*named, *known]:
        pair = pair_of(files[first], files[second])
        if pair is not None:
            yield pair
    for stem, path in files.items():
        if stem not in partnered:
            yield halves(load_recording(path), stem)


def _by_name(files: Mapping[str, Path]) -> Iterator[tuple[str, str]]:
    for second in files:
        stem = second.removesuffix(_SECOND)
        for first in (stem, stem + _FIRST):
            if second.endswith(_SECOND) and first in files:
                yield first, second


def pair_of(first: Path, second: Path) -> Pair | None:
    """Two files as a pair; None where they have other axes or units."""
    one, other = load_recording(first), load_recording(second)
    if _units(one) != _units(other):
        return None
    return Pair(f"{first.stem} and {second.stem}", one, other)


def _units(recording: Recording) -> Mapping[str, tuple[str, str]]:
    return {name: a.units for name, a in recording.axes.items()}


def halves(recording: Recording, name: str) -> Pair:
    """The two halves of a recording in time."""
    count = len(recording.time_s)
    parts = [
        selected(recording, np.arange(begin, end), f"{name}, part {number}")
        for number, (begin, end) in enumerate(pairwise((0, count // 2, count)), 1)
    ]
    return Pair(f"{name}, halves", *parts)


def selected(recording: Recording, rows: NDArray[np.intp], source: str) -> Recording:
    """Some rows of a recording, with their own beginning of time."""
    axes = {name: _selected(axis, rows) for name, axis in recording.axes.items()}
    time_s = recording.time_s[rows]
    return replace(recording, time_s=time_s - time_s[0], axes=axes, source=source)


def _selected(axis: AxisRecord, rows: NDArray[np.intp]) -> AxisRecord:
    columns = {name: getattr(axis, name) for name in _COLUMNS}
    return replace(axis, **{name: c[rows] for name, c in columns.items() if c is not None})


def disturbed(recording: Recording, seeds: Sequence[int], share: float) -> Iterator[Recording]:
    """The recording with white noise added to its efforts, and every second sample of it.

    Parameters
    ----------
    seeds : sequence of int
        One noisy copy for each.
    share : float
        Rms of the noise over that of the effort.

    Yields
    ------
    Recording
        Its source says what was done to it.
    """
    for seed in seeds:
        rng = np.random.default_rng(seed)
        axes = {
            name: replace(axis, effort=_noisy(axis.effort, share, rng))
            for name, axis in recording.axes.items()
        }
        yield replace(recording, axes=axes, source=f"noise of {share:.2%}, seed {seed}")
    rows = np.arange(len(recording.time_s))
    for phase in (0, 1):
        yield selected(recording, rows[phase::2], f"every second sample from {phase}")


def _noisy(effort: Array, share: float, rng: np.random.Generator) -> Array:
    size = share * np.sqrt(np.mean(np.square(effort)))
    return np.asarray(effort + size * rng.standard_normal(len(effort)))

"""Whether recordings can be pooled: fitted together, or used to validate each other."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from edge_ident.errors import DataError
from edge_ident.signals.data_checks import check_usable
from edge_ident.signals.recording import Recording
from edge_ident.support.words import listed


def check_pooled(recordings: Sequence[Recording]) -> None:
    """Refuse what no model can be fitted to.

    Raises
    ------
    DataError
        An effort never changes, axes or units differ, or two recordings are the same one.
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
    if shared and all(np.array_equal(a.effort, b.effort) for a, b in shared.values()):
        raise DataError(
            f"{one.source} and {other.source} hold the same recording",
            "give it once: a copy shows nothing new, and would make the intervals too narrow",
        )

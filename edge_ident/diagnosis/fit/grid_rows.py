"""Regressors at the points of grids, and those that an earlier search or step computed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate, beside_key, point_key, regressors
from edge_ident.diagnosis.fit.library import Grid, Library
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Searched:
    """What an earlier search of an axis computed at the points of its grids.

    Attributes
    ----------
    data : AxisData
    axis : AxisModel
        The base model.
    library : Library
    """

    data: AxisData
    axis: AxisModel
    library: Library

    def rows(self, data: AxisData, axis: AxisModel, candidate: Candidate, grid: Grid) -> Array:
        """Regressors (D, k, n) of a candidate at the valid samples.

        They are those of the earlier search where they follow from the motion, and neither this nor
        the grid, the valid samples or what they depend on changed.
        """
        if self._holds(data, axis, candidate, grid):
            return self.library[candidate]
        return grid_rows(data, axis, candidate, grid)

    def _holds(self, data: AxisData, axis: AxisModel, candidate: Candidate, grid: Grid) -> bool:
        if candidate not in self.library or not named(candidate.effect).additive:
            return False
        before = self.library.points[candidate]
        alike = before.keys() == grid.keys() and all(
            np.array_equal(before[name], grid[name]) for name in grid
        )
        keys = (beside_key(of, candidate)[0] for of in (self.axis, axis))
        return alike and len(set(keys)) == 1 and _same_motion(self.data, data)


def grid_rows(data: AxisData, axis: AxisModel, candidate: Candidate, grid: Grid) -> Array:
    """Regressors (D, k, n) of a candidate at the points of its grid, at the valid samples."""
    return regressors(data, axis, candidate, grid)[..., data.valid]


def kept_rows(data: AxisData, axis: AxisModel, candidate: Candidate, points: Grid) -> Array:
    """Regressors (D, k, n) of a candidate at D points, at the valid samples. Those that are not
    kept yet are computed together, and kept (`cached_regressors`)."""
    beside, needed = beside_key(axis, candidate)
    each = zip(*points.values(), strict=True)
    keys = [point_key(beside, dict(zip(points, point, strict=True))) for point in each]
    new = [place for place, key in enumerate(keys) if key not in data.cache]
    if new:
        found = regressors(data, needed, candidate, {k: v[new] for k, v in points.items()})
        data.cache.update(zip((keys[place] for place in new), found, strict=True))
    return np.stack([data.cache[key] for key in keys])[..., data.valid]


def _same_motion(data: AxisData, other: AxisData) -> bool:
    """Whether two data have the same motions, compared at the same valid samples."""
    motions = zip(data.segments, other.segments, strict=True)
    same = all(a.motion is b.motion and a.filter is b.filter for a, b in motions)
    return same and np.array_equal(data.valid, other.valid)

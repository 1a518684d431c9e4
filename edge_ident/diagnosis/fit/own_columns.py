"""What each of several recordings has of its own beside the common model: a shift, and base
parameters that differ from day to day.

Bearings warm up, and sensors are tared. A model with one offset would have to explain the
difference by causes.

An own offset is a matter of a tare, and small. Where every recording moves one way, it would be all
that the dry friction is: there, one offset is that of all.
"""

from collections.abc import Hashable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import base_regressor
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.model import PARAMETERS

Array = NDArray[np.float64]

_KEY: Final[Hashable] = "own columns"
_APART: Final = ("coulomb_friction", "offset")
_SAME: Final = 0.95
"""Cosine of the angle between direction and offset, from which a recording moves one way."""
_TINY: Final = float(np.finfo(float).tiny)


def own_columns(data: AxisData) -> Array:
    """Columns (n, R + K·(R - 1)) for R recordings and their K own parameters, computed once.

    First what a further shift of each adds to the effort, per s. Then each own parameter of each
    recording but the last, above that of the last. The base model has the means over all samples.
    """
    if _KEY not in data.cache:
        known = np.array([float(name != "offset" or not one_way(data)) for name in data.own])
        inside = [data.recording == k for k in range(len(data.segments) - 1)]
        columns = (base_regressor(data)[:, PARAMETERS.index(name)] for name in data.own)
        own = [
            apart * (here - np.mean(here)) * column
            for apart, column in zip(known, columns, strict=True)
            for here in inside
        ]
        data.cache[_KEY] = np.column_stack([data.timing_columns, *own])
    return data.cache[_KEY]


def one_way(data: AxisData) -> bool:
    """Whether each of several recordings moves one way, so that direction and offset are the same
    in it, and not all of them do in the same."""
    columns = base_regressor(data)
    direction, offset = (columns[:, PARAMETERS.index(name)] for name in _APART)
    alike = []
    for k in range(len(data.segments)):
        here = data.recording == k
        size = float(np.linalg.norm(direction[here]) * np.linalg.norm(offset[here]))
        alike.append(float(direction[here] @ offset[here]) / max(size, _TINY))
    return min(map(abs, alike)) > _SAME and min(alike) < 0.0 < max(alike)


def own_parameters(data: AxisData, base: Array, own: Array) -> dict[str, Array]:
    """What each recording has of a base parameter, (R,), for each of the own ones.

    Parameters
    ----------
    data : AxisData
    base : (4,) array
        Base parameters: the means over all samples.
    own : (R + K·(R - 1),) array
        Values of the own columns.
    """
    count = len(data.segments)
    above_last = np.pad(own[count:].reshape(len(data.own), count - 1), ((0, 0), (0, 1)))
    weight = np.bincount(data.recording, minlength=count) / len(data.recording)
    above_mean = above_last - (above_last @ weight)[:, None]
    return {
        name: base[PARAMETERS.index(name)] + of_each
        for name, of_each in zip(data.own, above_mean, strict=True)
    }


def own_limits(data: AxisData, *, shifted: bool) -> tuple[Array, Array]:
    """Lowest and highest values (R + K·(R - 1),) of the same.

    Where a delay carries the whole shift, `shifted` is False, and there is no further one.
    """
    early, late = data.timing_limits
    free = np.full(len(data.own) * (len(data.segments) - 1), np.inf)
    return np.append(early * shifted, -free), np.append(late * shifted, free)

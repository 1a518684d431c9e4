"""Effort that comes back along the speed and along the stroke, named or not.

It has the shape of the board's law: friction over speed for each direction, and a load and a
friction over position, straight between entries (`firmware_interface.control_law`). So what is
fitted to recordings is what a board can give. An entry that no sample reached stays at zero.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firmware_interface.gains import FRICTION_ENTRIES, TABLE_ENTRIES

Array = NDArray[np.float64]

OVER_SPEED, OVER_POSITION = 2 * FRICTION_ENTRIES, 2 * TABLE_ENTRIES


@dataclass(frozen=True)
class Grid:
    """Where the entries lie.

    Attributes
    ----------
    top_speed : float
        Of the last entry over speed; the others lie at squares of their number.
    start, step : float
        Position of the first entry over position, and from one to the next.
    """

    top_speed: float
    start: float
    step: float

    @classmethod
    def over(cls, position: Array, velocity: Array) -> "Grid":
        """The grid over the range of positions and speeds, (N,) each."""
        low, high = float(np.min(position)), float(np.max(position))
        return cls(float(np.max(np.abs(velocity))), low, (high - low) / (TABLE_ENTRIES - 1))

    def columns(self, position: Array, velocity: Array, direction: Array) -> Array:
        """What each entry contributes per N·m, (N, `OVER_SPEED` + `OVER_POSITION`).

        Forward and backward friction over speed, then load and friction over position.

        Parameters
        ----------
        position, velocity, direction : (N,) arrays
            The direction is between -1 and 1 where it changes.
        """
        last = FRICTION_ENTRIES - 1
        at_speed = last * np.sqrt(np.minimum(np.abs(velocity) / self.top_speed, 1.0))
        friction = _hats(at_speed, FRICTION_ENTRIES)
        forward = np.where(velocity > 0.0, direction, 0.0)[:, None]
        backward = np.where(velocity > 0.0, 0.0, direction)[:, None]
        place = _hats((position - self.start) / self.step, TABLE_ENTRIES)
        parts = (friction * forward, friction * backward, place, place * direction[:, None])
        return np.concatenate(parts, axis=1)

    @property
    def lines(self) -> Array:
        """Entries over speed, (`OVER_SPEED`, 3), that do what viscous friction, Coulomb friction
        and an offset of one do."""
        speed = self.top_speed * np.linspace(0.0, 1.0, FRICTION_ENTRIES) ** 2
        ones = np.ones(FRICTION_ENTRIES)
        forward, backward = ([speed, ones, way * ones] for way in (1.0, -1.0))
        return np.concatenate([forward, backward], axis=1).T


@dataclass(frozen=True)
class Repeating:
    """Effort of an axis that repeats over its speed and its stroke.

    Attributes
    ----------
    grid : Grid
    entries : (`OVER_SPEED` + `OVER_POSITION`,) array
        N·m, as the columns of the grid; (D, ...) for D drives at once.
    """

    grid: Grid
    entries: Array

    def effort(self, position: Array, velocity: Array, direction: Array) -> Array:
        """Effort (N,), or (D, N), along a motion of (N,) samples."""
        columns = self.grid.columns(position, velocity, direction)
        return np.asarray(self.entries @ columns.T)

    @property
    def tables(self) -> tuple[Array, Array, Array, Array]:
        """Friction forward and backward over speed; load and friction over position."""
        at = np.cumsum([FRICTION_ENTRIES, FRICTION_ENTRIES, TABLE_ENTRIES])
        forward, backward, load, friction = np.split(self.entries, at)
        return forward, backward, load, friction


def _hats(place: Array, entries: int) -> Array:
    """Shares (N, entries) of each entry at places (N,); nothing beyond one cell outside."""
    return np.maximum(1.0 - np.abs(place[:, None] - np.arange(entries)), 0.0)

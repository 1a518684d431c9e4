"""Curves over speed and tables over position, sampled from an effect's own physics.

An effect whose effort depends on the velocity alone, or on position and direction alone, is asked
for its effort at constant speeds. The entries of the board's law are the least-squares fit of its
straight lines to that effort, so what a table leaves is never more than what there was. Nothing is
sampled outside the range in which the term was supported.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion
from edge_ident.model.model import Term
from edge_ident.model.motion import Motion
from firmware_interface.gains import FRICTION_ENTRIES, TABLE_ENTRIES

Array = NDArray[np.float64]

_PER_CELL: Final = 16
"""Samples of the effort between two entries."""
_ENOUGH: Final = 1.0
"""Weight of samples, of the sixteen of an inner entry, from which one can be told: an end of which
a third of the cell is supported."""
_ROUNDING: Final = 1e-9
LARGEST_REST: Final = 0.5
"""Share of a term's rms that its table may leave; a table that leaves more is too coarse for it."""


@dataclass(frozen=True)
class Sampled:
    """A term in the entries of the law.

    Attributes
    ----------
    entries : (2, K) array
        Forward and backward levels of a friction curve; load and friction of the tables.
    rest : float
        Share of the term's rms over its range that the entries leave.
    """

    entries: Array
    rest: float


def sampled_over_speed(term: Term, top_rad_s: float) -> Sampled:
    """A term as friction levels forward and backward, up to the speed supported each way."""
    assert term.supported is not None
    backward, forward = term.supported.speed
    nodes: Array = np.arange(FRICTION_ENTRIES) / (
        FRICTION_ENTRIES - 1
    )  # in √(speed/top), in which the law is straight
    fits = []
    for direction, top in ((1.0, forward), (-1.0, -backward)):
        at = _between(nodes, 0.0, np.sqrt(max(top, 0.0) / top_rad_s))
        speed = direction * top_rad_s * at**2
        level = direction * _effort(term, np.zeros_like(speed), speed)
        fits.append(_fitted(at, level, nodes))
    return _sampled(fits)


def sampled_over_position(term: Term, start_rad: float, step_rad: float) -> Sampled:
    """A term as a load and a friction level along its range of positions."""
    assert term.supported is not None
    nodes: Array = start_rad + step_rad * np.arange(TABLE_ENTRIES, dtype=np.float64)
    at = _between(nodes, *term.supported.position)
    forward, backward = (_effort(term, at, np.full_like(at, speed)) for speed in (1.0, -1.0))
    halves = (0.5 * (forward + backward), 0.5 * (forward - backward))
    return _sampled([_fitted(at, half, nodes) for half in halves])


def _effort(term: Term, position: Array, velocity: Array) -> Array:
    """Effort of a term at constant speeds."""
    still = np.zeros_like(position)
    motion = Motion.known(still, position, velocity, still)
    effort = named(term.effect).resistance(motion, along_motion(term))
    return np.broadcast_to(effort, position.shape)


def _between(nodes: Array, low: float, high: float) -> Array:
    """Samples in the middle of even parts of the cells, as far as a range goes."""
    step = (nodes[1] - nodes[0]) / _PER_CELL
    at = nodes[0] + step * (np.arange(_PER_CELL * (len(nodes) - 1)) + 0.5)
    return np.asarray(at[(at > low) & (at < high)])


def _fitted(at: Array, level: Array, nodes: Array) -> tuple[Array, Array, Array]:
    """Entries at the nodes, what they leave, and the level itself."""
    entries = np.zeros(len(nodes))
    if not len(at):
        return entries, level, level
    place = (at - nodes[0]) / (nodes[1] - nodes[0])
    hats = np.maximum(1.0 - np.abs(place[:, None] - np.arange(len(nodes))), 0.0)
    reached = hats.sum(axis=0) >= _ENOUGH
    inside = hats @ reached > 1.0 - _ROUNDING  # between entries that can be told
    if np.any(inside):
        known = hats[np.ix_(inside, reached)]
        entries[reached] = np.linalg.lstsq(known, level[inside], rcond=None)[0]
    return entries, level - hats @ entries, level


def _sampled(fits: list[tuple[Array, Array, Array]]) -> Sampled:
    left, whole = (
        float(np.sqrt(np.sum([np.sum(np.square(fit[k])) for fit in fits]))) for k in (1, 2)
    )
    return Sampled(np.array([fit[0] for fit in fits]), left / whole if whole else 0.0)

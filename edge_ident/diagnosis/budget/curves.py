"""The curves of an error budget: over which quantity, times which column of the base model.

Each is a cubic B-spline over one coordinate (P-splines: Eilers and Marx, Statistical Science 11
(1996) 89), of which no law is assumed. They are evaluated along the motion and filtered as the
effort is. A curve may vanish altogether (Marra and Wood, Comput. Stat. Data Anal. 55 (2011) 2372):
its straight part is penalized as well, less.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.smoothing import Columns
from edge_ident.model.measured_curves import at_entries, entries
from edge_ident.model.model import Term
from edge_ident.model.motion import Motion

Array = NDArray[np.float64]
OfMotion = Callable[[Motion], Array]

_STRAIGHT: Final = 1e-2
"""Penalty of a coefficient, over that of a second difference."""
_POINTS: Final = 41
"""Of a curve that is shown."""
_OUTSIDE: Final = 0.005
"""Share of the samples at either end of a coordinate, beyond which a curve is constant."""
_TURN: Final = 2.0 * np.pi
_LEAST: Final = 1e-9
"""Range of a coordinate, of its size, below which it does not change."""


@dataclass(frozen=True)
class Stretch:
    """The motion of an axis in one recording, and how its effort is filtered.

    Attributes
    ----------
    motion : Motion
        (N,).
    others : mapping of axis name to Motion
        Axes that move beside it.
    at : (n,) array of int
        Samples that are compared.
    filter : callable
        Of efforts (m, N), to those at the compared samples (m, n).
    lap : int or None
        Samples after which the motion repeats.
    """

    motion: Motion
    others: Mapping[str, Motion]
    at: NDArray[np.intp]
    filter: Callable[[Array], Array]
    lap: int | None = None


@dataclass(frozen=True)
class Kind:
    """One sort of curve.

    Attributes
    ----------
    where : str
        What it depends on; curves of the same are one entry of a budget.
    what : str
        What it is a curve of.
    unit : str
        Template over {position}: of the coordinate.
    of : str
        Template over {effort} and {position}: unit of the curve.
    over, times : callable
        Coordinate, and the column that the curve multiplies, of a motion (N,).
    knots : int
        Functions of the spline.
    root : bool
        Whether it is finer where the coordinate is small.
    turns : bool
        Whether it repeats with each turn.
    own : tuple of callable
        Curves over the coordinate that the base model has already, of the same column.
    coordinate : str
        In words, where `where` does not say it.
    effect : str
        What holds such a curve in a model (`edge_ident.model.measured_curves`); none where it is
        tied to the time of its recording, or no static curve.
    """

    where: str
    what: str
    unit: str
    of: str
    over: OfMotion
    times: OfMotion
    knots: int
    root: bool = False
    turns: bool = False
    own: tuple[Callable[[Array], Array], ...] = ()
    coordinate: str = ""
    effect: str = ""

    @property
    def over_what(self) -> str:
        """The coordinate in words."""
        return self.coordinate or self.where

    @property
    def source(self) -> str | None:
        """The other axis that it is of, if any."""
        name = self.where.removeprefix("axis ")
        return name if name != self.where else None


@dataclass(frozen=True)
class Curve:
    """A kind of curve along recordings.

    Attributes
    ----------
    kind : Kind
    columns : Columns
        At the compared samples.
    points : (P,) array
        Of the coordinate, at which it is shown.
    shown : (P, m) array
        The curve there by its coefficients, without what the base model has of it.
    at : (n,) array
        The coordinate at the compared samples.
    range : (float, float)
        Of the coordinate, as in a model's table.
    table : (E, m) array
        The same at the entries of that.
    """

    kind: Kind
    columns: Columns
    points: Array
    shown: Array
    at: Array = field(default_factory=lambda: np.empty(0))
    range: tuple[float, float] = (0.0, 0.0)
    table: Array = field(default_factory=lambda: np.empty((0, 0)))

    def term(self, coefficients: Array) -> Term:
        """The curve of some coefficients (m,) as a term of a model."""
        first, last = self.range
        values = {"first": first, "last": last, **entries(self.table @ coefficients)}
        return Term(self.kind.effect, values, source_axis=self.kind.source)


def _one(motion: Motion) -> Array:
    return np.ones_like(motion.position)


def _constant(x: Array) -> Array:
    return np.ones_like(x)


def _straight(x: Array) -> Array:
    return x


def _speed(motion: Motion) -> Array:
    return np.abs(motion.velocity)


def _position(motion: Motion) -> Array:
    return motion.position


def _direction(motion: Motion) -> Array:
    return motion.direction


def _velocity(motion: Motion) -> Array:
    return motion.velocity


def _acceleration(motion: Motion) -> Array:
    return motion.acceleration


def _jerk(motion: Motion) -> Array:
    return np.gradient(motion.acceleration, motion.time_s)


def _pull(motion: Motion) -> Array:
    return np.abs(motion.acceleration)


def _pulls(motion: Motion) -> Array:
    return np.sign(motion.acceleration)


def _time(motion: Motion) -> Array:
    return motion.time_s


def _since_reversal(motion: Motion) -> Array:
    """Distance travelled since the last reversal, or since the start."""
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(motion.position)))])
    turns = np.flatnonzero(np.diff(np.sign(motion.velocity)) != 0) + 1
    starts = np.concatenate([[0], turns])
    last = starts[np.searchsorted(starts, np.arange(len(travelled)), side="right") - 1]
    return np.asarray(travelled - travelled[last])


SPEED, BY_DIRECTION, POSITION, LOAD, TIME, HISTORY = (
    "speed, both ways alike", "speed, by direction", "position", "acceleration", "time", "history",
)  # fmt: skip

OF_AXIS: Final = (
    Kind(SPEED, "friction", "{position}/s", "{effort}", _speed, _direction, 16, root=True,
         own=(_constant, _straight), coordinate="speed", effect="friction_over_speed"),
    Kind(BY_DIRECTION, "difference of directions", "{position}/s", "{effort}", _speed, _one, 16,
         root=True, own=(_constant,), coordinate="speed", effect="difference_over_speed"),
    Kind(POSITION, "load", "{position}", "{effort}", _position, _one, 24, own=(_constant,),
         effect="load_over_position"),
    Kind(POSITION, "friction", "{position}", "{effort}", _position, _direction, 20,
         own=(_constant,), effect="friction_over_position"),
    Kind(POSITION, "inertia", "{position}", "{effort}*s^2/{position}", _position, _acceleration, 10,
         own=(_constant,), effect="inertia_over_position"),
    Kind(LOAD, "load", "{position}/s^2", "{effort}", _pull, _pulls, 10, own=(_straight,)),
    Kind(LOAD, "friction", "{position}/s^2", "{effort}", _pull, _direction, 10, own=(_constant,)),
    Kind(LOAD, "difference of directions", "{position}/s^2", "{effort}", _pull, _one, 10,
         own=(_constant,)),
    Kind(TIME, "load", "s", "{effort}", _time, _one, 14, own=(_constant,)),
    Kind(TIME, "friction", "s", "{effort}", _time, _direction, 14, own=(_constant,)),
    Kind(TIME, "viscous friction", "s", "{effort}*s/{position}", _time, _velocity, 14,
         own=(_constant,)),
    Kind(TIME, "inertia", "s", "{effort}*s^2/{position}", _time, _acceleration, 14,
         own=(_constant,)),
    Kind(HISTORY, "friction", "{position}", "{effort}", _since_reversal, _direction, 10, root=True,
         own=(_constant,), coordinate="distance since the axis turned back"),
    Kind(HISTORY, "lag of the inertia", "{position}/s^2", "{effort}*s^3/{position}",
         _pull, _jerk, 5, coordinate="acceleration"),
)  # fmt: skip
"""What any axis may have."""
OF_TURN: Final = Kind(
    "turn",
    "load",
    "{position}",
    "{effort}",
    _position,
    _one,
    16,
    turns=True,
    own=(_constant,),
    effect="load_over_turn",
)
"""What an axis may have that turns more than once."""


def kinds(stretches: Sequence[Stretch], turning: bool) -> list[Kind]:
    """The kinds of curve that recordings of an axis may show; `turning` where it is a joint."""
    found = list(OF_AXIS)
    travel = max(float(np.ptp(s.motion.position[s.at])) for s in stretches)
    if turning and travel > _TURN:
        found.append(OF_TURN)
    shared = set.intersection(*(set(s.others) for s in stretches))
    for name in sorted(shared):
        if any(np.ptp(s.others[name].position) > 0.0 for s in stretches):
            found += _of_other(name)
    return found


def _of_other(name: str) -> Iterator[Kind]:
    """What another axis may do; it is the source of the motion."""

    def position(motion: Motion) -> Array:
        return motion.partner.position

    def acceleration(motion: Motion) -> Array:
        return motion.partner.acceleration

    where, over, unit = f"axis {name}", f"position of axis {name}", "{effort}*s^2/{position}"
    yield Kind(where, "load", "{position}", "{effort}", position, _one, 16, own=(_constant,),
               coordinate=over, effect="load_over_other")  # fmt: skip
    yield Kind(where, "inertia", "{position}", unit, position, _acceleration, 7, own=(_constant,),
               coordinate=over, effect="inertia_over_other")  # fmt: skip
    yield Kind(where, "coupling", "{position}", unit, position, acceleration, 7, coordinate=over,
               effect="coupling_over_other")  # fmt: skip


def curve_of(kind: Kind, stretches: Sequence[Stretch]) -> Curve | None:
    """A kind of curve along recordings; None where its coordinate hardly changes."""
    motions = _motions(kind, stretches)
    coordinates = [kind.over(motion) for motion in motions]
    at = np.concatenate([x[s.at] for x, s in zip(coordinates, stretches, strict=True)])
    lowest, high = (0.0, _TURN) if kind.turns else np.quantile(at, [_OUTSIDE, 1.0 - _OUTSIDE])
    low = 0.0 if kind.root else lowest
    if not high - low > _LEAST * max(abs(low), abs(high)):
        return None
    spline = _Spline(float(low), float(high), kind.knots, kind.root, kind.turns)
    values = [
        s.filter(spline(x).T * kind.times(m)).T
        for x, m, s in zip(coordinates, motions, stretches, strict=True)
    ]
    columns = Columns(np.concatenate(values), spline.penalty)
    visited = spline.points[spline.points >= lowest]
    shown = _beyond_base(kind, spline, at, visited)
    ends = float(low), float(high)
    table = _beyond_base(kind, spline, at, at_entries(*ends, finer_at_zero=kind.root))
    return Curve(kind, columns, visited, shown, at, ends, table)


def law_of(where: str, name: str, effort: Array) -> Curve:
    """The contribution (n,) of an effect of the diagnosis, in place of a curve."""
    kind = Kind(where, name, "", "", _position, _one, 1)
    nothing = np.empty(0)
    return Curve(kind, Columns(effort[:, None], np.eye(1)), nothing, nothing[:, None])


def _motions(kind: Kind, stretches: Sequence[Stretch]) -> list[Motion]:
    """The motions, one after the other in time, with the other axis that a kind is of, if any."""
    ended_s = 0.0
    found: list[Motion] = []
    for s in stretches:
        motion = s.motion
        if kind.source is not None:
            motion = replace(motion, source=s.others[kind.source])
        begin_s = float(motion.time_s[0])
        later_s = max(ended_s - begin_s, 0.0) if found else 0.0
        found.append(replace(motion, time_s=motion.time_s + later_s))
        ended_s = float(found[-1].time_s[-1])
    return found


def _beyond_base(kind: Kind, spline: "_Spline", at: Array, points: Array) -> Array:
    """The curve at points by its coefficients, less what fits it best of the base model's."""
    shown, seen = spline(points), spline(at)
    if not kind.own:
        return shown
    here = np.stack([own(points) for own in kind.own], axis=1)
    there = np.stack([own(at) for own in kind.own], axis=1)
    return np.asarray(shown - here @ np.linalg.lstsq(there, seen, rcond=None)[0])


@dataclass(frozen=True)
class _Spline:
    """A uniform cubic B-spline over a range; it is constant beyond, or repeats."""

    low: float
    high: float
    count: int
    root: bool
    turns: bool

    @property
    def points(self) -> Array:
        """Of the coordinate, as dense as the spline."""
        return at_entries(self.low, self.high, finer_at_zero=self.root, count=_POINTS)

    @property
    def penalty(self) -> Array:
        """Second differences, and less of each coefficient."""
        second = np.diff(np.eye(self.count), 2, axis=0)
        if self.turns:
            one = np.eye(self.count)
            second = np.roll(one, -1, axis=0) - 2.0 * one + np.roll(one, 1, axis=0)
        return np.asarray(second.T @ second + _STRAIGHT * np.eye(self.count))

    def __call__(self, x: Array) -> Array:
        """The functions (N, m) at coordinates (N,)."""
        place = (x - self.low) / (self.high - self.low)
        cells = self.count if self.turns else self.count - 3
        place = np.mod(place, 1.0) if self.turns else np.clip(place, 0.0, 1.0)
        along = cells * (np.sqrt(place) if self.root else place)
        cell = np.minimum(along.astype(np.intp), cells - 1)
        t = along - cell
        weights = np.stack(
            [(1.0 - t) ** 3, 4.0 - 3.0 * t**2 * (2.0 - t),
             1.0 + 3.0 * t * (1.0 + t * (1.0 - t)), t**3],
            axis=1,
        ) / 6.0  # fmt: skip
        found = np.zeros((len(x), self.count))
        for k in range(4):
            found[np.arange(len(x)), (cell + k) % self.count] = weights[:, k]
        return found

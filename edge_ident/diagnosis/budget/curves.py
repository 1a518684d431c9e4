"""The curves of an error budget: over which quantity, times which column of the base model.

Each is a cubic B-spline over one coordinate (P-splines: Eilers and Marx, Statistical Science 11
(1996) 89), of which no law is assumed. They are evaluated along the motion and filtered as the
effort is. A curve may vanish altogether (Marra and Wood, Comput. Stat. Data Anal. 55 (2011) 2372):
its straight part is penalized as well, less.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment
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
class Kind:
    """One sort of curve.

    Attributes
    ----------
    where : str
        What it depends on; curves of the same are one entry of a budget.
    what : str
        What it is a curve of.
    over, times : str
        Coordinate, and the column that the curve multiplies, by name.
    knots : int
        Functions of the spline.
    root : bool
        Whether it is finer where the coordinate is small.
    turns : bool
        Whether it repeats with each turn.
    own : tuple of int
        Powers of the coordinate that the base model has already, of the same column.
    coordinate : str
        In words, where `where` does not say it.
    effect : str
        What holds such a curve in a model (`edge_ident.model.measured_curves`); none where it is
        tied to the time of its recording, or no static curve.
    """

    where: str
    what: str
    over: str
    times: str
    knots: int
    root: bool = False
    turns: bool = False
    own: tuple[int, ...] = ()
    coordinate: str = ""
    effect: str = ""

    def units(self, position: str, effort: str) -> tuple[str, str]:
        """Of the coordinate, and of the curve, on an axis with these units."""
        templates = _COORDINATES[self.over][0], _COLUMNS[self.times][0]
        of_coordinate, of_curve = (t.format(position=position, effort=effort) for t in templates)
        return of_coordinate, of_curve

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
    values : (n, m) array
        Its columns at the compared samples.
    penalty : (m, m) array
        Positive definite.
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
    values: Array
    penalty: Array
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


def _since_reversal(motion: Motion) -> Array:
    """Distance travelled since the last reversal, or since the start."""
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(motion.position)))])
    turns = np.flatnonzero(np.diff(np.sign(motion.velocity)) != 0) + 1
    starts = np.concatenate([[0], turns])
    last = starts[np.searchsorted(starts, np.arange(len(travelled)), side="right") - 1]
    return np.asarray(travelled - travelled[last])


_COORDINATES: Final[Mapping[str, tuple[str, OfMotion]]] = {
    "time": ("s", lambda m: m.time_s),
    "position": ("{position}", lambda m: m.position),
    "position of the other": ("{position}", lambda m: m.partner.position),
    "since reversal": ("{position}", _since_reversal),
    "speed": ("{position}/s", lambda m: np.abs(m.velocity)),
    "pull": ("{position}/s^2", lambda m: np.abs(m.acceleration)),
}
"""What curves are over: unit, and values (N,) along a motion."""
_COLUMNS: Final[Mapping[str, tuple[str, OfMotion]]] = {
    "one": ("{effort}", lambda m: np.ones_like(m.position)),
    "direction": ("{effort}", lambda m: m.direction),
    "way of the pull": ("{effort}", lambda m: np.sign(m.acceleration)),
    "velocity": ("{effort}*s/{position}", lambda m: m.velocity),
    "acceleration": ("{effort}*s^2/{position}", lambda m: m.acceleration),
    "pull of the other": ("{effort}*s^2/{position}", lambda m: m.partner.acceleration),
    "jerk": ("{effort}*s^3/{position}", lambda m: np.gradient(m.acceleration, m.time_s)),
}
"""What curves multiply: unit of the curve, and values (N,) along a motion."""

SPEED, BY_DIRECTION, POSITION, LOAD, TIME, HISTORY = (
    "speed, both ways alike", "speed, by direction", "position", "acceleration", "time", "history",
)  # fmt: skip

OF_AXIS: Final = (
    Kind(SPEED, "friction", "speed", "direction", 16, root=True, own=(0, 1),
         coordinate="speed", effect="friction_over_speed"),
    Kind(BY_DIRECTION, "difference of directions", "speed", "one", 16, root=True, own=(0,),
         coordinate="speed", effect="difference_over_speed"),
    Kind(POSITION, "load", "position", "one", 24, own=(0,), effect="load_over_position"),
    Kind(POSITION, "friction", "position", "direction", 20, own=(0,),
         effect="friction_over_position"),
    Kind(POSITION, "inertia", "position", "acceleration", 10, own=(0,),
         effect="inertia_over_position"),
    Kind(LOAD, "load", "pull", "way of the pull", 10, own=(1,)),
    Kind(LOAD, "friction", "pull", "direction", 10, own=(0,)),
    Kind(LOAD, "difference of directions", "pull", "one", 10, own=(0,)),
    Kind(TIME, "load", "time", "one", 14, own=(0,)),
    Kind(TIME, "friction", "time", "direction", 14, own=(0,)),
    Kind(TIME, "viscous friction", "time", "velocity", 14, own=(0,)),
    Kind(TIME, "inertia", "time", "acceleration", 14, own=(0,)),
    Kind(HISTORY, "friction", "since reversal", "direction", 10, root=True, own=(0,),
         coordinate="distance since the axis turned back"),
    Kind(HISTORY, "lag of the inertia", "pull", "jerk", 5, coordinate="acceleration"),
)  # fmt: skip
"""What any axis may have."""
OF_TURN: Final = Kind(
    "turn", "load", "position", "one", 16, turns=True, own=(0,), effect="load_over_turn"
)
"""What an axis may have that turns more than once."""


def curves_of(data: AxisData) -> tuple[Curve, ...]:
    """The curves that recordings of an axis may show."""
    found = list(OF_AXIS)
    travel = max(float(np.ptp(s.motion.position[s.sample_index[s.valid]])) for s in data.segments)
    if data.turning and travel > _TURN:
        found.append(OF_TURN)
    for name in data.other_axes:
        found += _of_other(name)
    every = (_curve(kind, data) for kind in found)
    return tuple(curve for curve in every if curve is not None)


def _of_other(name: str) -> list[Kind]:
    """What another axis may do; it is the source of the motion."""
    where, over, in_words = f"axis {name}", "position of the other", f"position of axis {name}"
    return [
        Kind(where, "load", over, "one", 16, own=(0,),
             coordinate=in_words, effect="load_over_other"),
        Kind(where, "inertia", over, "acceleration", 7, own=(0,),
             coordinate=in_words, effect="inertia_over_other"),
        Kind(where, "coupling", over, "pull of the other", 7,
             coordinate=in_words, effect="coupling_over_other"),
    ]  # fmt: skip


def _curve(kind: Kind, data: AxisData) -> Curve | None:
    """A kind of curve along recordings; None where its coordinate hardly changes."""
    motions = _motions(kind, data.segments)
    coordinates = [_COORDINATES[kind.over][1](motion) for motion in motions]
    seen = [x[s.sample_index] for x, s in zip(coordinates, data.segments, strict=True)]
    at = np.concatenate(seen)[data.valid]
    lowest, high = (0.0, _TURN) if kind.turns else np.quantile(at, [_OUTSIDE, 1.0 - _OUTSIDE])
    low = 0.0 if kind.root else lowest
    if not high - low > _LEAST * max(abs(low), abs(high)):
        return None
    spline = _Spline(float(low), float(high), kind.knots, kind.root, kind.turns)
    values = [
        s.filter(spline(x).T * _COLUMNS[kind.times][1](m)).T
        for x, m, s in zip(coordinates, motions, data.segments, strict=True)
    ]
    visited = spline.points[spline.points >= lowest]
    shown = _beyond_base(kind, spline, at, visited)
    ends = float(low), float(high)
    table = _beyond_base(kind, spline, at, at_entries(*ends, finer_at_zero=kind.root))
    columns = np.concatenate(values)[data.valid]
    return Curve(kind, columns, spline.penalty, visited, shown, at, ends, table)


def law_of(where: str, name: str, effort: Array) -> Curve:
    """The contribution (n,) of an effect of the diagnosis, in place of a curve."""
    kind = Kind(where, name, "position", "one", 1)
    nothing = np.empty(0)
    return Curve(kind, effort[:, None], np.eye(1), nothing, nothing[:, None])


def _motions(kind: Kind, segments: Sequence[Segment]) -> list[Motion]:
    """The motions, one after the other in time, with the other axis that a kind is of, if any."""
    ended_s = 0.0
    found: list[Motion] = []
    for s in segments:
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
    here = np.stack([points**power for power in kind.own], axis=1)
    there = np.stack([at**power for power in kind.own], axis=1)
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

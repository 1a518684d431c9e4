"""Curves that recordings show and no law of the catalogue describes, as terms of a model.

Each is a table of equally many entries over one coordinate, straight between them and constant
beyond. The error budget of a diagnosis finds them (`edge_ident.diagnosis.budget`); nobody searches
for them by name. What they hold lies beyond the base term: a table of zeros changes nothing.
"""

from collections.abc import Mapping
from typing import ClassVar, Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Effect, Parameter
from edge_ident.model.motion import Array, Motion, Values
from edge_ident.model.search import SearchSpec

ENTRIES: Final = 33
"""Of a table: a spline of 24 functions is straight between them within 1 % of its size."""
_MOST: Final = 1e9
_LEAST: Final = 1e-300
"""Span of a table whose ends are the same."""
_NAMES: Final = tuple(f"entry_{k:02d}" for k in range(ENTRIES))


def _parameters(coordinate: str, unit: str, what: str) -> tuple[Parameter, ...]:
    return (
        Parameter("first", coordinate, -_MOST, _MOST, "coordinate of the first entry"),
        Parameter("last", coordinate, -_MOST, _MOST, "coordinate of the last entry"),
        *(Parameter(name, unit, -_MOST, _MOST, what) for name in _NAMES),
    )


class MeasuredCurve(Effect):
    """A table over one coordinate."""

    is_friction: ClassVar[bool] = False

    def __init__(self, compensation: Compensation, in_words: str) -> None:
        super().__init__(
            search=SearchSpec(shares_friction=self.is_friction),
            compensation=compensation,
            advice=Advice(
                in_words=in_words,
                part="whatever changes along this quantity; no law of the catalogue describes it",
                action="The model has it as a table, within the range that was recorded.",
            ),
        )


def entries(table: Array) -> dict[str, float]:
    """Values (`ENTRIES`,) of a table by the names of its parameters."""
    return dict(zip(_NAMES, table.tolist(), strict=True))


def at_entries(
    first: float, last: float, *, finer_at_zero: bool = False, count: int = ENTRIES
) -> Array:
    """Coordinates (`count`,) of a table's entries.

    Parameters
    ----------
    first, last : float
    finer_at_zero : bool
        Whether they lie at squares of equal steps, as those over speed do.
    count : int, optional
    """
    place = np.linspace(0.0, 1.0, count)
    return first + (last - first) * (place**2 if finer_at_zero else place)


def _level(x: Array, values: Values, *, finer_at_zero: bool = False) -> Array:
    """The table at coordinates x; it broadcasts over drives."""
    span = np.maximum(values["last"] - values["first"], _LEAST)
    place = np.clip((x - values["first"]) / span, 0.0, 1.0)
    along = (ENTRIES - 1) * (np.sqrt(place) if finer_at_zero else place)
    cell = np.minimum(along.astype(np.intp), ENTRIES - 2)
    if cell.size == 1:  # at an instant of a simulation: no table has to be put together
        low, high = (values[_NAMES[cell.item() + k]] for k in (0, 1))
        return np.asarray(low + (along - cell) * (high - low))
    table = np.array([values[name] for name in _NAMES])
    if table[0].size == 1:  # one drive: no copy of the table for each sample
        low, high = table.ravel()[cell], table.ravel()[cell + 1]
    else:
        missing = cell.ndim - (table.ndim - 1)
        table = table.reshape(ENTRIES, *[1] * missing, *table.shape[1:])
        table = np.broadcast_to(table, (ENTRIES, *cell.shape))
        low, high = (np.take_along_axis(table, (cell + k)[None], axis=0)[0] for k in (0, 1))
    return np.asarray(low + (along - cell) * (high - low))


def _steepest(values: Values, *, finer_at_zero: bool = False) -> Array:
    """Largest slope of the table; that over speed is steep at zero."""
    table = np.array([values[name] for name in _NAMES])
    place = at_entries(0.0, 1.0, finer_at_zero=finer_at_zero)
    steps = np.diff(place).reshape(-1, *[1] * (table.ndim - 1))
    span = np.maximum(values["last"] - values["first"], _LEAST)
    return np.asarray(np.max(np.abs(np.diff(table, axis=0)) / steps, axis=0) / span)


class _OverSpeed(MeasuredCurve):
    is_friction = True

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """That of viscous friction as steep as the table."""
        return _steepest(values, finer_at_zero=True) / inertia


class FrictionOverSpeed(_OverSpeed):
    """Friction over speed, the same both ways, beyond Coulomb and viscous friction."""

    parameters = _parameters("{position}/s", "{effort}", "friction beyond the base model")

    def friction(self, at: Motion, values: Values) -> Array:
        """What holds the axis at rest."""
        return np.asarray(values[_NAMES[0]])

    def load(self, at: Motion, values: Values) -> Array:
        """What the speed adds to that."""
        added = _level(np.abs(at.velocity), values, finer_at_zero=True) - values[_NAMES[0]]
        return np.asarray(added * np.sign(at.velocity))


class DifferenceOverSpeed(_OverSpeed):
    """Half the difference of the friction forward and backward, over speed."""

    parameters = _parameters("{position}/s", "{effort}", "half the difference of the directions")

    def load(self, at: Motion, values: Values) -> Array:
        """The same sign both ways."""
        return _level(np.abs(at.velocity), values, finer_at_zero=True)


class LoadOverPosition(MeasuredCurve):
    """A load along the stroke."""

    parameters = _parameters("{position}", "{effort}", "load beyond that of the base model")
    carried = True

    def load(self, at: Motion, values: Values) -> Array:
        """The table."""
        return _level(at.position, values)

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Resonance on a spring as steep as the table."""
        return np.sqrt(_steepest(values) / inertia)


class LoadOverTurn(LoadOverPosition):
    """A load that repeats with each turn."""

    def load(self, at: Motion, values: Values) -> Array:
        """The table, turn by turn."""
        return _level(np.mod(at.position, 2.0 * np.pi), values)


class _OverStroke(MeasuredCurve):
    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Passing an entry at top speed."""
        span = np.maximum(values["last"] - values["first"], _LEAST)
        return np.asarray((ENTRIES - 1) * speed / span)


class FrictionOverPosition(_OverStroke):
    """Dry friction along the stroke, beyond Coulomb friction."""

    is_friction = True
    parameters = _parameters("{position}", "{effort}", "friction beyond Coulomb friction")

    def friction(self, at: Motion, values: Values) -> Array:
        """The table."""
        return _level(at.position, values)


class InertiaOverPosition(_OverStroke):
    """Inertia along the stroke, beyond that of the base model."""

    parameters = _parameters("{position}", "{inertia}", "inertia beyond that of the base model")

    def inertia(self, at: Motion, values: Values) -> Array:
        """The table."""
        return _level(at.position, values)


class LoadOverOther(_OverStroke):
    """A load over the position of another axis."""

    parameters = _parameters("{position}", "{effort}", "load beyond that of the base model")
    needs_source = True

    def load(self, at: Motion, values: Values) -> Array:
        """The table."""
        return _level(at.partner.position, values)


class InertiaOverOther(_OverStroke):
    """Inertia over the position of another axis."""

    parameters = _parameters("{position}", "{inertia}", "inertia beyond that of the base model")
    needs_source = True

    def inertia(self, at: Motion, values: Values) -> Array:
        """The table."""
        return _level(at.partner.position, values)


class CouplingOverOther(_OverStroke):
    """Effort per acceleration of another axis, over its position."""

    parameters = _parameters("{position}", "{inertia}", "effort per acceleration of the other axis")
    needs_source = True

    def cross_inertia(self, at: Motion, values: Values) -> Array:
        """The table."""
        return _level(at.partner.position, values)


_NO_TABLE: Final = Compensation(without="the board's law has no table for it")
MEASURED: Final[Mapping[str, MeasuredCurve]] = {
    curve.name: curve
    for curve in (
        FrictionOverSpeed(Compensation(over="speed"), "friction bends with the speed"),
        DifferenceOverSpeed(Compensation(over="speed"), "friction differs by direction"),
        LoadOverPosition(Compensation(over="position"), "a force depends on the position"),
        LoadOverTurn(_NO_TABLE, "a force repeats with each turn"),
        FrictionOverPosition(Compensation(over="position"), "friction changes along the stroke"),
        InertiaOverPosition(_NO_TABLE, "inertia changes along the stroke"),
        LoadOverOther(_NO_TABLE, "a force depends on where another axis stands"),
        InertiaOverOther(_NO_TABLE, "inertia depends on where another axis stands"),
        CouplingOverOther(_NO_TABLE, "the acceleration of another axis is felt"),
    )
}
"""By name."""

"""The model of a drive: terms per axis, the first of them the base term.

The base model is rigid body and friction, linear in its four parameters:

effort = inertia·a + viscous_friction·v + coulomb_friction·sign(v) + offset

It reconstructs the paper's reduced model. The text fixes four coefficients per axis, three positive
and one of either sign, but not their names. Further terms are effects of the catalogue
(`edge_ident.model.effects`).
"""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from itertools import combinations, product
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.model.motion import Motion
from edge_ident.support.given import check_type
from edge_ident.support.rows import Readable

Array = NDArray[np.float64]


# The axes that act on another one: one of them, or joints by the sum of their angles.
#
# A link's angle in space is the sum of the angles of all joints up to it that turn in its plane. So
# a term names as its source one axis, `j2`, or several, `j1 + j2`. A joint that counts its angle
# the other way round has a minus: `-j2`, `j1 - j2`.

_SIGNS: Final = re.compile(r"(?:^|\s)([+-])(?:\s|(?=\S))")


class Acting(NamedTuple):
    """An axis that takes part, and the sense in which it counts: 1 or -1."""

    axis: str
    sense: int


def sources(axes: Sequence[str], most: int) -> Iterator[str]:
    """What a term may name where so many axes act by the sum of their angles, in either sense of
    each."""
    for count in range(1, most + 1):
        for group, senses in product(combinations(axes, count), product("+-", repeat=count)):
            yield _source(zip(senses, group, strict=True))


def turned(source: str, axis: str) -> str:
    """The same source, with one axis that counts in the other sense."""
    acts = ((one.sense * (-1 if one.axis == axis else 1), one.axis) for one in acting(source, ()))
    return _source(("-" if sense < 0 else "+", name) for sense, name in acts)


def _source(signed: Iterable[tuple[str, str]]) -> str:
    text = " ".join(f"{sign} {axis}" for sign, axis in signed)
    return text.removeprefix("+ ") if text[0] == "+" else f"-{text[2:]}"


def acting(source: str | None, known: Collection[str]) -> tuple[Acting, ...]:
    """The axes that a source stands for; none for no source.

    Parameters
    ----------
    source : str or None
        As a term names it.
    known : collection of str
        Axes that there are. One that is called like a sum is meant itself.
    """
    if source is None:
        return ()
    if source in known:
        return (Acting(source, 1),)
    first, *others = _SIGNS.split(source)
    pairs = zip(others[::2], others[1::2], strict=True)
    named = [("+", first)] if first else []
    return tuple(Acting(a, -1 if sign == "-" else 1) for sign, a in (*named, *pairs))


def axes_of(source: str | None, known: Collection[str]) -> tuple[str, ...]:
    """Their names."""
    return tuple(one.axis for one in acting(source, known))


def together(motions: Iterable[tuple[Motion, int]]) -> Motion:
    """The motion of what acts, from those of its axes and the senses in which these count."""
    return reduce(_sum, (_turned(motion, sense) for motion, sense in motions))


def _turned(one: Motion, sense: int) -> Motion:
    if sense > 0:
        return one
    signals = (-one.position, -one.velocity, -one.acceleration, -one.direction)
    return Motion(one.time_s, *signals, clock=one.clock)


def _sum(one: Motion, other: Motion) -> Motion:
    velocity = one.velocity + other.velocity
    return Motion(
        one.time_s,
        one.position + other.position,
        velocity,
        one.acceleration + other.acceleration,
        np.sign(velocity),
        clock=one.clock,
    )


# The range in which a term was supported, and what leaves it.
#
# A formula is known to hold where samples supported it. Beyond, it is a guess: a limit may lie
# elsewhere, a play may end, an order may have another amplitude. So a model file carries the range
# of each term, and whoever uses the model says where a motion leaves it.

Interval = tuple[float, float]

QUANTITIES: Final = ("position", "speed", "acceleration", "effort")
"""What a range covers, in the order in which it is reported."""
# Width beyond either end that still counts as inside, of the interval. The ends are extremes of
# filtered signals, and another bandwidth or noise moves those by a few percent. At the start the
# diagnosis leaves out at most a ninth of it, where friction and play remember earlier motion.
_MARGIN: Final = 0.125


@dataclass(frozen=True)
class SupportedRange:
    """Lowest and highest values at the samples that support a term, in the units of the axis.

    Attributes
    ----------
    position, speed, acceleration, effort : tuple of float
        Speed is that along the axis: negative backwards.

    Examples
    --------
    >>> import numpy as np
    >>> from edge_ident.model.model import SupportedRange
    >>> still = np.zeros(2)
    >>> SupportedRange.of(np.array([0.0, 2.0]), still, still, still).position
    (0.0, 2.0)
    """

    position: Interval
    speed: Interval
    acceleration: Interval
    effort: Interval

    @classmethod
    def of(cls, position: Array, speed: Array, acceleration: Array, effort: Array) -> Self:
        """The range of signals, (N,) each."""
        signals = (position, speed, acceleration, effort)
        return cls(*((float(np.min(signal)), float(np.max(signal))) for signal in signals))

    def left_by(self, motion: "SupportedRange") -> tuple["Departure", ...]:
        """Quantities of a motion that leave this range by more than the margin."""
        found = []
        for quantity in QUANTITIES:
            supported, reached = getattr(self, quantity), getattr(motion, quantity)
            margin = _MARGIN * (supported[1] - supported[0])
            if reached[0] < supported[0] - margin or reached[1] > supported[1] + margin:
                found.append(Departure(quantity, reached, supported))
        return tuple(found)


@dataclass(frozen=True)
class Departure:
    """A quantity that leaves the range of one or several terms.

    Attributes
    ----------
    quantity : str
        One of `QUANTITIES`.
    reached, supported : tuple of float
        Its lowest and highest values in the motion, and in the range of the term.
    """

    quantity: str
    reached: Interval
    supported: Interval

    def sentence(self, unit: str) -> str:
        """The departure in words, with its unit."""
        low, high = self.reached
        return (
            f"{self.quantity} {low:.3g} to {high:.3g} {unit} (supported "
            f"{self.supported[0]:.3g} to {self.supported[1]:.3g})"
        )


def quantity_unit(quantity: str, position_unit: str, effort_unit: str) -> str:
    """Unit of one of `QUANTITIES` on an axis."""
    return {
        "position": position_unit,
        "speed": f"{position_unit}/s",
        "acceleration": f"{position_unit}/s^2",
        "effort": effort_unit,
    }[quantity]


PARAMETERS: Final = ("inertia", "viscous_friction", "coulomb_friction", "offset")
POSITIVE: Final = np.array([True, True, True, False])
"""Which parameters physics requires to be positive; the offset may have either sign."""
BOARD_UNITS: Final = ("rad", "N*m")
"""Units of position and effort in which a board's limits and gains are."""
BASE: Final = "rigid_body"
"""Name of the base term."""
NORMAL_90: Final = 1.645
"""Half the width of a 90 % interval, in standard deviations."""
NORMAL_95: Final = 1.96
"""Half the width of a 95 % interval, in standard deviations."""


@dataclass(frozen=True)
class Estimate:
    """Parameters in the order of `PARAMETERS` with their standard deviations, (4,) each, SI.

    Examples
    --------
    >>> import edge_ident
    >>> estimate = edge_ident.identify(edge_ident.simulate()).axes["x"].estimate
    >>> bool(estimate.std[0] < 0.01 * estimate.parameters[0])
    True
    """

    parameters: NDArray[np.float64]
    std: NDArray[np.float64]


def regressor(
    velocity: NDArray[np.float64], acceleration: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Columns that multiply the parameters, in the order of `PARAMETERS`.

    Parameters
    ----------
    velocity, acceleration : (N,) arrays
        In rad/s and rad/s², or m/s and m/s².

    Returns
    -------
    (N, 4) array
        Acceleration, velocity, its sign, and one.
    """
    return np.ascontiguousarray(regressor_rows(velocity, acceleration).T, dtype=np.float64)


def regressor_rows(
    velocity: NDArray[np.float64], acceleration: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Columns of `regressor` as rows, (4, N), as filters take them."""
    return np.stack([acceleration, velocity, np.sign(velocity), np.ones_like(velocity)])


@dataclass(frozen=True)
class Term:
    """The base term or one effect, with its values.

    Attributes
    ----------
    effect : str
        `BASE`, or a name from the catalogue.
    values : mapping of parameter name to float or (D,) array
        SI; arrays for D drives at once.
    std : mapping of parameter name to float
        Standard deviations, where known.
    source_axis : str or None
        The axis that acts on this one, for effects that need one.
    supported : SupportedRange or None
        Where samples supported the term; None where that is not known.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.Term("stribeck_friction", {"level": 0.3, "speed": 0.05}).values["level"]
    0.3
    """

    effect: str
    values: Mapping[str, float | NDArray[np.float64]]
    std: Mapping[str, float] = field(default_factory=dict)
    source_axis: str | None = None
    supported: SupportedRange | None = None


@dataclass(frozen=True)
class AxisModel:
    """One axis: the base term first, then effects, those of the actuator from inside outwards.

    Attributes
    ----------
    terms : tuple of Term
    position_unit : "rad" or "m"
    effort_unit : "N*m", "N", "A" or "V"

    Examples
    --------
    >>> import edge_ident
    >>> axis = edge_ident.reduced_model().axes["x"]
    >>> [term.effect for term in axis.terms]
    ['rigid_body']
    """

    terms: tuple[Term, ...]
    position_unit: str = "rad"
    effort_unit: str = "N*m"

    @property
    def units(self) -> tuple[str, str]:
        """Units of position and effort."""
        return self.position_unit, self.effort_unit

    @property
    def parameters(self) -> NDArray[np.float64]:
        """Values of the base term, (4,) or (D, 4), in the order of `PARAMETERS`."""
        values = [np.asarray(self.terms[0].values[name], dtype=np.float64) for name in PARAMETERS]
        return np.stack(np.broadcast_arrays(*values), axis=-1)

    @property
    def estimate(self) -> Estimate:
        """The base term of one drive: (4,) parameters and deviations, zero where none is known."""
        known = self.terms[0].std
        return Estimate(self.parameters, np.array([known.get(name, 0.0) for name in PARAMETERS]))


@dataclass(frozen=True)
class SourceFile:
    """A recording that a model was made from."""

    file: str
    sha256: str


@dataclass(frozen=True, repr=False)
class Model(Readable):
    """All axes of a drive, and where the numbers come from.

    `table` has a row for each parameter of each term.

    Attributes
    ----------
    axes : mapping of axis name to AxisModel
    recordings : tuple of SourceFile
    versions : mapping of package name to version

    Examples
    --------
    >>> import edge_ident
    >>> model = edge_ident.reduced_model()
    >>> {name: axis.effort_unit for name, axis in model.axes.items()}
    {'x': 'N*m', 'z': 'N*m'}
    """

    axes: Mapping[str, AxisModel]
    recordings: tuple[SourceFile, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_type(self.axes, Mapping, "give the axes of a model by name")
        for axis in self.axes.values():
            check_type(axis, AxisModel, "give an AxisModel for each axis")

    @property
    def passive(self) -> list[str]:
        """Axes that no drive moves, and that act on those of the model."""
        terms = (term for axis in self.axes.values() for term in axis.terms)
        acting = {name for term in terms for name in axes_of(term.source_axis, self.axes)}
        return sorted(acting.difference(self.axes))

    def for_axes(self, names: Iterable[str]) -> "Model":
        """This model for the axes of a machine; where both have one, it goes by the machine's name.

        Parameters
        ----------
        names : iterable of str
            Of the machine's axes.

        Raises
        ------
        ModelError
            The model has none of these axes, and which is which is not certain.

        Examples
        --------
        >>> import edge_ident
        >>> both = edge_ident.reduced_model()
        >>> list(edge_ident.Model({"x": both.axes["x"]}).for_axes(["joint1"]).axes)
        ['joint1']
        """
        wanted = list(names)
        if any(name in self.axes for name in wanted):
            return self
        if len(wanted) == len(self.axes) == 1:
            return replace(self, axes=dict(zip(wanted, self.axes.values(), strict=True)))
        raise ModelError(
            f"the model describes {', '.join(self.axes)}, not {', '.join(wanted)}",
            "give the model of this drive, or name its axes as the machine does",
        )


def base_axis(
    estimate: Estimate,
    position_unit: str = "rad",
    effort_unit: str = "N*m",
    supported: SupportedRange | None = None,
) -> AxisModel:
    """Model of an axis of which nothing but the base parameters is known."""
    values = dict(zip(PARAMETERS, estimate.parameters.tolist(), strict=True))
    std = dict(zip(PARAMETERS, estimate.std.tolist(), strict=True))
    return AxisModel((Term(BASE, values, std, supported=supported),), position_unit, effort_unit)


def effect_names(axis: AxisModel) -> tuple[str, ...]:
    """Names of an axis's effects, in the order of its terms."""
    return tuple(term.effect for term in axis.terms[1:])


def inertia_unit(position_unit: str, effort_unit: str) -> str:
    """Effort per acceleration, by its usual name where it has one."""
    usual = {("rad", "N*m"): "kg*m^2", ("m", "N"): "kg"}
    return usual.get((position_unit, effort_unit), f"{effort_unit}*s^2/{position_unit}")

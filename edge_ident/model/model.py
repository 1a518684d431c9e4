"""The model of a drive: terms per axis, the first of them the base term.

The base model is rigid body and friction, linear in its four parameters:

effort = inertia·a + viscous_friction·v + coulomb_friction·sign(v) + offset

It reconstructs the paper's reduced model. The text fixes four coefficients per axis, three positive
and one of either sign, but not their names. Further terms are effects of the catalogue
(`edge_ident.model.effects`).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.model.sources import axes_of
from edge_ident.model.supported_range import SupportedRange
from edge_ident.support.readable import Readable

if TYPE_CHECKING:
    from rich.console import RenderableType

    from edge_ident.support.rows import Table

PARAMETERS: Final = ("inertia", "viscous_friction", "coulomb_friction", "offset")
POSITIVE: Final = np.array([True, True, True, False])
"""Which parameters physics requires to be positive; the offset may have either sign."""
BOARD_UNITS: Final = ("rad", "N*m")
"""Units of position and effort in which a board's limits and gains are."""
BASE: Final = "rigid_body"
"""Name of the base term."""
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

    def table(self) -> "Table":
        """One row for each parameter of each term.

        Returns
        -------
        mapping of column name to list
            What a data frame takes.
        """
        from edge_ident.model.model_table import model_table

        return model_table(self)

    def __rich__(self) -> "RenderableType":
        from edge_ident.model.model_table import model_table
        from edge_ident.support.rows import shown

        return shown(model_table(self), "model")


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

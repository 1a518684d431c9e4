"""The friction of an axis over its speed, by direction, whatever laws it is made of.

Terms of a model may trade places: how much of the friction is viscous, a recording may not tell.
Their sum at constant speeds it shows. That is the curve, the mean over the stroke.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.model import NORMAL_90, AxisModel, Estimate, SupportedRange

if TYPE_CHECKING:
    from edge_ident.diagnosis.error_budget import AgreeingCurve

Array = NDArray[np.float64]

_POINTS: Final = 21
_PLACES: Final = 16


@dataclass(frozen=True)
class FrictionCurve:
    """Effort at constant speeds, offset included, with 90 % bands.

    Attributes
    ----------
    speed : (P,) array
        From zero to the highest speed that was visited, in both directions if it went both ways;
        finer at low ones.
    forward, backward : (P,) arrays
        Effort in the positive and in the negative direction.
    deviation : (P,) array
        Half the width of the band of either.
    speed_unit, unit : str

    Examples
    --------
    >>> import edge_ident
    >>> curve = edge_ident.identify(edge_ident.simulate()).axes["x"].friction_curve
    >>> bool(curve.forward[-1] > curve.forward[0] > 0.0 > curve.backward[0])
    True
    """

    speed: Array
    forward: Array
    backward: Array
    deviation: Array
    speed_unit: str
    unit: str

    def document(self) -> dict[str, Any]:
        """For scripts."""
        return {
            "speed": {"values": self.speed.tolist(), "unit": self.speed_unit},
            **{
                way: {
                    "values": effort.tolist(),
                    "low": (effort - self.deviation).tolist(),
                    "high": (effort + self.deviation).tolist(),
                }
                for way, effort in (("forward", self.forward), ("backward", self.backward))
            },
            "coverage": 0.9,
            "unit": self.unit,
        }

    def table(self) -> dict[str, list[Any]]:
        """One row for each speed.

        Returns
        -------
        mapping of column name to list
            What a data frame takes.
        """
        return {
            "speed": self.speed.tolist(),
            "forward": self.forward.tolist(),
            "backward": self.backward.tolist(),
            "deviation": self.deviation.tolist(),
        }


def friction_curve(
    model: AxisModel, line: Estimate, curves: "Sequence[AgreeingCurve]" = ()
) -> FrictionCurve | None:
    """The friction curve of a model; None where it does not say at which speeds it was seen.

    Parameters
    ----------
    model : AxisModel
    line : Estimate
        With friction as the line through the curve; the band has its deviations.
    curves : sequence of AgreeingCurve
        Of the model; the band has theirs as well.
    """
    seen = model.terms[0].supported
    if seen is None:
        return None
    low, high = seen.speed
    both_ways = low < 0.0 < high
    top = min(-low, high) if both_ways else max(-low, high)
    speed = top * np.linspace(0.0, 1.0, _POINTS) ** 2
    _, viscous, coulomb, offset = line.std
    # deviations are taken to be independent: where they are not, the band is too wide
    variance = (speed * viscous) ** 2 + coulomb**2 + offset**2
    for curve in (one.curve for one in curves if one.curve.over == "speed"):
        half = np.interp(speed, curve.coordinate, 0.5 * (curve.high - curve.low))
        variance = variance + (half / NORMAL_90) ** 2
    forward, backward = (_at_constant(model, way * speed, way, seen) for way in (1.0, -1.0))
    position_unit, unit = model.units
    deviation = NORMAL_90 * np.sqrt(variance)
    return FrictionCurve(speed, forward, backward, deviation, f"{position_unit}/s", unit)


def _at_constant(model: AxisModel, velocity: Array, way: float, seen: SupportedRange) -> Array:
    """Effort (P,) at constant velocities in one direction, the mean over the stroke."""
    _, viscous, coulomb, offset = model.parameters
    base: Array = viscous * velocity + coulomb * way + offset
    return base if len(model.terms) == 1 else base + _of_terms(model, velocity, way, seen)


def _of_terms(model: AxisModel, velocity: Array, way: float, seen: SupportedRange) -> Array:
    """The same of terms that are friction and depend on place and speed alone."""
    from edge_ident.model.effects import named  # sound axes have no terms, and start faster
    from edge_ident.model.inverse import steady_effort

    place, pace = np.meshgrid(np.linspace(*seen.position, _PLACES), velocity)
    found = np.zeros(place.shape)
    for term in model.terms[1:]:
        effect = named(term.effect)
        elsewhere = effect.tied_to_time or effect.memory_size or effect.has_source(term.source_axis)
        if effect.search.shares_friction and not elsewhere:
            found = found + steady_effort(term, place, pace, way)
    mean: Array = found.mean(axis=1)
    return mean

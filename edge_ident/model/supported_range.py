"""The range in which a term was supported, and what leaves it.

A formula is known to hold where samples supported it. Beyond, it is a guess: a limit may lie
elsewhere, a play may end, an order may have another amplitude. So a model file carries the range of
each term, and whoever uses the model says where a motion leaves it.
"""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Interval = tuple[float, float]

QUANTITIES: Final = ("position", "speed", "acceleration", "effort")
"""What a range covers, in the order in which it is reported."""
_MARGIN: Final = 0.125
"""Width beyond either end that still counts as inside, of the interval. The ends are extremes of
filtered signals, and another bandwidth or noise moves those by a few percent. At the start the
diagnosis leaves out at most a ninth of it, where friction and play remember earlier motion."""


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
    >>> from edge_ident.model.supported_range import SupportedRange
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

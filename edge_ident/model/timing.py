"""The shift that a digital controller brings into a record; part of every model."""

from dataclasses import dataclass
from typing import Final

LARGEST_SHIFT: Final = 1.5
"""Largest shift of a controller's timing, in sampling periods: one for its calculation, half a one
because its command is held."""


@dataclass(frozen=True)
class Timing:
    """Shift between effort and position, part of the base model.

    Attributes
    ----------
    shift_s : float
        By which the effort is recorded late, beyond what the recording states.
    shift_samples, std_samples : float
        The same in sampling periods, and its standard deviation.
    """

    shift_s: float = 0.0
    shift_samples: float = 0.0
    std_samples: float = 0.0


NO_SHIFT: Final = Timing()

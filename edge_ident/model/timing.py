"""The shift that a digital controller brings into a record; part of every model."""

import math
from dataclasses import dataclass
from typing import Final

LARGEST_SHIFT: Final = 1.5
"""Largest shift of a controller's timing, in sampling periods: one for its calculation, half a one
because its command is held."""
EVEN_SHIFT: Final = LARGEST_SHIFT / math.sqrt(3.0)
"""Standard deviation of a shift of which only its limits are known, in sampling periods."""
_UNKNOWN: Final = 0.9
"""Deviation, of that, from which a recording says hardly anything of the shift."""


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

    @property
    def unknown(self) -> bool:
        """Whether the recording says hardly more of the shift than its limits."""
        return self.std_samples > _UNKNOWN * EVEN_SHIFT


NO_SHIFT: Final = Timing()

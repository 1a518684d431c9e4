"""The built-in drive: its full flexible model as a plant of the loop, and its reduced model."""

from dataclasses import asdict
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.model import BASE, AxisModel, Model, Term
from firmware_interface.plant.feed_drive import FEED_DRIVE, feed_drive
from firmware_interface.plant.plant import Plant

Array = NDArray[np.float64]

DELAY_SHARE: Final = 0.2
"""Share of a sampling period from reading the encoders to the new effort: 0.5 of 2.5 ms."""


class FlexibleMachine:
    """The virtual board's drive; its control delay is `DELAY_SHARE` of the sampling period.

    Parameters
    ----------
    period_s : float
    """

    def __init__(self, period_s: float) -> None:
        self._plant = Plant(feed_drive(), sample_s=period_s, delay=DELAY_SHARE)

    @property
    def position(self) -> Array:
        """Position at the gearbox output, (A, 1)."""
        return np.array(self._plant.output_rad)[:, None]

    @property
    def velocity(self) -> Array:
        """Velocity at the gearbox output, (A, 1)."""
        return np.array(self._plant.output_rad_s)[:, None]

    @property
    def reading(self) -> Array:
        """The encoders are true."""
        return self.position

    def set_time(self, time_s: float) -> None:
        """Nothing in it depends on time."""

    def advance(self, before: Array, command: Array) -> None:
        """Let a sample pass."""
        self._plant.advance(command[:, 0].tolist())

    def recorded(self, command: Array, time_s: Array) -> Array:
        """The board records what it commands."""
        return command


def reduced_model() -> Model:
    """The built-in drive when nothing deforms: the paper's four parameters an axis.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.reduced_model().axes["x"].parameters.round(2).tolist()
    [0.43, 0.9, 1.4, 0.03]
    """
    return Model(
        {name: AxisModel((Term(BASE, asdict(body)),)) for name, body in FEED_DRIVE.items()}
    )

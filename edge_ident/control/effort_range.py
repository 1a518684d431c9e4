"""What feed-forward asks for at constant speed, anywhere in the range that supports a model.

Acceleration is not counted: how much of it a motion takes is the motion's choice, and the board
refuses a motion whose feed-forward asks for more than the effort limit.
"""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from edge_ident.model.model import AxisModel
from firmware_interface.control_law import feedforward_nm
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Reference

_POSITIONS: Final = 400
_SPEEDS: Final = 61


@dataclass(frozen=True)
class EffortRange:
    """Constant speeds that are supported, everywhere along the supported positions.

    Attributes
    ----------
    motion : Reference
        (P·V,) samples without acceleration.
    top_speed, top_acceleration : float
        Largest that are supported, in either direction.
    """

    motion: Reference
    top_speed: float
    top_acceleration: float

    @classmethod
    def of(cls, axis: AxisModel) -> Self | None:
        """The range of all terms of an axis; None where no term says it."""
        known = [term.supported for term in axis.terms if term.supported is not None]
        if not known:
            return None
        low, high = np.transpose([supported.position for supported in known])
        speeds = np.array([supported.speed for supported in known])
        accelerations = np.array([supported.acceleration for supported in known])
        position, velocity = np.meshgrid(
            np.linspace(low.min(), high.max(), _POSITIONS),
            np.linspace(speeds.min(), speeds.max(), _SPEEDS),
        )
        still = np.zeros(position.size)
        return cls(
            Reference(position.ravel(), velocity.ravel(), still),
            float(np.max(np.abs(speeds))),
            float(np.max(np.abs(accelerations))),
        )

    def largest_nm(self, gains: AxisGains) -> float:
        """Largest feed-forward, with what the law adds from its memory and for its actuator.

        The other axis is taken to be as fast as this one.
        """
        alone = float(np.max(np.abs(feedforward_nm(gains, self.motion, np))))
        other = abs(gains.cross_viscous_feedforward) * self.top_speed
        return (
            alone
            + other
            + abs(gains.cross_coulomb_feedforward)
            + gains.presliding_feedforward
            + gains.deadband_inverse
        )

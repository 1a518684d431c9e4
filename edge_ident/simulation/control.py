"""The board's control law (`firmware_interface.gains`) for all axes of many drives at once."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from firmware_interface.gains import AxisGains

Array = NDArray[np.float64]


class Controllers:
    """What the laws remember: last position, filtered velocity, integrated error.

    Parameters
    ----------
    gains : mapping of axis name to sequence of AxisGains
        One for all drives, or one for each.
    period_s : float
    position : (A, D) array
        Where the axes stand.
    """

    def __init__(
        self, gains: Mapping[str, Sequence[AxisGains]], period_s: float, position: Array
    ) -> None:
        self._gains = SimpleNamespace(
            **{
                field.name: np.array(
                    [
                        np.broadcast_to(
                            [getattr(g, field.name) for g in of_axis], position.shape[1]
                        )
                        for of_axis in gains.values()
                    ]
                )
                for field in fields(AxisGains)
            }
        )
        self._period_s = period_s
        self._last = position.copy()
        self._velocity = np.zeros(position.shape)
        self._integral = np.zeros(position.shape)

    def effort(self, reference: Array, position: Array) -> Array:
        """Efforts (A, D) for the positions just read.

        Parameters
        ----------
        reference : (3, A) array
            Position, velocity and acceleration wanted now.
        position : (A, D) array
        """
        gains, period_s = self._gains, self._period_s
        wanted, velocity, acceleration = reference[:, :, None]
        difference = (position - self._last) / period_s
        self._last = position.copy()
        share = period_s / (gains.velocity_filter_s + period_s)
        self._velocity += share * (difference - self._velocity)
        error = wanted - position
        self._integral += gains.integral * error * period_s
        return np.asarray(
            gains.proportional * error
            + gains.derivative * (velocity - self._velocity)
            + self._integral
            + gains.inertia_feedforward * acceleration
            + gains.viscous_feedforward * velocity
            + gains.coulomb_feedforward * np.tanh(velocity / gains.coulomb_smoothing_rad_s)
            + gains.offset_feedforward
        )

"""The board's control law (`firmware_interface.gains`) for all axes of many drives at once."""

from collections.abc import Iterable, Mapping, Sequence
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
                field.name: _stacked(field.name, gains.values(), position.shape[1])
                for field in fields(AxisGains)
            }
        )
        self._extended = any(
            np.any(getattr(self._gains, name))
            for name in (
                "stribeck_feedforward",
                "viscous_difference_feedforward",
                "ripple_cosine",
                "ripple_sine",
            )
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
        sign = np.tanh(velocity / gains.coulomb_smoothing_rad_s)
        effort = np.asarray(
            gains.proportional * error
            + gains.derivative * (velocity - self._velocity)
            + self._integral
            + gains.inertia_feedforward * acceleration
            + gains.viscous_feedforward * velocity
            + gains.coulomb_feedforward * sign
            + gains.offset_feedforward
        )
        if not self._extended:  # most simulated drives, and these terms take long
            return effort
        angle = 2.0 * np.pi * wanted / gains.ripple_period_rad
        ripple = gains.ripple_cosine * np.cos(angle) + gains.ripple_sine * np.sin(angle)
        bump = np.exp(-((velocity / gains.stribeck_speed_rad_s) ** 2))
        return np.asarray(
            effort
            + gains.stribeck_feedforward * bump * sign
            + gains.viscous_difference_feedforward * np.abs(velocity)
            + np.sum(ripple, axis=0)
        )


def _stacked(name: str, gains: Iterable[Sequence[AxisGains]], drives: int) -> Array:
    """One number of the law (A, D), or one table (K, A, D)."""
    rows = [np.array([getattr(g, name) for g in of_axis]).T for of_axis in gains]
    return np.stack([np.broadcast_to(r, (*r.shape[:-1], drives)) for r in rows], axis=-2)

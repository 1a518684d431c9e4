"""The control law of the board (`firmware_interface.control_law`), many drives at once."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from firmware_interface.control_law import deadband_nm, feedforward_nm
from firmware_interface.gains import AxisGains
from firmware_interface.law_memory import NOTHING
from firmware_interface.motion import Reference

Array = NDArray[np.float64]

_COUPLED: Final = 2
"""Axes among which each has one other."""


class Controllers:
    """What the laws remember: last position and reference, filtered velocity, and states.

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
        stacked: dict[str, Any] = {
            field.name: _stacked(field.name, gains.values(), position.shape[1])
            for field in fields(AxisGains)
        }
        self._gains = AxisGains(**stacked)
        self._period_s = period_s
        self._last = position.copy()
        self._velocity = np.zeros(position.shape)
        self._integral = np.zeros(position.shape)
        self._memory = NOTHING
        self._reference: Array | None = None

    def effort(self, reference: Array, position: Array) -> Array:
        """Efforts (A, D) for the positions just read.

        Parameters
        ----------
        reference : (3, A) array
            Position, velocity and acceleration wanted now.
        position : (A, D) array
        """
        gains, period_s = self._gains, self._period_s
        setpoint, other = Reference(*reference[:, :, None]), None
        if "cross" in gains.terms and len(position) == _COUPLED:
            other = Reference(*reference[:, ::-1, None])
        difference = (position - self._last) / period_s
        self._last = position.copy()
        share = period_s / (gains.velocity_filter_s + period_s)
        self._velocity += share * (difference - self._velocity)
        error = self._followed(setpoint.position_rad) - position
        self._integral += gains.integral * error * period_s
        feedback = (
            gains.proportional * error
            + gains.derivative * (setpoint.velocity_rad_s - self._velocity)
            + self._integral
        )
        effort = feedforward_nm(gains, setpoint, np, other, self._memory, feedback)
        return np.asarray(deadband_nm(gains, effort, np))

    def _followed(self, reference: Array) -> Array:
        """The reference with the way across the backlash."""
        if not self._gains.terms & {"presliding", "backlash"}:
            return reference
        before = reference if self._reference is None else self._reference
        self._memory = self._memory.after(self._gains, reference - before, np)
        self._reference = reference
        return np.asarray(reference + self._memory.backlash_rad)


def _stacked(name: str, gains: Iterable[Sequence[AxisGains]], drives: int) -> Array:
    """One number of the law (A, D), or one table (K, A, D)."""
    rows = [np.array([getattr(g, name) for g in of_axis]).T for of_axis in gains]
    return np.stack([np.broadcast_to(r, (*r.shape[:-1], drives)) for r in rows], axis=-2)

"""The control law of `firmware_interface.gains`, sample by sample, for one axis."""

import math
from typing import NamedTuple

from firmware_interface.gains import AxisGains, feedforward_nm


class Setpoint(NamedTuple):
    """Where an axis should be now: rad, rad/s, rad/s^2."""

    position_rad: float
    velocity_rad_s: float
    acceleration_rad_s2: float

    @property
    def finite(self) -> bool:
        """All three are numbers."""
        return all(map(math.isfinite, self))


class AxisController:
    """Holds what the law remembers: last position, filtered velocity, integrated error.

    Parameters
    ----------
    gains : AxisGains
        May be exchanged between samples.
    period_s : float
    effort_limit_nm : float
        The effort is clipped to it, and the integral part stops growing there.

    Attributes
    ----------
    finite : bool
        Since the last reset every effort was a number before it was clipped; one that was not
        became 0.
    """

    def __init__(self, gains: AxisGains, period_s: float, effort_limit_nm: float) -> None:
        self.gains = gains
        self._period_s = period_s
        self._limit_nm = effort_limit_nm
        self.reset(0.0)

    def reset(self, position_rad: float) -> None:
        """Forget the past: the axis stands still at this position."""
        self._last_rad = position_rad
        self._velocity_rad_s = 0.0
        self._integral_nm = 0.0
        self.finite = True

    def effort_nm(self, setpoint: Setpoint, position_rad: float) -> float:
        """Effort for the position just latched."""
        gains, period = self.gains, self._period_s
        difference = (position_rad - self._last_rad) / period
        self._last_rad = position_rad
        self._velocity_rad_s += (
            period / (gains.velocity_filter_s + period) * (difference - self._velocity_rad_s)
        )
        error = setpoint.position_rad - position_rad
        self._integral_nm = self._clip(self._integral_nm + gains.integral * error * period)
        return self._clip(
            gains.proportional * error
            + gains.derivative * (setpoint.velocity_rad_s - self._velocity_rad_s)
            + self._integral_nm
            + feedforward_nm(gains, setpoint)
        )

    def _clip(self, effort_nm: float) -> float:
        """Within the limit; what is no number must not become full effort."""
        if not math.isfinite(effort_nm):
            self.finite = False
            return 0.0
        return min(max(effort_nm, -self._limit_nm), self._limit_nm)

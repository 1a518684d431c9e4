"""The control law of `firmware_interface.control_law`, sample by sample, for one axis."""

import math
from typing import NamedTuple

from firmware_interface.control_law import deadband_nm, feedforward_nm
from firmware_interface.gains import AxisGains
from firmware_interface.law_memory import NOTHING


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
    """Holds what the law remembers: last position and reference, filtered velocity, and states.

    Parameters
    ----------
    gains : AxisGains
    period_s : float
    effort_limit_nm : float
        The effort is clipped to it, and the integral part stops growing there.

    Attributes
    ----------
    gains : AxisGains
    memory : Memory
        What the law remembers of the reference.
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
        self._hold_reference(position_rad)

    def exchange(self, gains: AxisGains, position_rad: float) -> None:
        """Go on with other gains; the reference is held at this position."""
        self.gains = gains
        self._hold_reference(position_rad)

    def _hold_reference(self, position_rad: float) -> None:
        self._reference_rad = position_rad
        self.memory = NOTHING

    def effort_nm(
        self, setpoint: Setpoint, position_rad: float, other: Setpoint | None = None
    ) -> float:
        """Effort for the position just latched; the other axis's setpoint, where there is one."""
        gains, period = self.gains, self._period_s
        difference = (position_rad - self._last_rad) / period
        self._last_rad = position_rad
        self._velocity_rad_s += (
            period / (gains.velocity_filter_s + period) * (difference - self._velocity_rad_s)
        )
        self.memory = self.memory.after(gains, setpoint.position_rad - self._reference_rad)
        self._reference_rad = setpoint.position_rad
        error = setpoint.position_rad + self.memory.backlash_rad - position_rad
        self._integral_nm = self._clip(self._integral_nm + gains.integral * error * period)
        effort_nm = (
            gains.proportional * error
            + gains.derivative * (setpoint.velocity_rad_s - self._velocity_rad_s)
            + self._integral_nm
            + feedforward_nm(gains, setpoint, other=other, memory=self.memory)
        )
        return self._clip(deadband_nm(gains, effort_nm))

    def _clip(self, effort_nm: float) -> float:
        """Within the limit; what is no number must not become full effort."""
        if not math.isfinite(effort_nm):
            self.finite = False
            return 0.0
        return min(max(effort_nm, -self._limit_nm), self._limit_nm)

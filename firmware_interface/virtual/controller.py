"""The control law of `firmware_interface.gains`, sample by sample, for one axis."""

import math
from types import ModuleType
from typing import Any, NamedTuple

from firmware_interface.gains import AxisGains


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


def feedforward_nm(gains: AxisGains, setpoint: Any, functions: ModuleType = math) -> Any:
    """What the reference alone asks for.

    Parameters
    ----------
    gains : AxisGains
    setpoint : Setpoint or Reference
        A finite one, or a stretch of them.
    functions : module
        `math`, or numpy for a stretch.
    """
    velocity = setpoint.velocity_rad_s
    slowness = velocity / gains.stribeck_speed_rad_s
    bump = functions.exp(-slowness * slowness)
    effort = (
        gains.inertia_feedforward * setpoint.acceleration_rad_s2
        + gains.viscous_feedforward * velocity
        + gains.viscous_difference_feedforward * abs(velocity)
        + (gains.coulomb_feedforward + gains.stribeck_feedforward * bump)
        * functions.tanh(velocity / gains.coulomb_smoothing_rad_s)
        + gains.offset_feedforward
    )
    for cosine, sine, period in zip(
        gains.ripple_cosine, gains.ripple_sine, gains.ripple_period_rad, strict=True
    ):
        if cosine or sine:
            angle = 2.0 * math.pi * setpoint.position_rad / period
            effort = effort + cosine * functions.cos(angle) + sine * functions.sin(angle)
    return effort

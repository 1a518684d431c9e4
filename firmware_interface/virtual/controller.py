"""The control law of `firmware_interface.gains`, sample by sample, for one axis."""

import math
from typing import NamedTuple

from firmware_interface.gains import AxisGains


class Setpoint(NamedTuple):
    """Where an axis should be now: rad, rad/s, rad/s^2."""

    position_rad: float
    velocity_rad_s: float
    acceleration_rad_s2: float


class AxisController:
    """Holds what the law remembers: last position, filtered velocity, integrated error.

    Parameters
    ----------
    gains : AxisGains
        May be exchanged between samples.
    period_s : float
    effort_limit_nm : float
        The effort is clipped to it, and the integral part stops growing there.
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

    def effort_nm(self, setpoint: Setpoint, position_rad: float) -> float:
        """Effort for the position just latched."""
        gains, period = self.gains, self._period_s
        difference = (position_rad - self._last_rad) / period
        self._last_rad = position_rad
        self._velocity_rad_s += (
            period / (gains.velocity_filter_s + period) * (difference - self._velocity_rad_s)
        )
        error = setpoint.position_rad - position_rad
        integral = self._integral_nm + gains.integral * error * period
        self._integral_nm = min(max(integral, -self._limit_nm), self._limit_nm)
        effort = (
            gains.proportional * error
            + gains.derivative * (setpoint.velocity_rad_s - self._velocity_rad_s)
            + self._integral_nm
            + _feedforward_nm(gains, setpoint)
        )
        return min(max(effort, -self._limit_nm), self._limit_nm)


def _feedforward_nm(gains: AxisGains, setpoint: Setpoint) -> float:
    """What the reference alone asks for."""
    velocity = setpoint.velocity_rad_s
    bump = math.exp(-((velocity / gains.stribeck_speed_rad_s) ** 2))
    effort = (
        gains.inertia_feedforward * setpoint.acceleration_rad_s2
        + gains.viscous_feedforward * velocity
        + gains.viscous_difference_feedforward * abs(velocity)
        + (gains.coulomb_feedforward + gains.stribeck_feedforward * bump)
        * math.tanh(velocity / gains.coulomb_smoothing_rad_s)
        + gains.offset_feedforward
    )
    for cosine, sine, period in zip(
        gains.ripple_cosine, gains.ripple_sine, gains.ripple_period_rad, strict=True
    ):
        if cosine or sine:
            angle = 2.0 * math.pi * setpoint.position_rad / period
            effort += cosine * math.cos(angle) + sine * math.sin(angle)
    return effort

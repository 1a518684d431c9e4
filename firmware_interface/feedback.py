"""The poles of an axis' position loop, sample by sample, as a rigid body."""

import math

import numpy as np
from numpy.polynomial import Polynomial

from firmware_interface.gains import AxisGains

_DIFFERENCE = Polynomial([1.0, -1.0])
"""1 - w, where w = 1 / z delays by one sample; all polynomials here are in w."""


def feedback_poles(
    gains: AxisGains,
    inertia: float,
    viscous_friction: float,
    *,
    period_s: float,
    control_delay_s: float,
) -> np.ndarray:
    """Poles of the sampled loop: the law without feed-forward and dead band, on a rigid body.

    Parameters
    ----------
    gains : AxisGains
    inertia : float
        kg·m², at the gearbox output; positive.
    viscous_friction : float
        N·m·s/rad.
    period_s, control_delay_s : float
        Of the loop; from the encoder latch to the effort that follows from it.

    Returns
    -------
    (n,) complex array
        In z: the loop is stable where all are smaller than 1. A law without proportional and
        integral part leaves the position free, which counts as no pole.

    Notes
    -----
    The effort acts from the delay after the latch for one period, so that the plant is exact
    (modified z-transform: Åström and Wittenmark, Computer-Controlled Systems, section 2.3).
    """
    over, under = _plant(inertia, viscous_friction, period_s, control_delay_s)
    taken = period_s / (gains.velocity_filter_s + period_s)
    velocity_filter = Polynomial([1.0, taken - 1.0])
    law, free = Polynomial([gains.derivative * taken / period_s]), velocity_filter * under
    if gains.proportional > 0.0 or gains.integral > 0.0:
        law = law * _DIFFERENCE + gains.proportional * velocity_filter
        free *= _DIFFERENCE
    if gains.integral > 0.0:
        law = law * _DIFFERENCE + gains.integral * period_s * velocity_filter
        free *= _DIFFERENCE
    # as one in z: its leading coefficient is 1, that in w may be nothing but rounding
    return np.roots((free + law * over).coef)


def feedback_stable(
    gains: AxisGains,
    inertia: float,
    viscous_friction: float,
    *,
    period_s: float,
    control_delay_s: float,
) -> bool:
    """Whether all poles decay; a loop without feedback is stable. See `feedback_poles`."""
    if not (gains.proportional or gains.derivative or gains.integral):
        return True
    poles = feedback_poles(
        gains, inertia, viscous_friction, period_s=period_s, control_delay_s=control_delay_s
    )
    return bool(np.all(np.abs(poles) < 1.0))


def _plant(
    inertia: float, friction: float, period_s: float, delay_s: float
) -> tuple[Polynomial, Polynomial]:
    """Position over effort; the denominator without the factor 1 - w of the integration."""

    def moved(time_s: float) -> float:
        """Position after a unit effort for so long."""
        share = friction * time_s / inertia
        if share < 1e-4:
            return time_s**2 / (2.0 * inertia) * (1.0 - share / 3.0)
        return (time_s + inertia / friction * math.expm1(-share)) / friction

    late, rest_s = divmod(delay_s, period_s)
    decay = math.exp(-friction * period_s / inertia)
    pulse = np.diff([0.0, *(moved(k * period_s - rest_s) for k in (1, 2, 3))])
    under = Polynomial([1.0, -decay])
    over = Polynomial((Polynomial(pulse) * _DIFFERENCE * under).coef[:3])
    return over * Polynomial([0.0] * (int(late) + 1) + [1.0]), under

"""The board's control law and its gains.

With e = reference - position, all at the gearbox output::

    effort = proportional * e
           + derivative * (reference velocity - filtered velocity)
           + integral * sum(e) * period
           + inertia_feedforward * reference acceleration
           + viscous_feedforward * reference velocity
           + coulomb_feedforward * tanh(reference velocity / coulomb_smoothing)
           + offset_feedforward

The filtered velocity is the backward difference of the measured position, passed through a
first-order filter of time constant velocity_filter::

    w[k] = w[k-1] + period / (velocity_filter + period) * (difference[k] - w[k-1])
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class AxisGains:
    """Gains of one axis.

    Attributes
    ----------
    proportional : float
        N*m/rad.
    derivative : float
        N*m*s/rad.
    integral : float
        N*m/(rad*s).
    velocity_filter_s : float
        Time constant of the velocity filter, s; 0 switches it off.
    inertia_feedforward : float
        kg*m^2.
    viscous_feedforward : float
        N*m*s/rad.
    coulomb_feedforward : float
        N*m.
    coulomb_smoothing_rad_s : float
        rad/s, positive.
    offset_feedforward : float
        N*m.
    """

    proportional: float
    derivative: float
    integral: float
    velocity_filter_s: float
    inertia_feedforward: float
    viscous_feedforward: float
    coulomb_feedforward: float
    coulomb_smoothing_rad_s: float
    offset_feedforward: float

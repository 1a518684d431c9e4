"""The board's control law.

With e = followed - position, d = tanh(v / coulomb_smoothing), all at the gearbox output, and
r, v, a the reference's position, velocity and acceleration::

    followed = r + b
    effort = proportional * e
           + derivative * (v - filtered velocity)
           + integral * sum(e) * period
           + inertia_feedforward * a
           + viscous_feedforward * v
           + viscous_difference_feedforward * |v|
           + (coulomb_feedforward + stribeck_feedforward * exp(-(v / stribeck_speed)^2)) * d
           + offset_feedforward
           + sum over k of fade(ripple_fade_speed[k])
             * (ripple_cosine[k] * cos(2 pi * followed / ripple_period[k])
                + ripple_sine[k] * sin(2 pi * followed / ripple_period[k]))
           + curve(v) * d
           + fade(table_fade_speed) * (load_table(followed) + local_friction_table(followed) * d)
           + presliding_feedforward * z
           + cross_inertia_feedforward * a_other + cross_viscous_feedforward * v_other
           + cross_coulomb_feedforward * tanh(v_other / coulomb_smoothing)
           + y / (1 - transmission_loss * d * sign(y)) - y
    y      = transmitted_inertia * a + offset_feedforward
           + transmitted_friction * (viscous_feedforward * v + coulomb_feedforward * d)
    output = effort + deadband_inverse * tanh(effort / deadband_smoothing)

The sum of the errors takes in the present one; what it contributes is kept within the effort
limit, and so is the output.

The filtered velocity is the backward difference of the measured position, passed through a
first-order filter of time constant velocity_filter::

    w[k] = w[k-1] + period / (velocity_filter + period) * (difference[k] - w[k-1])

Positions count from the encoder's zero. The tables over position have their entry k at
table_start + k * table_step. The friction curve is friction_forward for v > 0, else
friction_backward, with entry k at |v| = friction_top_speed * (k / 11)^2; it is linear in the root
of |v|. Each table is linear between its entries, and falls to zero over one cell beyond its ends.
fade(f) is 1 up to |v| = f and falls linearly to 0 at 2 f; with f = 0 it is always 1.

z and b follow the reference. With its step dx since the sample before, and s = sign(dx)::

    z += (s - z) * (1 - exp(-|dx| / presliding_distance))
    b += (s * backlash_offset - b) * (1 - exp(-|dx| / backlash_distance))

Both are 0 where the controller is reset: when the effort is switched on, and when other gains
come into force at rest. The following error that a board records and limits is r - position,
without b.

Other gains that come into force while the law acts (COMMIT_RUNNING) take over all of its states:
last position, filtered velocity w, integral part in N*m, and z and b of the terms that they have.
With u_old the output of the gains that go, and u_new what the others ask for in the same sample,
not clipped::

    r, v   = measured + share * (reference before - measured),  0 <= share <= 1
    jump   = u_new(r, v) - u_old
    output = effort + deadband_inverse * tanh(effort / deadband_smoothing) + c
    c[k]   = -jump * exp(-k * period / CARRY_TIME_S)

So the reference begins anew between where the axis is (e = 0, and v = w while the axes come to
rest; where they are held, v = 0) and where it was, where the jump vanishes, as if it were linear
in the share; where it does not, at the end with the smaller one. That is a realizable reference.
What is left of the jump is bridged by c, so that in the sample of the exchange, k = 0, the output
is u_old. c decays by itself: in the integral part, its usual place, it would stay for ever where
the law does not integrate. A jump beyond the board's limit refuses the exchange.

Sources: Hanus, Kinnaert, Henrotte, Conditioning technique, a general anti-windup and bumpless
transfer method, Automatica 23 (1987); Astrom and Hagglund, PID Controllers, 2nd edition, on
bumpless changes of parameters.
"""

import math
from types import ModuleType
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from firmware_interface.gains import FRICTION_ENTRIES, AxisGains
from firmware_interface.interpolation import bounded, chosen, interpolated
from firmware_interface.law_memory import NOTHING, Memory
from firmware_interface.motion import Reference

Array = NDArray[np.float64]

CARRY_TIME_S: Final = 0.05
"""Time constant in which what bridges an exchange of gains decays. Five of them are the shortest
stop of the board: less than a hundredth is left when the axes stand."""
_TABLES: Final = frozenset({"load_table", "local_friction_table"})
_OVER_POSITION: Final = _TABLES | {"ripple"}


class Wanted(Protocol):
    """Where an axis should be: numbers, a stretch of samples, or many drives at once."""

    @property
    def position_rad(self) -> Any:
        """rad."""

    @property
    def velocity_rad_s(self) -> Any:
        """rad/s."""

    @property
    def acceleration_rad_s2(self) -> Any:
        """rad/s^2."""


def feedforward_nm(
    gains: AxisGains,
    setpoint: Wanted,
    functions: ModuleType = math,
    other: Wanted | None = None,
    memory: Memory = NOTHING,
    onto: Any = 0.0,
) -> Any:
    """What the reference alone asks for, before the inverse of the dead band.

    Parameters
    ----------
    gains : AxisGains
        For many drives at once its numbers are arrays, those of tables with entries first.
    setpoint : Setpoint or Reference
        A finite one, a stretch of them, or one for each drive.
    functions : module
        `math`, or numpy for arrays.
    other : Setpoint or Reference, optional
        Of the other axis; without it the cross terms are left out.
    memory : Memory
        At this setpoint.
    onto : float or array
        Effort that it is added to.
    """
    velocity, terms = setpoint.velocity_rad_s, gains.terms
    direction = functions.tanh(velocity / gains.coulomb_smoothing_rad_s)
    friction = gains.coulomb_feedforward
    if "stribeck" in terms:
        slowness = velocity / gains.stribeck_speed_rad_s
        friction = friction + gains.stribeck_feedforward * functions.exp(-slowness * slowness)
    effort = (
        onto
        + gains.inertia_feedforward * setpoint.acceleration_rad_s2
        + gains.viscous_feedforward * velocity
    )
    if "viscous_difference" in terms:
        effort = effort + gains.viscous_difference_feedforward * abs(velocity)
    effort = effort + friction * direction + gains.offset_feedforward
    if terms & _OVER_POSITION:
        effort = _over_position_nm(effort, gains, setpoint, direction, memory, functions)
    if "friction_curve" in terms:
        effort = effort + _curve_nm(gains, velocity, functions) * direction
    if "presliding" in terms:
        effort = effort + gains.presliding_feedforward * memory.presliding
    if "cross" in terms and other is not None:
        effort = effort + _cross_nm(gains, other, functions)
    if "transmission" in terms:
        effort = effort + _transmission_nm(gains, setpoint, direction, functions)
    return effort


def deadband_nm(gains: AxisGains, effort_nm: Any, functions: ModuleType = math) -> Any:
    """The output that has this effort behind the actuator's dead band."""
    if "deadband" not in gains.terms:
        return effort_nm
    share = functions.tanh(effort_nm / gains.deadband_smoothing)
    return effort_nm + gains.deadband_inverse * share


def exact_effort_nm(
    gains: AxisGains,
    way: Reference,
    other: Reference | None = None,
    start_rad: float | None = None,
    memory: Memory = NOTHING,
) -> tuple[Array, Memory]:
    """Outputs over a stretch where the axis follows exactly, and the memory at its end.

    Parameters
    ----------
    gains : AxisGains
    way : Reference
        Of (N,) arrays, as is the other.
    other : Reference, optional
        Of the other axis.
    start_rad : float, optional
        Reference at the sample before; by default that of the first sample.
    memory : Memory
        At that sample.
    """
    first = way.position_rad[0] if start_rad is None else start_rad
    memory = memory.along(gains, np.concatenate([[first], way.position_rad]))
    effort = feedforward_nm(gains, way, np, other, memory)
    return deadband_nm(gains, effort, np), memory.last


# ---- terms


def _over_position_nm(
    effort: Any,
    gains: AxisGains,
    setpoint: Wanted,
    direction: Any,
    memory: Memory,
    functions: ModuleType,
) -> Any:
    """The effort with ripples and both tables over position."""
    speed, terms = abs(setpoint.velocity_rad_s), gains.terms
    followed = setpoint.position_rad + memory.backlash_rad
    for k in gains.ripples:
        cosine, sine = gains.ripple_cosine[k], gains.ripple_sine[k]
        if "ripple_fade" in terms:
            share = _faded(speed, gains.ripple_fade_speed_rad_s[k], functions)
            cosine, sine = share * cosine, share * sine
        angle = 2.0 * math.pi * followed / gains.ripple_period_rad[k]
        effort = effort + cosine * functions.cos(angle) + sine * functions.sin(angle)
    if terms & _TABLES:
        at = (followed - gains.table_start_rad) / gains.table_step_rad
        found = interpolated(gains.load_table, at, functions)
        found = found + interpolated(gains.local_friction_table, at, functions) * direction
        if "table_fade" in terms:
            found = found * _faded(speed, gains.table_fade_speed_rad_s, functions)
        effort = effort + found
    return effort


def _faded(speed: Any, fade_speed: Any, functions: ModuleType) -> Any:
    """What is left of a term that fades out beyond a speed; 0 means never."""
    share = speed / chosen(fade_speed > 0.0, fade_speed, math.inf, functions)
    return bounded(2.0 - share, 0.0, 1.0, functions)


def _curve_nm(gains: AxisGains, velocity: Any, functions: ModuleType) -> Any:
    share = abs(velocity) / gains.friction_top_speed_rad_s
    at = (FRICTION_ENTRIES - 1) * functions.sqrt(share)
    forward = interpolated(gains.friction_forward, at, functions)
    backward = interpolated(gains.friction_backward, at, functions)
    return chosen(velocity > 0.0, forward, backward, functions)


def _cross_nm(gains: AxisGains, other: Wanted, functions: ModuleType) -> Any:
    velocity = other.velocity_rad_s
    return (
        gains.cross_inertia_feedforward * other.acceleration_rad_s2
        + gains.cross_viscous_feedforward * velocity
        + gains.cross_coulomb_feedforward * functions.tanh(velocity / gains.coulomb_smoothing_rad_s)
    )


def _transmission_nm(
    gains: AxisGains, setpoint: Wanted, direction: Any, functions: ModuleType
) -> Any:
    """What the transmission loses of the effort that passes through it."""
    friction = (
        gains.viscous_feedforward * setpoint.velocity_rad_s + gains.coulomb_feedforward * direction
    )
    passed = (
        gains.transmitted_inertia * setpoint.acceleration_rad_s2
        + gains.offset_feedforward
        + gains.transmitted_friction * friction
    )
    lost = gains.transmission_loss * direction * functions.copysign(1.0, passed)
    return passed / (1.0 - lost) - passed

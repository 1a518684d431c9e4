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
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from firmware_interface.gains import FRICTION_ENTRIES, AxisGains
from firmware_interface.motion import Reference

Array = NDArray[np.float64]


# What the control law remembers of its reference: presliding and backlash.

# Terms of the gains whose effort depends on where the reference has been.
_REMEMBERING: Final = frozenset({"presliding", "backlash"})


class Memory(NamedTuple):
    """What the law remembers of the reference.

    Attributes
    ----------
    presliding : float or array
        z, between -1 and 1.
    backlash_rad : float or array
        b.
    """

    presliding: Any = 0.0
    backlash_rad: Any = 0.0

    def after(self, gains: AxisGains, step_rad: Any, functions: ModuleType = math) -> "Memory":
        """The same one sample later, or at several distances into a motion one way.

        Parameters
        ----------
        gains : AxisGains
        step_rad : float or array
            Of the reference, from where this memory is.
        functions : module
            `math`, or numpy for arrays.
        """
        if gains.terms.isdisjoint(_REMEMBERING):
            return self
        sign, way = functions.copysign(1.0, step_rad), abs(step_rad)
        z, b = self
        if "presliding" in gains.terms:
            z = z - (sign - z) * functions.expm1(-way / gains.presliding_distance_rad)
        if "backlash" in gains.terms:
            reached = sign * gains.backlash_offset_rad
            b = b - (reached - b) * functions.expm1(-way / gains.backlash_distance_rad)
        return Memory(z, b)

    def kept(self, gains: AxisGains) -> "Memory":
        """What is left of it for other gains: nothing of a term that they do not have."""
        return Memory(
            self.presliding if "presliding" in gains.terms else 0.0,
            self.backlash_rad if "backlash" in gains.terms else 0.0,
        )

    def along(self, gains: AxisGains, position_rad: Array) -> "Memory":
        """The memory at each sample of a stretch.

        Parameters
        ----------
        gains : AxisGains
        position_rad : (N + 1,) array
            Of the reference: where this memory is, then sample by sample.

        Returns
        -------
        Memory
            Of (N,) arrays, or without arrays where the gains remember nothing.
        """
        if gains.terms.isdisjoint(_REMEMBERING):
            return self
        steps = np.diff(position_rad)
        z, b = np.empty(len(steps)), np.empty(len(steps))
        last, first = self, 0
        for end in [*(np.flatnonzero(np.diff(np.signbit(steps))) + 1).tolist(), len(steps)]:
            way = position_rad[first + 1 : end + 1] - position_rad[first]
            z[first:end], b[first:end] = last.after(gains, way, np)
            last, first = Memory(z[end - 1], b[end - 1]), end
        return Memory(z, b)

    @property
    def last(self) -> "Memory":
        """At the end of a stretch."""
        return Memory(*(float(np.ravel(value)[-1]) for value in self))


NOTHING: Final = Memory()
"""What the law remembers where its controller was just reset."""


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


# Tables and bounds of the control law, for a number or for arrays of them.
#
# Where a value is not a number it counts as the lower bound, as C's fmaxf takes it.


def bounded(value: Any, lowest: float, highest: float, functions: ModuleType) -> Any:
    """The value, or the bound that it is beyond.

    Parameters
    ----------
    value : float or array
    lowest, highest : float
    functions : module
        `math`, or numpy for arrays; so in the functions below.
    """
    if functions is math:
        return min(max(lowest, value), highest)
    return np.fmin(np.fmax(value, lowest), highest)


def chosen(condition: Any, then: Any, otherwise: Any, functions: ModuleType) -> Any:
    """One of two values."""
    if functions is math:
        return then if condition else otherwise
    return np.where(condition, then, otherwise)


def interpolated(table: Any, at: Any, functions: ModuleType) -> Any:
    """A table's value between its entries; it falls to zero over one cell beyond its ends.

    Parameters
    ----------
    table : tuple, or (K, ...) array
        Behind the entries come the axes of drives, where each has a table of its own.
    at : float or array
        Number of the entry, and share of the way to the next.
    """
    at = bounded(at, -1.0, len(table), functions)
    cell = functions.floor(at)
    share = at - cell
    return (1.0 - share) * _entry(table, cell, functions) + share * _entry(
        table, cell + 1, functions
    )


def _entry(table: Any, number: Any, functions: ModuleType) -> Any:
    """Entry of a table; zero outside it."""
    if functions is math:
        return table[number] if 0 <= number < len(table) else 0.0
    rows = np.asarray(table)
    index = np.clip(number, 0, len(rows) - 1).astype(np.intp)
    if rows.ndim == 1:
        found = rows[index]
    else:
        shape = np.broadcast_shapes(index.shape, rows.shape[1:])
        found = np.take_along_axis(rows, np.broadcast_to(index, shape)[None], axis=0)[0]
    return np.where((number >= 0) & (number < len(rows)), found, 0.0)


# The poles of an axis' position loop, sample by sample, as a rigid body.

# 1 - w, where w = 1 / z delays by one sample; all polynomials here are in w.
_DIFFERENCE = Polynomial([1.0, -1.0])


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

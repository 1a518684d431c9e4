"""The board's control law and its gains.

With e = reference - position, all at the gearbox output::

    effort = proportional * e
           + derivative * (reference velocity - filtered velocity)
           + integral * sum(e) * period
           + inertia_feedforward * reference acceleration
           + viscous_feedforward * reference velocity
           + viscous_difference_feedforward * |reference velocity|
           + (coulomb_feedforward
              + stribeck_feedforward * exp(-(reference velocity / stribeck_speed)^2))
             * tanh(reference velocity / coulomb_smoothing)
           + offset_feedforward
           + sum over k of ripple_cosine[k] * cos(2 pi * reference / ripple_period[k])
                         + ripple_sine[k]   * sin(2 pi * reference / ripple_period[k])

The reference of the ripple table is the same position, counted from the encoder's zero, as the
one that e is made of. The sum of the errors takes in the present one; what it contributes is kept
within the effort limit, and so is the effort.

The filtered velocity is the backward difference of the measured position, passed through a
first-order filter of time constant velocity_filter::

    w[k] = w[k-1] + period / (velocity_filter + period) * (difference[k] - w[k-1])

A bank is accepted if every number n with its largest value N (the gain_maximum registers) obeys
|n| <= N and |n - active n| <= gain_step * N; if those in `POSITIVE` are above zero; and if all
but those in `SIGNED` are not below it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from types import ModuleType
from typing import Any, Final, Self

RIPPLES: Final = 4
"""Entries of the ripple table."""
FEEDBACK: Final = ("proportional", "derivative", "integral", "velocity_filter_s")
"""Numbers that decide whether the loop is stable."""
SIGNED: Final = frozenset(
    {
        "offset_feedforward",
        "viscous_difference_feedforward",
        *(f"ripple_{part}[{k}]" for part in ("cosine", "sine") for k in range(RIPPLES)),
    }
)
"""Numbers that may be negative."""
POSITIVE: Final = frozenset(
    {
        "coulomb_smoothing_rad_s",
        "stribeck_speed_rad_s",
        *(f"ripple_period_rad[{k}]" for k in range(RIPPLES)),
    }
)
"""Numbers that divide, and so may not be zero."""


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
    stribeck_feedforward : float
        N*m, static less Coulomb friction.
    stribeck_speed_rad_s : float
        rad/s, positive.
    viscous_difference_feedforward : float
        N*m*s/rad, viscous friction forward over that of both directions' mean.
    ripple_cosine, ripple_sine : tuple of `RIPPLES` floats
        N*m; an entry with both zero is off.
    ripple_period_rad : tuple of `RIPPLES` floats
        rad, positive.
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
    stribeck_feedforward: float = 0.0
    stribeck_speed_rad_s: float = 1.0
    viscous_difference_feedforward: float = 0.0
    ripple_cosine: tuple[float, ...] = (0.0,) * RIPPLES
    ripple_sine: tuple[float, ...] = (0.0,) * RIPPLES
    ripple_period_rad: tuple[float, ...] = (1.0,) * RIPPLES

    def numbers(self) -> dict[str, float]:
        """Every number by name, in the order of a gain bank; entry k of a table is `name[k]`."""
        found: dict[str, float] = {}
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, tuple):
                found |= {f"{field.name}[{k}]": entry for k, entry in enumerate(value)}
            else:
                found[field.name] = value
        return found

    @classmethod
    def of_numbers(cls, numbers: Sequence[float]) -> Self:
        """Gains from their numbers in the order of a gain bank."""
        single = len(numbers) - 3 * RIPPLES
        tables = (tuple(numbers[n : n + RIPPLES]) for n in range(single, len(numbers), RIPPLES))
        return cls(*numbers[:single], *tables)  # type: ignore[arg-type]


Bank = Mapping[str, AxisGains]
"""Gains of all axes, by name."""


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

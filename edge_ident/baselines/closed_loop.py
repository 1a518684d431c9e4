"""A drive of the base model in closed loop, for methods that compare it with the real drive.

A recording does not say which controller made it, so the simulation uses one that hardly matters,
as in direct and inverse dynamic identification (DIDIM: Gautier, Janot, Vandanjon 2013). It has the
model's own feed-forward and feedback so stiff that the simulated drive follows its reference. Both
poles of the axis lie at 0.3 rad per sample, whatever the model's inertia, so the loop stays the
same while parameters are searched.

The effort is held between samples. With Coulomb's law the speed is then a piece of an exponential
towards the speed at which friction balances the effort. Each step is that exponential itself, cut
at the instant at which the axis comes to rest. There it stays if the effort does not exceed the
Coulomb friction; otherwise it sets off the other way.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.model.model import PARAMETERS, POSITIVE, regressor
from edge_ident.signals.filters import differentiate

Array = NDArray[np.float64]

_POLE_RAD: Final = 0.3
"""Closed-loop poles times the sampling period: stiff, and far from what sampling forbids."""
_SLOWEST_DECAY: Final = 1e-6
"""Least viscous decay in a sample, so that its quotients stay defined; it is not felt."""


@dataclass(frozen=True)
class Course:
    """Where a drive shall go: position, velocity and acceleration, (N,) arrays each."""

    position: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True)
class Response:
    """What the simulated drive did: (N,) arrays; each effort acts until the next sample."""

    position: Array
    velocity: Array
    effort: Array


def course_along(position: Array, cutoff_hz: float, period_s: float) -> Course:
    """The filtered position with its derivatives."""
    return Course(*differentiate(position, cutoff_hz, period_s))


def simulate(parameters: Array, course: Course, period_s: float) -> Response:
    """Drive the base model along a course.

    Parameters
    ----------
    parameters : (4,) array
        Inertia positive, frictions not negative.
    course : Course
    period_s : float
        Of samples and of the controller.

    Raises
    ------
    DataError
        No drive can have such parameters.
    """
    _refuse_unphysical(parameters)
    inertia, viscous, coulomb, offset = (float(value) for value in parameters)
    proportional = inertia * (_POLE_RAD / period_s) ** 2
    derivative = 2.0 * inertia * _POLE_RAD / period_s
    ahead = regressor(course.velocity, course.acceleration) @ parameters
    ahead[:-1] = 0.5 * (ahead[:-1] + ahead[1:])  # it acts from this sample to the next
    wanted = proportional * course.position + derivative * course.velocity + ahead
    step = _Step(inertia, viscous, coulomb, period_s)
    x, v = float(course.position[0]), float(course.velocity[0])
    positions, velocities, efforts = [], [], []
    for target in wanted.tolist():
        effort = target - proportional * x - derivative * v
        positions.append(x)
        velocities.append(v)
        efforts.append(effort)
        x, v = step(x, v, effort - offset)
    return Response(np.array(positions), np.array(velocities), np.array(efforts))


def _refuse_unphysical(parameters: Array) -> None:
    bad = POSITIVE & (parameters < 0)
    bad[0] |= parameters[0] == 0
    if bad.any():
        index = int(np.argmax(bad))
        raise DataError(
            f"no drive with {PARAMETERS[index]} {parameters[index]:.3g} can be simulated",
            "record a motion that determines it; see edge-ident identify",
        )


class _Step:
    """One sample of M·v' = effort - viscous·v - coulomb·sign(v), exact for a held effort."""

    def __init__(self, inertia: float, viscous: float, coulomb: float, period_s: float) -> None:
        self._inertia, self._viscous, self._coulomb = inertia, viscous, coulomb
        self._period_s = period_s
        self._decay = max(viscous / inertia, _SLOWEST_DECAY / period_s)
        self._whole = self._gains(period_s)

    def __call__(self, x: float, v: float, effort: float) -> tuple[float, float]:
        """Position and velocity at the end of the sample."""
        if v == 0.0:
            return self._from_rest(x, effort, self._whole)
        friction = math.copysign(self._coulomb, v)
        acceleration = (effort - friction - self._viscous * v) / self._inertia
        to_velocity, to_position = self._whole
        end = v + acceleration * to_velocity
        if (end > 0.0) == (v > 0.0):
            return x + v * self._period_s + acceleration * to_position, end
        stop_s = min(-math.log1p(self._decay * v / acceleration) / self._decay, self._period_s)
        x += v * stop_s + acceleration * self._gains(stop_s)[1]
        return self._from_rest(x, effort, self._gains(self._period_s - stop_s))

    def _from_rest(
        self, x: float, effort: float, gains: tuple[float, float]
    ) -> tuple[float, float]:
        if abs(effort) <= self._coulomb:
            return x, 0.0
        acceleration = (effort - math.copysign(self._coulomb, effort)) / self._inertia
        return x + acceleration * gains[1], acceleration * gains[0]

    def _gains(self, time_s: float) -> tuple[float, float]:
        """Velocity and way gained in a time, per acceleration at its beginning."""
        velocity = -math.expm1(-self._decay * time_s) / self._decay
        return velocity, (time_s - velocity) / self._decay

"""The input of every method: one axis, filtered and raw, the same for all."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from edge_ident.errors import DataError
from edge_ident.estimation import least_squares
from edge_ident.estimation.least_squares import EstimationPart
from edge_ident.estimation.network import Network
from edge_ident.model.model import PARAMETERS, POSITIVE, Array, Estimate, regressor
from edge_ident.signals.conditioning import Signals, condition
from edge_ident.signals.filters import differentiate
from edge_ident.signals.recording import AxisRecord, Recording


def _silent(note: str) -> None:
    pass


@dataclass(frozen=True)
class Problem:
    """One axis to identify.

    Attributes
    ----------
    signals : Signals
        Filtered, on an even grid of N samples.
    part : EstimationPart
        The samples of it from which all methods estimate and on which all are scored.
    regressor, effort : (M, 4) and (M,) arrays
        Filtered, of those samples.
    time_s : (N,) array
        The even grid.
    axis : AxisRecord
        Unfiltered, on the same grid.
    effort_shift_s : float
        Time from a row's stamp to the middle of the interval in which its effort acted.
    network : Network or None
    tries : int
        Draws that random search has.
    seed : int
        Of all that is random.
    note : callable
        Takes a word on the progress of a method that is slow.
    """

    signals: Signals
    part: EstimationPart
    regressor: Array
    effort: Array
    time_s: Array
    axis: AxisRecord
    effort_shift_s: float
    network: Network | None = None
    tries: int = 8
    seed: int = 0
    note: Callable[[str], None] = _silent

    def with_noise_bias(self, estimate: Estimate, part: float = 1.0) -> Estimate:
        """Widen the inertia's deviation by the bias that noise in the acceleration causes.

        Parameters
        ----------
        estimate : Estimate
        part : float
            Of that noise's power which the method has not dealt with; one for methods that take
            the regressor for exact.
        """
        bias = part * self.signals.acceleration_noise**2 * abs(estimate.parameters[0])
        std = estimate.std.copy()
        std[0] = np.hypot(std[0], bias)
        return Estimate(estimate.parameters, std)


def pose(
    recording: Recording,
    name: str,
    *,
    network: Network | None = None,
    tries: int = 8,
    seed: int = 0,
    note: Callable[[str], None] = _silent,
) -> Problem:
    """Filter one axis of a recording and choose its samples.

    Raises
    ------
    DataError
        Hardly any sample shows the axis in motion.
    """
    axis, time_s = recording.axes[name], recording.time_s
    signals = condition(time_s, axis.position, axis.effort, effort_shift_s=recording.effort_shift_s)
    part = least_squares.estimation_part(signals)
    return Problem(
        signals=signals,
        part=part,
        regressor=part.columns.values,
        effort=signals.effort[part.samples],
        time_s=signals.grid.time_s,
        axis=signals.grid.axis(axis),
        effort_shift_s=recording.effort_shift_s,
        network=network,
        tries=tries,
        seed=seed,
        note=note,
    )


def fit(regressor: Array, effort: Array) -> Array:
    """Parameters of an ordinary least-squares fit, (4,), for methods that build on it."""
    return np.asarray(np.linalg.lstsq(regressor, effort, rcond=None)[0], dtype=np.float64)


# A drive of the base model in closed loop, for methods that compare it with the real drive.
#
# A recording does not say which controller made it, so the simulation uses one that hardly matters,
# as in direct and inverse dynamic identification (DIDIM: Gautier, Janot, Vandanjon 2013). It has
# the model's own feed-forward and feedback so stiff that the simulated drive follows its reference.
# Both poles of the axis lie at 0.3 rad per sample, whatever the model's inertia, so the loop stays
# the same while parameters are searched.
#
# The effort is held between samples. With Coulomb's law the speed is then a piece of an exponential
# towards the speed at which friction balances the effort. Each step is that exponential itself, cut
# at the instant at which the axis comes to rest. There it stays if the effort does not exceed the
# Coulomb friction; otherwise it sets off the other way.


# Closed-loop poles times the sampling period: stiff, and far from what sampling forbids.
_POLE_RAD: Final = 0.3
# Least viscous decay in a sample, so that its quotients stay defined; it is not felt.
_SLOWEST_DECAY: Final = 1e-6


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

"""What a motion asks of an axis, and what the axis allows.

A motion is followed from rest to rest: the lead-in, what is recorded, and the way to a stop. The
worst of all loops that the axis may have counts, and every instant may be the beginning of a stop.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.control.gain_design import PHASE_MARGIN_RAD
from edge_ident.drive.description import DriveAxis
from firmware_interface.board_types import AxisLimits
from firmware_interface.gains import AxisGains
from firmware_interface.motion import (
    STOP_TIME_S,
    Multisine,
    Staircase,
    reference,
    stop_duration_s,
    stopping_reference,
)

Array = NDArray[np.float64]


# Position loops: what an axis makes of its reference, overshoot included.
#
# A loop with known gains has one response. Of an unknown loop, only its kind is known: feedback of
# position and speed that keeps the phase margin of `edge_ident.control.gain_design`. Then every
# natural frequency of a wide range counts, and the worst decides. Source: Franklin, Powell and
# Emami-Naeini, Feedback Control of Dynamic Systems, section 6.4 (the damping ratio is about the
# phase margin over 100°).

Complex = NDArray[np.complex128]

_DAMPING_RATIO: Final = math.degrees(PHASE_MARGIN_RAD) / 100.0
# Natural frequencies of unknown loops: from a heavy axis at start-up to a stiff machine tool.
_NATURAL_RAD_S: Final = np.geomspace(5.0, 80.0, 6)
_UNKNOWN_RAD_S: Final = 10.0  # frequency up to which an unknown loop is taken to follow
_FOLLOWED: Final = math.sqrt(0.5)  # response at the end of a loop's bandwidth, 3 dB
_LOWEST_RAD_S: Final = 1e-6


@dataclass(frozen=True)
class Loops:
    """The loops that an axis may have.

    Attributes
    ----------
    responses : tuple of callable
        Position over reference, at complex frequencies s in rad/s.
    bandwidth_rad_s : float
        Up to which all of them follow.
    stiffness : float
        Effort per distance from the reference; infinite where it is not known.
    words : str
        Which loops these are.
    """

    responses: tuple[Callable[[Complex], Complex], ...]
    bandwidth_rad_s: float
    stiffness: float
    words: str

    @classmethod
    def unknown(cls) -> "Loops":
        """Loops of all natural frequencies, as little damped as the phase margin allows."""
        words = (
            f"the loop is not known: natural frequencies of {_NATURAL_RAD_S[0]:.0f} to "
            f"{_NATURAL_RAD_S[-1]:.0f} rad/s with a damping ratio of {_DAMPING_RATIO:.2g} are "
            "allowed for"
        )
        return cls(
            tuple(map(_second_order, _NATURAL_RAD_S.tolist())), _UNKNOWN_RAD_S, math.inf, words
        )

    @classmethod
    def known(cls, gains: AxisGains, inertia: float, viscous: float, delay_s: float) -> "Loops":
        """The loop of a board's gains around an axis."""
        response = _of_gains(gains, inertia, viscous, delay_s)
        omega = np.geomspace(0.5, 500.0, 400)
        below = np.abs(response(np.asarray(1j * omega, dtype=np.complex128))) < _FOLLOWED
        end = float(omega[np.argmax(below)]) if np.any(below) else float(omega[-1])
        return cls((response,), end, gains.proportional, "the loop is that of the gains in force")

    def followed(self, velocity: Array, acceleration: Array, period_s: float) -> Array:
        """What all L loops make of a reference (N,) that begins and ends at rest.

        Returns
        -------
        (3, L, N) array
            Distance from the reference, velocity, acceleration.
        """
        samples = len(velocity)
        omega = np.maximum(2.0 * np.pi * np.fft.rfftfreq(samples, period_s), _LOWEST_RAD_S)
        s = np.asarray(1j * omega, dtype=np.complex128)
        response = np.stack([of(s) for of in self.responses])
        moving = np.fft.rfft(velocity)
        spectra = [
            (response - 1.0) / s * moving,
            response * moving,
            response * np.fft.rfft(acceleration),
        ]
        return np.asarray(np.fft.irfft(np.stack(spectra), samples))


def _second_order(natural_rad_s: float) -> Callable[[Complex], Complex]:
    damping = 2.0 * _DAMPING_RATIO * natural_rad_s

    def response(s: Complex) -> Complex:
        feedback = damping * s + natural_rad_s**2
        return np.asarray(feedback / (s**2 + feedback))

    return response


def _of_gains(
    gains: AxisGains, inertia: float, viscous: float, delay_s: float
) -> Callable[[Complex], Complex]:
    def response(s: Complex) -> Complex:
        late = np.exp(-s * delay_s)
        steady = gains.proportional + gains.integral / s
        forward = gains.inertia_feedforward * s**2 + gains.viscous_feedforward * s
        filtered = gains.derivative * s / (1.0 + s * gains.velocity_filter_s)
        axis = (inertia * s + viscous) * s
        wanted = (steady + gains.derivative * s + forward) * late
        return np.asarray(wanted / (axis + (steady + filtered) * late))

    return response


MARGIN: Final = 0.1
"""Share of each limit that a motion stays away from it, overshoot included. It is for what a linear
loop does not show: friction that lets go, parts that bend, noise that the controller answers."""
# Acceleration of an axis that something lets go of, over that of the reference. Play: up to 1.17 as
# a mean over a tenth of a second, on 84 drives of the independent plant. Friction that falls with
# speed lets go of small motions more than that; none of 146 such drives exceeded 0.84 of its limit.
_LETS_GO: Final = 1.25
_STEP_S: Final = 0.02  # step at which a motion is looked at: thirty in a period of the fastest line
_SETTLING_S: Final = 3.0  # time in which the slowest loop comes to rest
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Use:
    """Largest absolute values: of a motion, or those that an axis allows.

    Attributes
    ----------
    travel_rad : float
        Distance from zero; of a motion, with the way to a stop.
    speed_rad_s, acceleration_rad_s2, effort_nm : float
    following_rad : float
        Distance from the reference; a limit of a board alone.
    """

    travel_rad: float
    speed_rad_s: float
    acceleration_rad_s2: float
    effort_nm: float
    following_rad: float

    @classmethod
    def of_drive(cls, axis: DriveAxis) -> "Use":
        """The limits of a drive description."""
        return cls(
            axis.travel_limit_rad,
            axis.speed_limit_rad_s,
            axis.acceleration_limit_rad_s2,
            axis.effort_limit_nm,
            math.inf,
        )

    @classmethod
    def of_board(cls, limits: AxisLimits) -> "Use":
        """The limits that a board enforces."""
        return cls(
            limits.travel_rad,
            limits.speed_rad_s,
            limits.acceleration_rad_s2,
            limits.effort_nm,
            limits.following_error_rad,
        )

    def smaller(self, other: "Use") -> "Use":
        """The smaller of each of two limits."""
        return Use(*map(min, astuple(self), astuple(other)))

    def times(self, share: float) -> "Use":
        """All of them, scaled."""
        return Use(*(share * value for value in astuple(self)))

    def within(self, other: "Use") -> bool:
        """Whether none is larger than another's."""
        return self.of(other) <= 1.0

    def of(self, limit: "Use") -> float:
        """The largest share of a limit."""
        return max(
            self.travel_rad / limit.travel_rad,
            self.speed_rad_s / limit.speed_rad_s,
            self.acceleration_rad_s2 / limit.acceleration_rad_s2,
            self.effort_nm / max(limit.effort_nm, _TINY),
            self.following_rad / limit.following_rad,
        )


@dataclass(frozen=True)
class Load:
    """What the effort of an axis is made of, in the eyes of one explanation.

    Attributes
    ----------
    base : (4,) array
        Base parameters.
    added_nm : float
        What its causes add to the peak of the base model's effort; negative where they lower it.
    arrives : float
        Share of the largest command that the actuator gives.
    excess_nm : float
        What the explanation expects along the recordings beyond what they may hold.
    lets_go : bool
        Whether a part of the inertia may leave the axis for a while, as in a play, or friction
        falls with speed.
    """

    base: Array
    added_nm: float = 0.0
    arrives: float = 1.0
    excess_nm: float = 0.0
    lets_go: bool = False

    def with_causes(self, added_nm: float) -> "Load":
        """The same beside what its causes add, less the excess that the recordings contradict."""
        left_nm = max(added_nm - self.excess_nm, min(added_nm, 0.0))
        return replace(self, added_nm=left_nm if math.isfinite(left_nm) else 0.0)

    @property
    def static_nm(self) -> float:
        """What friction, offset and causes take, at most, at any speed."""
        return max(float(abs(self.base[2]) + abs(self.base[3])) + self.added_nm, 0.0)

    @property
    def moving(self) -> "Load":
        """Inertia and viscous friction alone."""
        return replace(self, base=self.base * [1.0, 1.0, 0.0, 0.0], added_nm=0.0)


@dataclass(frozen=True)
class Allowed:
    """What one axis may be asked for.

    Attributes
    ----------
    limit : Use
    loops : Loops
    stop_speed_rad_s : float
        Fastest that any axis may be: all stop in the same time.
    """

    limit: Use
    loops: Loops
    stop_speed_rad_s: float

    @property
    def with_margin(self) -> Use:
        """The limits less the margin."""
        return self.limit.times(1.0 - MARGIN)

    def uses(
        self,
        motion: Multisine | Staircase,
        duration_s: float,
        lead_in_s: float,
        loads: Sequence[Load],
    ) -> tuple[Use, Use]:
        """What a motion asks for: as commanded of the first load, and at worst of any."""
        position, velocity, acceleration = _from_rest_to_rest(motion, duration_s, lead_in_s)
        stop_s = stop_duration_s(self.stop_speed_rad_s)
        behind, rate, change = self.loops.followed(velocity, acceleration, _STEP_S)
        commanded = _use(position, velocity, acceleration, stop_s, loads[:1])
        worst = _use(
            np.vstack([position, position + behind]),
            np.vstack([velocity, rate]),
            np.vstack([acceleration, change]),
            stop_s,
            loads,
        )
        given_way = max(load.static_nm for load in loads) / self.loops.stiffness
        jolted = _LETS_GO if any(load.lets_go for load in loads) else 1.0
        return commanded, replace(
            worst,
            acceleration_rad_s2=jolted * worst.acceleration_rad_s2,
            following_rad=_most(behind) + given_way,
        )


def _from_rest_to_rest(
    motion: Multisine | Staircase, duration_s: float, lead_in_s: float
) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (N,) from the lead-in until all has settled."""
    times = np.arange(-math.floor(lead_in_s / _STEP_S), math.ceil(duration_s / _STEP_S)) * _STEP_S
    moving = reference(motion, times, lead_in_s, 0.0)
    end_s = max(stop_duration_s(float(moving.velocity_rad_s[-1])), STOP_TIME_S)
    after = np.arange(1, math.ceil((end_s + _SETTLING_S) / _STEP_S)) * _STEP_S
    stop = stopping_reference(
        float(moving.position_rad[-1]), float(moving.velocity_rad_s[-1]), after, end_s
    )
    return (
        np.concatenate([moving.position_rad, stop.position_rad]),
        np.concatenate([moving.velocity_rad_s, stop.velocity_rad_s]),
        np.concatenate([moving.acceleration_rad_s2, stop.acceleration_rad_s2]),
    )


def _use(
    position: Array, velocity: Array, acceleration: Array, stop_s: float, loads: Sequence[Load]
) -> Use:
    direction = np.sign(velocity)
    efforts = []
    for load in loads:
        inertia, viscous, coulomb, offset = load.base
        effort = inertia * acceleration + viscous * velocity + coulomb * direction + offset
        efforts.append((_most(effort) + load.added_nm) / load.arrives)
    return Use(
        max(_most(position), _most(position + 0.5 * stop_s * velocity)),
        _most(velocity),
        _most(acceleration),
        max(efforts),
        0.0,
    )


def _most(values: Array) -> float:
    return float(np.max(np.abs(values)))

"""The control law of `firmware_interface.control_law`, sample by sample, for one axis."""

import copy
import math
from collections.abc import Sequence
from typing import Final, NamedTuple

from firmware_interface.control_law import CARRY_TIME_S, NOTHING, deadband_nm, feedforward_nm
from firmware_interface.gains import AxisGains
from firmware_interface.motion import stop_acceleration_rad_s2, stop_duration_s


class Setpoint(NamedTuple):
    """Where an axis should be now: rad, rad/s, rad/s^2."""

    position_rad: float
    velocity_rad_s: float
    acceleration_rad_s2: float

    @property
    def finite(self) -> bool:
        """All three are numbers."""
        return all(map(math.isfinite, self))


_NOTHING_CARRIED_NM: Final = 1e-6  # what is left of a jump counts no longer


class AxisController:
    """Holds what the law remembers: last position and reference, filtered velocity, and states.

    Parameters
    ----------
    gains : AxisGains
    period_s : float
    effort_limit_nm : float
        The effort is clipped to it, and the integral part stops growing there.

    Attributes
    ----------
    gains : AxisGains
    memory : Memory
        What the law remembers of the reference.
    carried_nm : float
        What is left of the bias that bridged an exchange of gains.
    feedforward_nm : float
        Of the last sample, within the effort limit.
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
        self.carried_nm = self.feedforward_nm = 0.0
        self.finite = True
        self._hold_reference(position_rad)

    def exchange(self, gains: AxisGains, position_rad: float) -> None:
        """Go on with other gains; the reference is held at this position."""
        self.gains = gains
        self._hold_reference(position_rad)

    def _hold_reference(self, position_rad: float) -> None:
        self._reference_rad = position_rad
        self.memory = NOTHING

    def taken_over(
        self, gains: AxisGains, setpoint: Setpoint, position_rad: float, *, moving: bool
    ) -> tuple["AxisController", Setpoint]:
        """A controller that goes on from here with other gains, and a reference without error.

        Parameters
        ----------
        gains : AxisGains
        setpoint : Setpoint
            Of this controller in the sample that comes.
        position_rad : float
            Latched in it.
        moving : bool
            The axis is on its way to rest: the reference is as fast as it.
        """
        taken = copy.copy(self)
        taken.gains, taken.memory = gains, self.memory.kept(gains)
        seen = copy.copy(taken)
        seen._observe(setpoint, position_rad)
        velocity_rad_s = seen._velocity_rad_s if moving else 0.0
        return taken, Setpoint(position_rad - seen.memory.backlash_rad, velocity_rad_s, 0.0)

    def shifted(self, way_rad: float) -> "AxisController":
        """The same with its reference so far away."""
        shifted = copy.copy(self)
        shifted._reference_rad += way_rad
        return shifted

    def asked_nm(self, setpoint: Setpoint, position_rad: float, other: Setpoint) -> float:
        """Effort of the law in this sample, neither bridged nor clipped; nothing changes."""
        return copy.copy(self)._law_nm(setpoint, position_rad, other)

    def effort_nm(
        self, setpoint: Setpoint, position_rad: float, other: Setpoint | None = None
    ) -> float:
        """Effort for the position just latched; the other axis's setpoint, where there is one."""
        effort_nm = self._clip(self._law_nm(setpoint, position_rad, other) + self.carried_nm)
        left = math.exp(-self._period_s / CARRY_TIME_S)
        carried = abs(self.carried_nm) > _NOTHING_CARRIED_NM
        self.carried_nm = left * self.carried_nm if carried else 0.0
        return effort_nm

    def _observe(self, setpoint: Setpoint, position_rad: float) -> None:
        """Take in what this sample brought."""
        difference = (position_rad - self._last_rad) / self._period_s
        self._last_rad = position_rad
        self._velocity_rad_s += (
            self._period_s
            / (self.gains.velocity_filter_s + self._period_s)
            * (difference - self._velocity_rad_s)
        )
        self.memory = self.memory.after(self.gains, setpoint.position_rad - self._reference_rad)
        self._reference_rad = setpoint.position_rad

    def _law_nm(self, setpoint: Setpoint, position_rad: float, other: Setpoint | None) -> float:
        gains, period = self.gains, self._period_s
        self._observe(setpoint, position_rad)
        error = setpoint.position_rad + self.memory.backlash_rad - position_rad
        self._integral_nm = self._clip(self._integral_nm + gains.integral * error * period)
        feedforward = feedforward_nm(gains, setpoint, other=other, memory=self.memory)
        effort_nm = (
            gains.proportional * error
            + gains.derivative * (setpoint.velocity_rad_s - self._velocity_rad_s)
            + self._integral_nm
            + feedforward
        )
        self.feedforward_nm = self._clip(feedforward)
        return float(deadband_nm(gains, effort_nm))

    def _clip(self, effort_nm: float) -> float:
        """Within the limit; what is no number must not become full effort."""
        if not math.isfinite(effort_nm):
            self.finite = False
            return 0.0
        return min(max(effort_nm, -self._limit_nm), self._limit_nm)


# Bumpless transfer: how other gains go on from where the control law is.
#
# The reference begins anew somewhere between where the axis is and where the old reference is:
# where the law with the other gains asks for the effort that the axis has, or comes nearest to it.
# What is left is the jump; a bias bridges it. See `firmware_interface.control_law`.


class Transfer(NamedTuple):
    """What other gains would make of a sample.

    Attributes
    ----------
    controllers : list of AxisController
        With these gains, bridged: they go on from where those in force are.
    setpoints : list of Setpoint
        Where they begin.
    jumps_nm : list of float
        Effort that they ask for, less that of the gains in force.
    """

    controllers: list[AxisController]
    setpoints: list[Setpoint]
    jumps_nm: list[float]


def transfer(
    controllers: Sequence[AxisController],
    gains: Sequence[AxisGains],
    setpoints: Sequence[Setpoint],
    positions_rad: Sequence[float],
    *,
    moving: bool,
) -> Transfer:
    """What an exchange of gains in the sample that comes would mean; nothing changes.

    Parameters
    ----------
    controllers : sequence of AxisController
        With the gains in force, by axis as all the others.
    gains : sequence of AxisGains
    setpoints : sequence of Setpoint
        Of that sample.
    positions_rad : sequence of float
        Latched in it.
    moving : bool
        The axes are on their way to rest.
    """
    now = [
        copy.copy(old).effort_nm(setpoint, position, other)
        for old, setpoint, position, other in zip(
            controllers, setpoints, positions_rad, reversed(setpoints), strict=True
        )
    ]
    started = [
        old.taken_over(of_axis, setpoint, position, moving=moving)
        for old, of_axis, setpoint, position in zip(
            controllers, gains, setpoints, positions_rad, strict=True
        )
    ]
    stop_s = max(stop_duration_s(s.velocity_rad_s) for s in (*setpoints, *(n for _, n in started)))
    begun = []
    for n, (taken, near) in enumerate(started):
        ends = [_between(near, setpoints[n], share, stop_s) for share in (0.0, 1.0)]
        at_ends = [
            taken.shifted(end.position_rad - setpoints[n].position_rad).asked_nm(
                end, positions_rad[n], setpoints[1 - n]
            )
            - now[n]
            for end in ends
        ]
        begun.append(_between(near, setpoints[n], _share(*at_ends), stop_s))
    bridged, jumps = [], []
    for n, (taken, _) in enumerate(started):
        shifted = taken.shifted(begun[n].position_rad - setpoints[n].position_rad)
        jumps.append(shifted.asked_nm(begun[n], positions_rad[n], begun[1 - n]) - now[n])
        shifted.carried_nm = -jumps[n]
        bridged.append(shifted)
    return Transfer(bridged, begun, jumps)


def _share(near_nm: float, far_nm: float) -> float:
    """Where between its ends a jump vanishes, as if it were linear; else the smaller end."""
    if near_nm * far_nm < 0.0:
        return near_nm / (near_nm - far_nm)
    return 0.0 if abs(near_nm) <= abs(far_nm) else 1.0


def _between(near: Setpoint, far: Setpoint, share: float, stop_s: float) -> Setpoint:
    """A setpoint from which a stop goes on as the far one's did."""
    velocity = near.velocity_rad_s + share * (far.velocity_rad_s - near.velocity_rad_s)
    return Setpoint(
        near.position_rad + share * (far.position_rad - near.position_rad),
        velocity,
        stop_acceleration_rad_s2(velocity, far.acceleration_rad_s2, stop_s),
    )

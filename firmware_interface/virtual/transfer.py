"""Bumpless transfer: how other gains go on from where the control law is.

The reference begins anew somewhere between where the axis is and where the old reference is:
where the law with the other gains asks for the effort that the axis has, or comes nearest to it.
What is left is the jump; a bias bridges it. See `firmware_interface.control_law`.
"""

import copy
from collections.abc import Sequence
from typing import NamedTuple

from firmware_interface.gains import AxisGains
from firmware_interface.motion import stop_acceleration_rad_s2, stop_duration_s
from firmware_interface.virtual.controller import AxisController, Setpoint


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

"""The limits that the board enforces by itself, sample by sample."""

from collections.abc import Sequence

from firmware_interface.board_types import AxisLimits
from firmware_interface.registers import Fault
from firmware_interface.virtual.drive import RAD_PER_COUNT, Drive, DriveSample


def violated(limits: Sequence[AxisLimits], measured: DriveSample, drive: Drive) -> Fault:
    """The first limit that an axis under control has left, or NONE.

    Every comparison is made so that a value which is not a number violates it.
    """
    for limit, position, error, speed in zip(
        limits, measured.position, measured.following_error, drive.speed_rad_s, strict=True
    ):
        if not abs(position) * RAD_PER_COUNT <= limit.travel_rad:
            return Fault.TRAVEL
        if not abs(error) * RAD_PER_COUNT <= limit.following_error_rad:
            return Fault.FOLLOWING_ERROR
        if not abs(speed) <= limit.speed_rad_s:
            return Fault.SPEED
    return Fault.NONE

"""What a board makes sure of at power-up before it takes a command."""

import math
from typing import Final

from firmware_interface.board_types import AxisLimits
from firmware_interface.gains import MOST_LOSS, POSITIVE, SIGNED, AxisGains
from firmware_interface.registers import AXES
from firmware_interface.virtual.drive import EFFORT_PER_COUNT_NM, RAD_PER_COUNT
from firmware_interface.virtual.settings import BoardSettings

LONGEST_WINDOW_S: Final = 1800.0
_LARGEST_EFFORT_COUNT: Final = 2**15 - 1
_LARGEST_JUMP_NM: Final = 1e6
_LARGEST_STATED: Final = 1e6
_LARGEST_TRAVEL_COUNT: Final = 2**29
"""A quarter of the counter's round: leaving the travel shows long before it wraps."""


def settings_sound(settings: BoardSettings) -> bool:
    """Whether the board may work with these settings: finite, positive, representable."""
    return 0.0 < settings.confirm_window_s < LONGEST_WINDOW_S and all(
        axis in settings.limits
        and axis in settings.gains
        and _limits_sound(settings.limits[axis])
        and _gains_sound(settings.gains[axis], settings.limits[axis].gain_maximum)
        for axis in AXES
    )


def _limits_sound(limits: AxisLimits) -> bool:
    sizes = (
        limits.travel_rad,
        limits.speed_rad_s,
        limits.acceleration_rad_s2,
        limits.effort_nm,
        limits.following_error_rad,
        limits.gain_step,
    )
    return (
        all(math.isfinite(size) and size > 0.0 for size in sizes)
        and 0.0 <= limits.effort_jump_nm <= _LARGEST_JUMP_NM
        and 0.0 <= limits.inertia <= _LARGEST_STATED
        and 0.0 <= limits.viscous_friction <= _LARGEST_STATED
        and limits.effort_nm / EFFORT_PER_COUNT_NM <= _LARGEST_EFFORT_COUNT
        and limits.travel_rad / RAD_PER_COUNT <= _LARGEST_TRAVEL_COUNT
        and limits.gain_step <= 1.0
        and all(math.isfinite(m) and m >= 0.0 for m in limits.gain_maximum.numbers().values())
        and limits.gain_maximum.transmission_loss <= MOST_LOSS
    )


def _gains_sound(gains: AxisGains, maxima: AxisGains) -> bool:
    largest = maxima.numbers()
    return all(
        abs(value) <= largest[name]
        and (value >= 0.0 or name in SIGNED)
        and (value > 0.0 or name not in POSITIVE)
        for name, value in gains.numbers().items()
    )

"""How a virtual board is set up at power-up."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from firmware_interface.board_types import AxisLimits
from firmware_interface.gains import (
    CONSERVATIVE_GAINS,
    FRICTION_ENTRIES,
    RIPPLES,
    TABLE_ENTRIES,
    AxisGains,
)
from firmware_interface.map_versions import MAP_CRCS
from firmware_interface.plant.feed_drive import FEED_DRIVE
from firmware_interface.registers import AXES, MAP_VERSION, Fault

CONFIRM_WINDOW_S: Final = 120.0
"""Time in which a commit must be confirmed."""

EFFORT_SHARE_OF_JUMP: Final = 0.2
"""What bridges an exchange of gains comes on top of a motion's own effort. Hosts keep that within
eight tenths of the limit, so both together are not clipped."""

DEFAULT_LIMITS: Final = AxisLimits(
    travel_rad=10.0,
    speed_rad_s=4.0,
    acceleration_rad_s2=60.0,
    effort_nm=12.0,
    following_error_rad=0.6,
    gain_step=0.6,
    gain_maximum=AxisGains(
        proportional=600.0,
        derivative=60.0,
        integral=2000.0,
        velocity_filter_s=0.1,
        inertia_feedforward=2.0,
        viscous_feedforward=5.0,
        coulomb_feedforward=5.0,
        coulomb_smoothing_rad_s=5.0,
        offset_feedforward=5.0,
        stribeck_feedforward=5.0,
        stribeck_speed_rad_s=5.0,
        viscous_difference_feedforward=5.0,
        ripple_cosine=(5.0,) * RIPPLES,
        ripple_sine=(5.0,) * RIPPLES,
        ripple_period_rad=(20.0,) * RIPPLES,
        friction_top_speed_rad_s=20.0,
        friction_forward=(5.0,) * FRICTION_ENTRIES,
        friction_backward=(5.0,) * FRICTION_ENTRIES,
        table_start_rad=20.0,
        table_step_rad=5.0,
        load_table=(5.0,) * TABLE_ENTRIES,
        local_friction_table=(5.0,) * TABLE_ENTRIES,
        table_fade_speed_rad_s=20.0,
        ripple_fade_speed_rad_s=(20.0,) * RIPPLES,
        presliding_feedforward=5.0,
        presliding_distance_rad=5.0,
        backlash_offset_rad=0.2,
        backlash_distance_rad=5.0,
        deadband_inverse=5.0,
        deadband_smoothing=5.0,
        cross_inertia_feedforward=2.0,
        cross_viscous_feedforward=5.0,
        cross_coulomb_feedforward=5.0,
        transmission_loss=0.9,
        transmitted_inertia=2.0,
        transmitted_friction=2.0,
    ),
    effort_jump_nm=EFFORT_SHARE_OF_JUMP * 12.0,
)


@dataclass(frozen=True)
class BoardSettings:
    """What differs from board to board.

    Attributes
    ----------
    map_version : int
        Of the register map: an older one is a board of older firmware.
    map_crc : int, optional
        Of the register map that the firmware claims to be built with; by default of that version.
    fault : Fault
        Latched at power-up unless NONE.
    limits, gains : mapping
        By axis; by default with inertia and friction of the drive behind the virtual board.
    confirm_window_s : float
        From a commit to the roll back that a confirmation prevents.
    homed : int
        Bit n: axis n counts from the machine's reference mark.
    switches_rad : float
        Distance from the machine's zero at which an axis presses its limit switches.
    stores : int
        Times that permanent memory was written.
    """

    map_version: int = MAP_VERSION
    map_crc: int | None = None
    serial_number: int = 1
    fault: Fault = Fault.NONE
    limits: Mapping[str, AxisLimits] = field(
        default_factory=lambda: {
            axis: replace(
                DEFAULT_LIMITS, inertia=body.inertia, viscous_friction=body.viscous_friction
            )
            for axis, body in FEED_DRIVE.items()
        }
    )
    gains: Mapping[str, AxisGains] = field(
        default_factory=lambda: dict.fromkeys(AXES, CONSERVATIVE_GAINS)
    )
    confirm_window_s: float = CONFIRM_WINDOW_S
    homed: int = 0
    switches_rad: float = math.inf
    stores: int = 0

    @property
    def claimed_crc(self) -> int:
        """CRC of the register map; argument of START."""
        return MAP_CRCS[self.map_version] if self.map_crc is None else self.map_crc

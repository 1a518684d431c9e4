"""What the board keeps: its settings, and the banks of gains."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from firmware_interface.board_types import MAP_CRCS, AxisLimits
from firmware_interface.codec import crc32
from firmware_interface.gains import (
    CONSERVATIVE_GAINS,
    FRICTION_ENTRIES,
    POSITIVE,
    RIPPLES,
    SIGNED,
    TABLE_ENTRIES,
    AxisGains,
    Bank,
    bank_spans,
    decode_gains,
    encode_gains,
)
from firmware_interface.plant.feed_drive import FEED_DRIVE
from firmware_interface.registers import AXES, MAP_VERSION, Fault, Result
from firmware_interface.virtual.register_file import RegisterFile

# How a virtual board is set up at power-up.

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


# Active, shadow and previous gains: old or new, never a mixture.

_LONGEST_SHOWN_S: Final = 655.35  # largest time that the register of the time left can say


class GainBanks:
    """The banks and the window in which a commit must be confirmed.

    Attributes
    ----------
    active : mapping
        In force.
    stored : mapping
        What permanent memory holds.
    stores : int
        Times that permanent memory was written.
    staged_crc_ok : bool
        The shadow bank matches its CRC.
    """

    def __init__(self, registers: RegisterFile, settings: BoardSettings) -> None:
        self._registers = registers
        self._limits = settings.limits
        self._window_s = settings.confirm_window_s
        self.stores = settings.stores
        self._version = settings.map_version
        self._shadow = bank_spans("shadow", self._version)
        self._active = bank_spans("active", self._version)
        self._previous: Bank | None = None
        self._deadline_s = math.inf
        self._put_active(settings.gains)
        self.stored = self.active
        self.check_staged()

    @property
    def unconfirmed(self) -> bool:
        """A commit waits for its confirmation."""
        return self._previous is not None

    def check_staged(self) -> None:
        """Find out whether the shadow bank matches its CRC; after every write of the host."""
        crc = self._registers.integer("shadow.crc")
        self.staged_crc_ok = crc32(self._registers.spans(self._shadow)) == crc

    def remaining_s(self, now_s: float) -> float:
        """Time left to confirm, as far as it can be shown; 0 when there is nothing to."""
        if not self.unconfirmed:
            return 0.0
        return min(max(self._deadline_s - now_s, 0.0), _LONGEST_SHOWN_S)

    def expired(self, now_s: float) -> bool:
        """The window has ended without a confirmation."""
        return self.unconfirmed and now_s >= self._deadline_s

    def staged(self, crc: int) -> Bank | Result:
        """The shadow bank, if it may be committed and is the one that the host means."""
        if self.unconfirmed:
            return Result.UNCONFIRMED
        if not self.staged_crc_ok or self._registers.integer("shadow.crc") != crc:
            return Result.GAIN_CRC
        staged = decode_gains(self._registers.spans(self._shadow), self._version)
        if not all(self._allowed(axis, staged[axis]) for axis in AXES):
            return Result.GAIN_LIMITS
        return staged

    def commit(self, now_s: float, staged: Bank) -> None:
        """Put gains in force that were staged, until they are confirmed."""
        self._previous = self.active
        self._deadline_s = now_s + self._window_s
        self._put_active(staged)

    def confirm(self) -> Result:
        """Keep what was committed."""
        if not self.unconfirmed:
            return Result.NOTHING_COMMITTED
        self._previous = None
        return Result.DONE

    def roll_back(self) -> Result:
        """Return to the gains before the commit."""
        if self._previous is None:
            return Result.NOTHING_COMMITTED
        self._put_active(self._previous)
        self._previous = None
        return Result.DONE

    def store(self) -> Result:
        """Write the active bank to permanent memory, unless it stands there."""
        if self.unconfirmed:
            return Result.UNCONFIRMED
        if self.stored != self.active:
            self.stored = self.active
            self.stores += 1
        return Result.DONE

    def _put_active(self, gains: Bank) -> None:
        words = encode_gains(gains, self._version)
        self._registers.put_spans(self._active, words)
        self._registers.put("active.crc", crc32(words))  # not there on a board of map 3
        self.active: Bank = decode_gains(words, self._version)

    def _allowed(self, axis: str, gains: AxisGains) -> bool:
        """Each gain within its maximum and not too far from the present one."""
        limits = self._limits[axis]
        maxima, active = limits.gain_maximum.numbers(), self.active[axis].numbers()
        for name, value in gains.numbers().items():
            maximum = maxima[name]
            if not (
                abs(value) <= maximum
                and abs(value - active[name]) <= limits.gain_step * maximum
                and (value >= 0.0 or name in SIGNED)
                and (value > 0.0 or name not in POSITIVE)
            ):
                return False
        return True

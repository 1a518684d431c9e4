"""Active, shadow and previous gains: old or new, never a mixture."""

import math
from typing import Final

from firmware_interface.codec import crc32
from firmware_interface.gain_words import bank_spans, decode_gains, encode_gains
from firmware_interface.gains import POSITIVE, SIGNED, AxisGains, Bank
from firmware_interface.registers import AXES, Result
from firmware_interface.virtual.register_file import RegisterFile
from firmware_interface.virtual.settings import BoardSettings

_LONGEST_SHOWN_S: Final = 655.35
"""Largest time that the register of the time left can say."""


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

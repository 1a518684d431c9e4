"""Other gains in force: at rest at once, or, while the law acts, in the sample after an offer."""

import math
from collections.abc import Sequence
from typing import Final

from firmware_interface.board_types import AxisLimits
from firmware_interface.gains import Bank
from firmware_interface.registers import REGISTERS, Result
from firmware_interface.virtual.controller import Setpoint
from firmware_interface.virtual.drive import Drive
from firmware_interface.virtual.setpoints import rest_from
from firmware_interface.virtual.transfer import Transfer

_MOST_SHOWN_NM: Final = 1e6
_SHARE_OF_EFFORT: Final = 0.2
"""Of the effort limit: what may jump where nothing is said of it."""


class Handover:
    """One offer of gains at a time, and what became of the last.

    Parameters
    ----------
    limits : sequence of AxisLimits
        By axis.
    map_version : int
        Of the board's register map: older ones have no command for it.

    Attributes
    ----------
    capable : bool
        The board takes gains while the law acts.
    result : Result
        PENDING until a sample has decided.
    offered : Bank or None
        Gains that wait for that.
    jumps_nm : sequence of float
        Of the last offer that was considered, by axis.
    """

    def __init__(self, limits: Sequence[AxisLimits], map_version: int) -> None:
        self._limits = limits
        known = map_version >= REGISTERS["bumpless.capable"].since
        self.capable = known and all(limit.effort_jump_nm > 0.0 for limit in limits)
        self.result = Result.NONE
        self.offered: Bank | None = None
        self.jumps_nm: Sequence[float] = [0.0] * len(limits)

    def offer(self, gains: Bank) -> None:
        """Have the next sample decide about these gains."""
        self.offered, self.result = gains, Result.PENDING

    def end(self, result: Result) -> None:
        """There is nothing to decide any more."""
        self.offered, self.result = None, result

    def considered(
        self, drive: Drive, gains: Bank, setpoints: Sequence[Setpoint], *, moving: bool
    ) -> Transfer | None:
        """The transfer to these gains, if it may be; else `result` says why not.

        Every comparison is made so that a value which is not a number refuses.
        """
        transfer = drive.considered(gains, setpoints, moving=moving)
        self.jumps_nm = [_shown(jump) for jump in transfer.jumps_nm]
        limits = self._limits
        if not all(
            abs(jump) <= (limit.effort_jump_nm or _SHARE_OF_EFFORT * limit.effort_nm)
            for jump, limit in zip(transfer.jumps_nm, limits, strict=True)
        ):
            self.end(Result.EFFORT_JUMP)
            return None
        ends = zip(transfer.setpoints, rest_from(transfer.setpoints), limits, strict=True)
        if not all(
            abs(begun.velocity_rad_s) <= limit.speed_rad_s
            and max(abs(begun.position_rad), abs(rest)) <= limit.travel_rad
            for begun, rest, limit in ends
        ):
            self.end(Result.TRAJECTORY_LIMITS)
            return None
        self.end(Result.DONE)
        return transfer


def _shown(jump_nm: float) -> float:
    """The jump as a register says it."""
    if math.isnan(jump_nm):
        return _MOST_SHOWN_NM
    return min(max(jump_nm, -_MOST_SHOWN_NM), _MOST_SHOWN_NM)

"""The motion that decides whether new gains stay: tracking error before and after."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from edge_ident.commissioning.capture import Capture, capture_motion
from edge_ident.errors import BoardError
from firmware_interface.board import Board
from firmware_interface.motion import Trajectory

_STOPPING_S: Final = 2.0
"""Allowance for coming to rest and for the commands around a motion."""


@dataclass(frozen=True)
class Verification:
    """Tracking error (rms, rad, by axis) with the old and the new gains."""

    before_rad: Mapping[str, float]
    after_rad: Mapping[str, float]

    @property
    def improved(self) -> bool:
        """No axis follows worse than before."""
        return all(self.after_rad[axis] <= self.before_rad[axis] for axis in self.before_rad)

    def ratio(self, axis: str) -> float:
        """How many times smaller the error became."""
        return self.before_rad[axis] / max(self.after_rad[axis], 1e-12)


def verification_motion(
    board: Board, trajectory: Trajectory, on_samples: Callable[[int, int], None]
) -> Capture:
    """Move with unconfirmed gains, inside the window to confirm them.

    Raises
    ------
    BoardError
        The motion takes longer than the board waits.
    """
    needed_s = trajectory.lead_in_s + trajectory.duration_s + _STOPPING_S
    window_s = board.status().confirm_remaining_s
    if needed_s > window_s:
        raise BoardError(
            f"the verification motion takes {needed_s:.0f} s, the board waits {window_s:.0f} s "
            "for the new gains to be confirmed",
            "describe a quicker motion in the drive description",
        )
    capture = capture_motion(board, trajectory, on_samples)
    board.finish()
    return capture

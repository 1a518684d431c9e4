"""The network as a board runs it: one period of one motion, in int8, without least squares.

`edge-ident export --c` and a firmware built with it do what this file says, number by number
(docs/chip.md). A virtual board calls this file itself, and `run` asks it what the board should have
said.
"""

from dataclasses import dataclass
from typing import Final

from edge_ident.errors import ModelError
from edge_ident.estimation.image import Subsampled, effort_scale
from edge_ident.estimation.manifest import Manifest
from edge_ident.estimation.network import Network
from edge_ident.estimation.network_estimate import (
    NetworkEstimate,
    estimate_together,
    motion_mismatch,
)
from edge_ident.model.model import BOARD_UNITS
from edge_ident.signals.one_period import (
    Blocks,
    KnownMotion,
    Period,
    condition_period,
    period_samples,
)
from firmware_interface.board_identification import BoardAxis, CapturedCounts
from firmware_interface.board_types import BoardIdentity
from firmware_interface.registers import AXES, IdentificationReason

FEWEST_MOVING: Final = 0.5
"""Share of the period in which an axis has to move: the rest is bridged by straight lines."""


def why_not_on_a_board(manifest: Manifest) -> str:
    """Why a board cannot identify with a network, empty where it can."""
    motion = manifest.motion
    if manifest.start_shares is None or manifest.normalization != "effort-scale":
        return "it was trained for random starts"
    if motion.effects:
        return f"it was trained for drives with {', '.join(motion.effects)}"
    if (motion.position_unit, motion.effort_unit) != BOARD_UNITS:
        return f"it was trained for {motion.position_unit} and {motion.effort_unit}"
    return ""


@dataclass(frozen=True)
class BoardNetwork:
    """A network on a board.

    Parameters
    ----------
    network : Network
        In int8.

    Raises
    ------
    ModelError
        No board could run this network.
    """

    network: Network

    def __post_init__(self) -> None:
        reason = why_not_on_a_board(self.network.manifest)
        if reason:
            raise ModelError(
                f"a board cannot identify with this network: {reason}",
                "train a network for the motion, without --configuration paper",
            )

    def identify(self, captured: CapturedCounts, board: BoardIdentity) -> dict[str, BoardAxis]:
        """What the board says of each axis."""
        return {name: axis for name, (axis, _) in self.estimates(captured, board).items()}

    def estimates(
        self, captured: CapturedCounts, board: BoardIdentity
    ) -> dict[str, tuple[BoardAxis, NetworkEstimate | None]]:
        """The same, with the network's estimate where it was asked."""
        period_s, sampling_s = self.network.manifest.motion.period_s, board.sample_period_s
        samples = period_samples(period_s, sampling_s, len(captured.position))
        if not samples:
            return dict.fromkeys(AXES, (BoardAxis(IdentificationReason.TOO_SHORT), None))
        return {
            axis: self._axis(
                Blocks.of(captured.position[:samples, n], captured.effort[:samples, n]),
                samples * sampling_s,
                board,
            )
            for n, axis in enumerate(AXES)
        }

    def _axis(
        self, blocks: Blocks, period_s: float, board: BoardIdentity
    ) -> tuple[BoardAxis, NetworkEstimate | None]:
        seen = self._conditioned(blocks, period_s, board)
        why_not = self._illegible(seen, board.effort_per_count_nm)
        if why_not:
            return BoardAxis(why_not), None
        found = estimate_together([Subsampled(seen.regressor, seen.effort)], self.network)[0]
        if not found.trusted:
            return BoardAxis(IdentificationReason.UNEXPLAINED, found.passes), found
        parameters = tuple(map(float, found.parameters))
        return (
            BoardAxis(IdentificationReason.NONE, found.passes, parameters, found.relative_residual),
            found,
        )

    def _conditioned(self, blocks: Blocks, period_s: float, board: BoardIdentity) -> Period:
        return condition_period(
            blocks,
            KnownMotion.of(self.network.manifest.motion.regressor),
            unit=board.encoder_resolution_rad,
            effort_unit=board.effort_per_count_nm,
            sampling_s=board.sample_period_s,
            period_s=period_s,
            effort_shift_s=board.control_delay_s + 0.5 * board.sample_period_s,
        )

    def _illegible(self, seen: Period, count: float) -> IdentificationReason:
        """Why the network cannot read what an axis did."""
        manifest = self.network.manifest
        if seen.moving_share < FEWEST_MOVING:
            return IdentificationReason.STANDSTILL
        if not motion_mismatch(seen.regressor, self.network) <= manifest.mismatch_limit:
            return IdentificationReason.OTHER_MOTION
        if not effort_scale(seen.effort, manifest.normalization) > count:
            return IdentificationReason.NO_EFFORT
        return IdentificationReason.NONE

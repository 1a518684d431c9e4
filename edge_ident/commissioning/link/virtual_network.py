"""The built-in network on a virtual board, as `edge-ident export --c` puts it on a real one."""

from functools import cached_property
from typing import TYPE_CHECKING

from edge_ident.estimation.manifest import BUILT_IN, Manifest, load_manifest
from firmware_interface.board_identification import BoardAxis, CapturedCounts, network_code
from firmware_interface.board_types import BoardIdentity

if TYPE_CHECKING:
    from edge_ident.estimation.board_network import BoardNetwork


class VirtualNetwork:
    """Loaded while a host asks the board what it identified, or for good.

    Parameters
    ----------
    stays : bool
        Load it now and keep it: then a host waits for the computation alone, some 30 ms.
    """

    def __init__(self, *, stays: bool = False) -> None:
        self._loaded = _on_board() if stays else None

    @property
    def network(self) -> int:
        """Its code."""
        return network_code(self._manifest.sha256["int8"])

    @property
    def longest_s(self) -> float:
        """One period of its motion."""
        return self._manifest.motion.period_s

    @cached_property
    def _manifest(self) -> Manifest:
        return load_manifest(BUILT_IN)

    def identify(self, captured: CapturedCounts, board: BoardIdentity) -> dict[str, BoardAxis]:
        """What the board says of each axis."""
        return (self._loaded or _on_board()).identify(captured, board)


def _on_board() -> "BoardNetwork":
    # onnxruntime, which only a board that identifies needs
    from edge_ident.estimation.board_network import BoardNetwork
    from edge_ident.estimation.network import load_network

    return BoardNetwork(load_network("int8"))

"""Entry point of the link: from a device's name to a board."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cached_property
from typing import TYPE_CHECKING

from edge_ident.commissioning.link.port_notes import explain, noted
from edge_ident.errors import EdgeIdentError, LinkError
from edge_ident.estimation.manifest import BUILT_IN, Manifest, load_manifest
from firmware_interface.board import Board
from firmware_interface.board_identification import BoardAxis, CapturedCounts, network_code
from firmware_interface.board_types import BoardIdentity
from firmware_interface.connection import DEFAULT_BAUD_RATE, open_link

if TYPE_CHECKING:
    from edge_ident.estimation.board_network import BoardNetwork
    from firmware_interface.plant.plant import Plant


@contextmanager
def connect(
    device: str, *, baud_rate: int = DEFAULT_BAUD_RATE, plant: "Plant | None" = None
) -> Iterator[Board]:
    """Connect to a board for the length of a with statement.

    Parameters
    ----------
    device : str
        `/dev/ttyACM0`, any pySerial URL, `tcp://HOST:PORT` (Modbus TCP), or `virtual`: a board
        in this process, with the built-in drive behind it.
    baud_rate : int
        Of a serial line.
    plant : firmware_interface.plant.Plant, optional
        The drive behind a board `virtual`; by default the built-in one, with nothing wrong.

    Yields
    ------
    Board
        Released and closed when the body ends, however it ends.

    Raises
    ------
    LinkError
        There is no such device, or nothing answers.
    BoardError
        What answers is not a board of this register map.

    Examples
    --------
    >>> import edge_ident
    >>> with edge_ident.connect("virtual") as board:
    ...     board.status().state.name
    'IDLE'
    """
    with ExitStack() as ending:
        try:
            link = open_link(device, baud_rate=baud_rate, plant=plant, identifier=VirtualNetwork())
        except LinkError as error:
            explain(error, device)
            raise
        ending.callback(link.close)
        ending.enter_context(noted(device))
        board = Board.connect(link)
        ending.callback(_release, board)
        yield board


def _release(board: Board) -> None:
    """Let the next host find the board free; a hold that stays runs out by itself."""
    with suppress(EdgeIdentError):
        board.release()


# The built-in network on a virtual board, as `edge-ident export --c` puts it on a real one.


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

"""Capture in real time at 115200 baud with jitter: is a sample lost, and how long is the tail?

    python tools/realtime_capture.py --periods 10
    python tools/realtime_capture.py --periods 1 --device /dev/pts/7      a board already served

The board, the line (tests/firmware_interface/fault_proxy.py) and the host are processes of their
own. Every byte takes its ten bits of time on the line, either way, and every 16 bytes are late by
up to the jitter on top. Nothing is speeded up: board, line and host go by one wall clock. The tail
is the board's own time from the last captured sample to the last page in the host's hand.
"""

import argparse
import multiprocessing
import sys
import tempfile
from contextlib import ExitStack, closing, nullcontext
from multiprocessing.synchronize import Event
from pathlib import Path

_ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(_ROOT), str(_ROOT / "tests" / "firmware_interface")]

from fault_line import FaultyLine, Pace  # noqa: E402
from fault_proxy import FaultProxy  # noqa: E402

from edge_ident.commissioning.motion.capture import Capture, capture_motion  # noqa: E402
from edge_ident.commissioning.motion.safety import ready_to_move  # noqa: E402
from edge_ident.drive.description import load_drive  # noqa: E402
from firmware_interface.board import Board  # noqa: E402
from firmware_interface.connection import open_link  # noqa: E402
from firmware_interface.motion import Multisine, SineComponent, Trajectory  # noqa: E402
from tests.boards import served_board  # noqa: E402

_SINE = Multisine((SineComponent(0.3, 1.0, 0.0),))
_SHORT = Trajectory({"x": _SINE, "z": _SINE}, duration_s=1.0, lead_in_s=4.0)


def run_line(url: str, folder: str, pace: Pace, ready: Event, ended: Event) -> None:
    """Run the line until told otherwise."""
    with FaultProxy(url, Path(folder), FaultyLine(pace=pace)):
        ready.set()
        ended.wait()


def captured(board: Board, motion: Trajectory) -> Capture:
    """One motion; a lost sample is an error."""
    with ready_to_move(board, lambda message: None):
        capture = capture_motion(board, motion, lambda in_hand, expected: None)
        board.finish()
    return capture


def measure(url: str, periods: int, tails: int, pace: Pace) -> None:
    """Capture through a paced line and print what came of it."""
    ready, ended = multiprocessing.Event(), multiprocessing.Event()
    with tempfile.TemporaryDirectory() as folder:
        line = multiprocessing.Process(target=run_line, args=(url, folder, pace, ready, ended))
        line.start()
        ready.wait()
        try:
            with closing(Board.connect(open_link(f"{folder}/ttyBOARD"))) as board:
                trajectory = load_drive(None).trajectory(periods)
                capture = captured(board, trajectory)
                overflows = board.status().overflows
                print(
                    f"{periods} periods, {pace.baud_rate} baud, jitter {1e3 * pace.jitter_s:g} ms: "
                    f"{len(capture.recording.time_s)} samples in {capture.pages} pages, "
                    f"{overflows} lost, tail {1e3 * capture.tail_s:.0f} ms",
                    flush=True,
                )
                found = sorted(captured(board, _SHORT).tail_s for _ in range(tails))
                print(
                    f"tail of {tails} short captures: median {1e3 * found[tails // 2]:.0f} ms, "
                    f"longest {1e3 * found[-1]:.0f} ms"
                )
        finally:
            ended.set()
            line.join()


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", help="a served board; default: a virtual one is started")
    parser.add_argument("--periods", type=int, default=10)
    parser.add_argument("--tails", type=int, default=15, help="short captures")
    parser.add_argument("--baud-rate", type=int, default=115200)
    parser.add_argument("--jitter", type=float, default=2.0, help="ms")
    given = parser.parse_args()
    pace = Pace(given.baud_rate, given.jitter * 1e-3)
    with ExitStack() as stack:
        board = nullcontext(given.device) if given.device else served_board(speed=1.0)
        measure(stack.enter_context(board), given.periods, given.tails, pace)


if __name__ == "__main__":
    main()

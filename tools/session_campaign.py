"""Whole sessions with the built-in drive over a line that goes wrong at random, one after another.

    python tools/session_campaign.py --sessions 300
    python tools/session_campaign.py --sessions 20 --first 4000 --boards c

Half of the sessions are `run`, the others capture, home and a look at the board. Half of the runs
find the gains of the first power-up, the others what the last one left. On top of the line's faults
some hosts are interrupted (Ctrl-C) or lose the line for good in the middle of a motion. A session
that fails is followed by one on a good line, and that one must not fail; where the board, which is
faster than real time, counts overflows, it is repeated and counted. Nothing may say that the board
has restarted, for none does. Frames, faults and their places come from the seed; when they strike
goes by the wall clock.
"""

import argparse
import logging
import multiprocessing
import random
import re
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from multiprocessing.queues import Queue
from pathlib import Path
from typing import Final

_ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(_ROOT), str(_ROOT / "tests" / "firmware_interface")]

from conformance_boards import (  # noqa: E402
    build_firmware,
    c_command,
    put_gains,
    python_command,
    serving,
)
from fault_line import FaultyLine, LineFault, Sender  # noqa: E402
from fault_proxy import FaultProxy  # noqa: E402

from edge_ident.commissioning.motion.capture import capture_motion, check_drive  # noqa: E402
from edge_ident.commissioning.motion.homing import move_to  # noqa: E402
from edge_ident.commissioning.motion.safety import make_ready, ready_to_move  # noqa: E402
from edge_ident.commissioning.run import Plan, commission  # noqa: E402
from edge_ident.drive.description import load_drive  # noqa: E402
from edge_ident.errors import EdgeIdentError  # noqa: E402
from edge_ident.estimation.network import load_network  # noqa: E402
from firmware_interface.board import Board  # noqa: E402
from firmware_interface.connection import open_link  # noqa: E402
from firmware_interface.errors import RestartedError  # noqa: E402

_SPEED: Final = 4.0
"""Of the boards; their rings then hold 2.2 s, and a page is due every 9 ms."""
_PATIENCE: Final = 3
_TOO_SLOW: Final = "were overwritten before they were fetched"
"""What the board counts where the host is held up for longer than the ring lasts."""
_CHANCES: Final = (0.0005, 0.002, 0.005, 0.015)
_LATE_S: Final = (0.03, 0.15, 0.45, 0.9)
_ACCIDENTS: Final = (None, None, None, "interrupt", "line")


class Accident:
    """An observer that lets something happen once so many samples are in."""

    def __init__(self, kind: str | None, draw: random.Random, proxy: FaultProxy) -> None:
        self._kind, self._proxy = kind, proxy
        self._left = draw.randrange(1, 1200)

    def stage(self, title: str) -> None: ...

    def say(self, message: str) -> None: ...

    def samples(self, in_hand: int, expected: int) -> None:
        """Count pages of both motions."""
        self._left -= 1
        if self._left or self._kind is None:
            return
        if self._kind == "interrupt":
            raise KeyboardInterrupt
        self._proxy.hang_up()


@dataclass
class Faults:
    """Chooses a fault for some frames; counts what went over the line."""

    chance: float
    draw: random.Random
    frames: int = 0
    struck: int = 0

    def __call__(self, sender: Sender, frame: bytes) -> LineFault | None:
        """See `fault_line.Choose`."""
        self.frames += 1
        if self.draw.random() >= self.chance:
            return None
        self.struck += 1
        return self.draw.choice(list(LineFault))


@dataclass
class Tally:
    """What came of the sessions on one board."""

    count: Counter[str] = field(default_factory=Counter)
    causes: Counter[str] = field(default_factory=Counter)
    violations: list[str] = field(default_factory=list)


class Site:
    """One board behind a line, and sessions on it."""

    def __init__(self, name: str, proxy: FaultProxy, folder: Path) -> None:
        self._name, self._proxy, self._folder = name, proxy, folder
        self._drive, self._network = load_drive(), load_network("fp32")
        self.tally = Tally()
        with self._board() as board:
            self._first_gains = board.active_gains()

    def play(self, seed: int) -> None:
        """One session on a faulty line and, if it fails, one on a good line."""
        draw = random.Random(seed)
        kind = draw.choice(["run", "run", "run", "capture", "home", "look"])
        if kind == "run" and draw.random() < 0.5:
            with self._board() as board:
                make_ready(board)
                put_gains(board, self._first_gains)
        accident = Accident(draw.choice(_ACCIDENTS), draw, self._proxy)
        self._proxy.line.late_s = draw.choice(_LATE_S)
        faults = Faults(draw.choice(_CHANCES), draw)
        self._proxy.line.choose = faults
        what = self._attempt(kind, accident, draw)
        self._proxy.line.choose = Faults(0.0, draw)
        self._note(faults, kind, what)
        self._proxy.hang_up()  # another cable
        self._proxy.come_back()
        if what is None:
            return
        self.tally.count["sessions after a failed one"] += 1
        time.sleep(self._proxy.line.late_s)  # what is late belongs to the faulty session
        again = self._attempt(kind, Accident(None, draw, self._proxy), draw)
        for _ in range(_PATIENCE):
            if again is None or _TOO_SLOW not in again:
                break
            self.tally.count["repeated, as this machine was too slow for the board"] += 1
            again = self._attempt(kind, Accident(None, draw, self._proxy), draw)
        if again is not None:
            told = f"{self._name}, seed {seed}: {kind} failed after a failed one: {again}"
            self.tally.violations.append(f"{told} (before: {what})")

    def _note(self, faults: Faults, kind: str, what: str | None) -> None:
        count = self.tally.count
        count["sessions"] += 1
        count[kind] += 1
        count["frames"] += faults.frames
        count["faults"] += faults.struck
        count["failed"] += what is not None
        if what is not None:
            self.tally.causes[re.sub(r"[\d.]+", "#", what)] += 1

    def _attempt(self, kind: str, observer: Accident, draw: random.Random) -> str | None:
        """What went wrong, if anything did."""
        try:
            with self._board() as board:
                return self._session(kind, board, observer, draw)
        except RestartedError as error:
            self.tally.violations.append(f"{self._name}: wrong restart, {kind}: {error.cause}")
            return error.cause
        except EdgeIdentError as error:
            if "restarted" in error.cause:
                self.tally.violations.append(f"{self._name}: wrong restart, {kind}: {error.cause}")
            return error.cause
        except KeyboardInterrupt:
            return "interrupted"

    def _session(
        self, kind: str, board: Board, observer: Accident, draw: random.Random
    ) -> str | None:
        if kind == "run":
            outcome = commission(board, self._drive, self._network, Plan(), self._folder, observer)
            return None if outcome.good else outcome.conclusion
        if kind == "capture":
            check_drive(board, self._drive)
            with ready_to_move(board, observer.say):
                trajectory = self._drive.trajectory()
                capture_motion(board, trajectory, observer.samples, self._folder / "capture.npz")
                board.finish()
        elif kind == "home":
            move_to(board, dict.fromkeys(board.axes, draw.uniform(-5.0, 5.0)), observer, 3.0)
        else:
            board.limits()
            board.active_gains()
            board.status()
        return None

    @contextmanager
    def _board(self) -> Iterator[Board]:
        """The way in which the command line connects and lets go."""
        link = open_link(self._proxy.url)
        try:
            board = Board.connect(link)
            try:
                yield board
            finally:
                with suppress(EdgeIdentError):
                    board.release()
        finally:
            link.close()


def campaign(name: str, command: list[str], seeds: range, results: "Queue[Tally]") -> None:
    """Play sessions on a board of its own."""
    logging.disable(logging.CRITICAL)
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(command) as board,
        FaultProxy(board.url, Path(folder), FaultyLine(seed=seeds.start)) as proxy,
    ):
        site = Site(name, proxy, Path(folder))
        for seed in seeds:
            known = len(site.tally.violations)
            site.play(seed)
            for violation in site.tally.violations[known:]:
                print(violation, flush=True)
            if site.tally.count["sessions"] % 10 == 0:
                print(f"{name}: {dict(site.tally.count)}", flush=True)
    results.put(site.tally)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sessions", type=int, default=300, help="on all boards together")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--boards", nargs="+", choices=["python", "c"], default=["python", "c"])
    parser.add_argument("--speed", type=float, default=_SPEED, help="times real time")
    given = parser.parse_args()
    each = given.sessions // len(given.boards)
    results: Queue[Tally] = multiprocessing.Queue()
    started_s = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        makers = {"python": python_command}
        if "c" in given.boards:
            build_firmware(Path(folder), "all")
            makers["c"] = partial(c_command, Path(folder))
        workers = []
        for n, name in enumerate(given.boards):
            first = given.first + n * each
            arguments = (name, makers[name](speed=given.speed), range(first, first + each))
            workers.append(multiprocessing.Process(target=campaign, args=(*arguments, results)))
            workers[-1].start()
        for worker in workers:
            worker.join()
        tallies = [results.get() for worker in workers if worker.exitcode == 0]
    total: Counter[str] = sum((tally.count for tally in tallies), Counter())
    causes: Counter[str] = sum((tally.causes for tally in tallies), Counter())
    for cause, times in causes.most_common():
        print(f"{times:5d}  {cause}")
    violations = [violation for tally in tallies for violation in tally.violations]
    print(f"{dict(total)}; {len(violations)} violations, {time.monotonic() - started_s:.0f} s")
    sys.exit(1 if violations or len(tallies) < len(workers) else 0)


if __name__ == "__main__":
    main()

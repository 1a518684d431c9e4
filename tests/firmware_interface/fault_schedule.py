"""A host at work over a line that goes wrong at random, and what must hold whatever happens.

All that is drawn comes from one seed, so that a schedule that breaks an invariant can be repeated
in memory; by the wall clock it comes out alike, not the same.
"""

import random
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import replace
from typing import Final, Protocol

from board_bench import NEW, OLD
from fault_line import FaultyLine, LineFault, Pace, Sender
from witness import LIMITS, Witness

from edge_ident.commissioning.gain_transfer import write_gains
from edge_ident.commissioning.safety import left_safe
from firmware_interface.board import Board
from firmware_interface.errors import EdgeIdentError
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import State

_SINE: Final = Multisine((SineComponent(0.2, 2.0, 0.0),))
MOTION: Final = Trajectory({"x": _SINE, "z": _SINE}, duration_s=0.2, lead_in_s=0.2)
_SAMPLES: Final = 80
_LONG: Final = replace(MOTION, duration_s=30.0)
_LATE_S: Final = (0.03, 0.06, 0.15, 0.7)
"""Within a link's timeout, and beyond everything that a host waits for."""
_QUIET_S: Final = 0.75
"""With the watchdog's time, longer than stop and everything that is still on the line."""
_SETTLING_S: Final = 0.5


class Bench(Protocol):
    """A board behind a line; its time is real or not."""

    line: FaultyLine
    witness: Witness
    watchdog_s: float

    def connect(self) -> Board:
        """A new host on the line."""

    def wait(self, seconds: float) -> None:
        """Nobody asks the board anything for so long."""

    def hang_up(self) -> None:
        """The host's end of the line goes away."""

    def come_back(self) -> None:
        """And is there again."""


class RandomFaults:
    """Chooses a fault for some frames, and now and then cuts the board's power in between."""

    def __init__(self, chance: float, power_cuts: float, draw: random.Random, bench: Bench) -> None:
        self._chance, self._power_cuts = chance, power_cuts
        self._random = draw
        self._witness = bench.witness

    def __call__(self, sender: Sender, frame: bytes) -> LineFault | None:
        """See `fault_line.Choose`."""
        self._witness.see(sender, frame)
        if self._random.random() < self._power_cuts and sender is Sender.HOST:
            self._witness.power_cycle()
        if self._random.random() < self._chance:
            return self._random.choice(list(LineFault))
        return None


class Host:
    """Does what hosts do; a failure is met as the command line meets it."""

    def __init__(self, bench: Bench, draw: random.Random) -> None:
        self.bench = bench
        self.witness = bench.witness
        self._random = draw
        self._board: Board | None = None

    def attempt(self, action: Callable[[Board], None]) -> bool:
        """Try an action; says whether it ended well. Any other error than the tree's goes on."""
        try:
            if self._board is None:
                self._board = self.bench.connect()
            with left_safe(self._board):
                action(self._board)
        except EdgeIdentError:
            if self._random.random() < 0.5:
                self.vanish()
            return False
        finally:
            self.witness.one_motion_per_token()
            self.witness.effort_is_asked_for()
            self.witness.gains_are_whole()
        return True

    def vanish(self) -> None:
        """End without a word, as by kill -9; another host begins anew."""
        if self._board is not None:
            self._board._link.close()
        self._board = None

    # ---- actions

    def make_ready(self, board: Board) -> None:
        """Bring the board to IDLE with confirmed gains and effort, whatever was left."""
        board.claim()
        board.quick_stop()
        if board.status().state is State.FAULT:
            board.clear_fault()
        board.write_register("watchdog.timeout", self.bench.watchdog_s)
        board.enable()

    def move(self, board: Board) -> None:
        """One motion, captured to its last sample."""
        self.make_ready(board)
        board.write_trajectory(MOTION)
        board.arm()
        before = self.witness.motions
        board.start()
        assert self.witness.motions == before + 1
        pages = list(board.capture_pages())
        assert sum(len(page.position_rad) for page in pages) == _SAMPLES
        self.witness.nothing_is_missing(pages)
        board.finish()

    def stop_midway(self, board: Board) -> None:
        """A motion that somebody stops."""
        self.make_ready(board)
        board.write_trajectory(MOTION)
        board.arm()
        board.start()
        board.quick_stop()
        assert board.status().state in (State.IDLE, State.FAULT)

    def leave_moving(self, board: Board) -> None:
        """A host that dies while the machine moves."""
        self.make_ready(board)
        board.write_trajectory(_LONG)
        board.arm()
        board.start()
        self.vanish()
        self.bench.wait(self._random.uniform(0.0, 3 * self.bench.watchdog_s))

    def write_gains(self, board: Board) -> None:
        """Stage, commit and end in one of the ways there are."""
        self.make_ready(board)
        before = board.active_gains()
        wanted = NEW if before == OLD else OLD
        power_ups = self.witness.power_ups
        write_gains(board, wanted)
        self._expect(wanted, power_ups)
        end = self._random.choice([board.confirm, board.roll_back, board.quick_stop])
        end()
        if end != board.quick_stop:  # which rolls back once the axes stand
            self._expect(wanted if end == board.confirm else before, power_ups)
        if end == board.confirm and self._random.random() < 0.5:
            board.store()

    def _expect(self, gains: Mapping[str, AxisGains], power_ups: int) -> None:
        """Make sure that these gains are in force, unless the power was cut meanwhile."""
        in_force = self.witness.virtual.machine.banks.active
        assert in_force == gains or self.witness.power_ups > power_ups

    def look(self, board: Board) -> None:
        """Read what never changes; the limits of the axes differ and have one length."""
        for _ in range(3):
            found = {axis: limit.travel_rad for axis, limit in board.limits().items()}
            assert found == {axis: limit.travel_rad for axis, limit in LIMITS.items()}

    def lose_the_line(self, board: Board) -> None:
        """The adapter is pulled for a while."""
        self.bench.hang_up()
        self.bench.wait(self._random.uniform(0.0, 3 * self.bench.watchdog_s))
        self.bench.come_back()


def run_schedule(seed: int, bench: Bench) -> None:
    """Play one schedule to its end: faults, then a good line on which everything works.

    Raises
    ------
    AssertionError
        An invariant is broken.
    EdgeIdentError
        Something does not work on the good line.
    """
    draw = random.Random(seed)
    bench.line.late_s = draw.choice(_LATE_S)
    bench.line.pace = draw.choice([Pace(), Pace(115200, jitter_s=0.002)])
    host = Host(bench, draw)
    power_cuts = draw.choice([0.0, 0.0, 0.003])
    bench.line.choose = RandomFaults(draw.choice([0.01, 0.04, 0.15]), power_cuts, draw, bench)
    actions = [host.move, host.stop_midway, host.leave_moving, host.write_gains, host.write_gains]
    actions += [host.look, host.look, host.lose_the_line]
    for _ in range(draw.randrange(2, 7)):
        host.attempt(draw.choice(actions))
    host.vanish()
    bench.line.choose = RandomFaults(0.0, 0.0, draw, bench)
    bench.wait(bench.watchdog_s + _QUIET_S)
    bench.hang_up()  # another cable
    bench.come_back()
    bench.witness.stands_still()
    with closing(bench.connect()) as board:
        host.move(board)
        host.write_gains(board)
    bench.wait(_SETTLING_S)
    bench.witness.stands_still()
    bench.witness.one_motion_per_token()
    bench.witness.gains_are_whole()

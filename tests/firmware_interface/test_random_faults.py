"""Any order of verbs over a line with any faults: one motion per token, gains old or new, no
sample missing, the drive stopped in the end, and a good line is enough to go on."""

import random
from contextlib import ExitStack
from pathlib import Path

import pytest
from board_bench import NEW
from fault_line import FaultyLine, LineFault, Sender
from fault_schedule import Host as FaultyHost
from fault_schedule import RandomFaults, run_schedule
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule
from memory_line import MemoryLine, virtual_time
from pty_bench import pty_bench

from firmware_interface.errors import LinkError
from tests.repetitions import a_few, examples


class HostOnABadLine(RuleBasedStateMachine):
    """Verbs and faults in any order, in memory."""

    @initialize()
    def plug_in(self) -> None:
        self.bench = MemoryLine(FaultyLine())
        self.patches = ExitStack()
        self.patches.enter_context(virtual_time(self.bench))
        self.draw = random.Random(0)
        self.host = FaultyHost(self.bench, self.draw)
        self.good_line()

    def teardown(self) -> None:
        if hasattr(self, "patches"):
            self.good_line()
            self.host.vanish()
            self.bench.wait(1.5)
            self.bench.witness.stands_still()
            assert self.host.attempt(self.host.move)
            self.patches.close()

    @rule(frames=st.lists(st.sampled_from([None, None, *LineFault]), max_size=12))
    def faults_to_come(self, frames: list[LineFault | None]) -> None:
        """What happens to the next frames, one after the other."""
        coming = iter(frames)

        def choose(sender: Sender, frame: bytes) -> LineFault | None:
            self.bench.witness.see(sender, frame)
            return next(coming, None)

        self.bench.line.choose = choose

    @rule()
    def good_line(self) -> None:
        self.bench.line.choose = RandomFaults(0.0, 0.0, self.draw, self.bench)
        self.bench.hang_up()
        self.bench.come_back()

    @rule(late_s=st.sampled_from([0.03, 0.06, 0.15, 0.7]))
    def late_frames_are_so_late(self, late_s: float) -> None:
        self.bench.line.late_s = late_s

    @rule()
    def move(self) -> None:
        self.host.attempt(self.host.move)

    @rule()
    def stop_midway(self) -> None:
        self.host.attempt(self.host.stop_midway)

    @rule()
    def leave_moving(self) -> None:
        self.host.attempt(self.host.leave_moving)

    @rule()
    def write_gains(self) -> None:
        self.host.attempt(self.host.write_gains)

    @rule()
    def look(self) -> None:
        self.host.attempt(self.host.look)

    @rule()
    def lose_the_line(self) -> None:
        self.host.attempt(self.host.lose_the_line)

    @rule()
    def another_host_comes(self) -> None:
        self.host.vanish()

    @rule()
    def cut_the_boards_power(self) -> None:
        self.bench.witness.power_cycle()

    @invariant()
    def what_must_hold_holds(self) -> None:
        if hasattr(self, "bench"):
            self.bench.witness.one_motion_per_token()
            self.bench.witness.gains_are_whole()
            self.bench.witness.effort_is_asked_for()


TestHostOnABadLine = HostOnABadLine.TestCase
TestHostOnABadLine.settings = settings(
    max_examples=examples(12), stateful_step_count=12, derandomize=True, deadline=None
)


@pytest.mark.parametrize("seed", a_few([*range(20), 1940, 2050], [*range(5), 1940, 2050]))
def test_random_schedules_in_memory(seed: int) -> None:
    """Some of those of tools/fault_schedules.py; the last two have a reply so late that it is all
    that comes to a request for another axis's registers, which got lost."""
    line = MemoryLine(FaultyLine(seed=seed))
    with virtual_time(line):
        run_schedule(seed, line)


@pytest.mark.parametrize("seed", [20004])
def test_a_random_schedule_on_a_pseudo_terminal(seed: int, tmp_path: Path) -> None:
    with pty_bench(tmp_path, FaultyLine(seed=seed), speed=2.0) as bench:
        run_schedule(seed, bench)


def test_the_witness_sees_a_second_motion_and_mixed_gains() -> None:
    """The judge itself: what it is there to find, it finds."""
    line = MemoryLine(FaultyLine())
    with virtual_time(line):
        host = FaultyHost(line, random.Random(0))
        line.line.choose = RandomFaults(0.0, 0.0, random.Random(0), line)
        assert host.attempt(host.move)
        machine = line.witness.virtual.machine
        machine._setpoints.follow(machine.check.trajectory)  # type: ignore[union-attr]
        with pytest.raises(AssertionError):
            line.witness.one_motion_per_token()
        with pytest.raises(AssertionError):
            line.witness.stands_still()
        line.witness.gains_are_whole()
        machine.drive._controllers[0].gains = NEW["x"]
        with pytest.raises(AssertionError):
            line.witness.gains_are_whole()
        line.witness.effort_is_asked_for()
        machine.drive.powered = False
        machine.drive.sample(machine._setpoints.current)
        with pytest.raises(AssertionError):
            line.witness.effort_is_asked_for()


def test_a_line_in_memory_that_is_not_there_is_a_link_error() -> None:
    line = MemoryLine(FaultyLine())
    line.hang_up()
    with virtual_time(line), pytest.raises(LinkError):
        line.connect()

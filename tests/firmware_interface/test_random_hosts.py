"""Any order of commands, repeats, silences, hostile numbers and other hosts, against the board in
memory."""

import math
from contextlib import suppress
from dataclasses import replace

from board_bench import BETTER, NEW, OLD, Bench
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from witness import EffortWatch

from firmware_interface.codec import addresses, crc32, encode, encode_trajectory
from firmware_interface.errors import BoardError
from firmware_interface.gains import Bank, bank_spans, decode_gains, encode_gains, staged_writes
from firmware_interface.motion import Multisine, SineComponent, Staircase, Trajectory
from firmware_interface.registers import MAP_CRC, REGISTERS, Opcode, Result, State
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.setpoints import TRAJECTORY_ADDRESS, TRAJECTORY_WORDS
from tests.repetitions import examples

FOREIGN = 0x0BADC0DE
SHADOW = bank_spans("shadow")
SHADOW_VALUES = list(addresses(SHADOW))[::2]
"""Where the numbers of both axes stand."""
TINY = 1e-45
HOSTILE = [math.nan, math.inf, -math.inf, 3e38, -3e38, 1e25, 1e-30, TINY, -1.0, 0.0]
numbers = st.one_of(st.sampled_from(HOSTILE), st.floats(-3.0, 3.0, width=32))


def harmless() -> Trajectory:
    sine = Multisine((SineComponent(0.2, 2.0, 0.0),))
    return Trajectory({"x": sine, "z": sine}, 0.2, 0.2)


class BoardUnderRandomHosts(RuleBasedStateMachine):
    """Whatever the order of commands, repeats and silences, and whoever sends them: one motion per
    token and only for the host that holds the board; the active gains are one whole set or
    another; setpoints and efforts are numbers; and there is no effort while not enabled."""

    sets = (OLD, NEW, dict.fromkeys("xz", replace(BETTER, proportional=64.0)))
    illegal = dict.fromkeys("xz", replace(BETTER, derivative=100.0))
    odd = dict.fromkeys(
        "xz",
        replace(
            BETTER,
            velocity_filter_s=0.0,
            coulomb_smoothing_rad_s=TINY,
            stribeck_speed_rad_s=TINY,
            ripple_period_rad=(TINY,) * 4,
        ),
    )

    @initialize()
    def power_up(self) -> None:
        self.bench = Bench()
        self.machine = self.bench.virtual.machine
        self.effort = EffortWatch(self.bench.virtual)
        self.token = 0
        self.sent: list[tuple[int, int, int, int]] = []
        self.started_tokens: set[int] = set()
        self.motions = 0
        self.asked_for_effort = False
        self.accepted: list[Bank] = [decode_gains(encode_gains(OLD))]
        follow = self.machine._setpoints.follow

        def counted(trajectory: Trajectory) -> None:
            self.motions += 1
            follow(trajectory)

        self.machine._setpoints.follow = counted  # type: ignore[method-assign]
        self.write_motion(harmless())
        self.take_the_board(self.bench.key)
        self.bench.wait(0.1)

    # ---- what hosts write

    def write(self, address: int, words: list[int]) -> None:
        """Whatever the board says to it."""
        with suppress(BoardError):
            self.bench.virtual.write(address, words)

    def words(self, address: int, count: int) -> list[int]:
        return self.bench.virtual._registers.words(address, count)

    @property
    def shadow(self) -> list[int]:
        """Words of the shadow bank."""
        return self.bench.virtual._registers.spans(SHADOW)

    def write_motion(self, motion: Trajectory) -> None:
        for address, words in encode_trajectory(motion, SAMPLE_PERIOD_S):
            self.write(address, words)

    def stage(self, gains: Bank) -> None:
        for address, words in staged_writes(gains)[0]:
            self.write(address, words)

    def send(self, opcode: int, token: int, argument: int, key: int) -> None:
        fresh = token not in [sent[1] for sent in self.sent]
        self.sent.append((opcode, token, argument, key))
        held = self.machine.session.key == key
        staged = decode_gains(self.shadow)
        result = self.bench.command(opcode, token, argument, key)
        if fresh and result is Result.DONE:
            assert held or opcode == Opcode.QUICK_STOP
            if opcode == Opcode.START:
                self.started_tokens.add(token)
            if opcode == Opcode.COMMIT:
                self.accepted.append(staged)
            if opcode in (Opcode.ENABLE, Opcode.DISABLE):
                self.asked_for_effort = opcode == Opcode.ENABLE

    # ---- what they do

    @rule(key=st.sampled_from([0, FOREIGN]))
    def take_the_board(self, key: int) -> None:
        self.write(REGISTERS["session.key"].address, encode("session.key", key or self.bench.key))

    @rule(key=st.sampled_from([0, FOREIGN]))
    def let_go_of_the_board(self, key: int) -> None:
        words = encode("session.release", key or self.bench.key)
        self.write(REGISTERS["session.release"].address, words)

    @rule(
        opcode=st.sampled_from(Opcode),
        foreign=st.integers(0, 4).map(lambda n: n == 0),
        right=st.integers(0, 4).map(lambda n: n > 0),
    )
    def command(self, opcode: Opcode, foreign: bool = False, right: bool = True) -> None:
        arguments = {
            Opcode.START: MAP_CRC,
            Opcode.ARM: crc32(self.words(TRAJECTORY_ADDRESS, TRAJECTORY_WORDS)),
            Opcode.COMMIT: crc32(self.shadow),
        }
        self.token += 1
        argument = arguments.get(opcode, 0) ^ (0 if right else 1)
        self.send(opcode, self.token, argument, FOREIGN if foreign else self.bench.key)

    @precondition(lambda self: self.sent)
    @rule(data=st.data())
    def repeat_an_old_frame(self, data: st.DataObject) -> None:
        self.send(*data.draw(st.sampled_from(self.sent[-10:])))

    @rule()
    def move_and_repeat_the_start_afterwards(self) -> None:
        for opcode in (Opcode.ENABLE, Opcode.ARM, Opcode.START):
            self.command(opcode)
            self.silence(0.05)
        start = self.sent[-1]
        self.silence(0.5)
        self.acknowledge()
        self.silence(0.5)
        self.command(Opcode.FINISH)
        self.command(Opcode.ARM)
        self.send(*start)

    @rule(amplitude=numbers, rate=numbers, phase=numbers)
    def write_any_sine_and_go(self, amplitude: float, rate: float, phase: float) -> None:
        sine = Multisine((SineComponent(amplitude, rate, phase), SineComponent(0.1, 1.0, 0.0)))
        self.write_motion(Trajectory({"x": sine, "z": harmless().axes["z"]}, 0.2, 0.2))  # type: ignore[dict-item]
        self.go()

    @rule(speeds=st.lists(numbers, max_size=3), dwell=numbers, acceleration=numbers)
    def write_any_stairs_and_go(
        self, speeds: list[float], dwell: float, acceleration: float
    ) -> None:
        stairs = Staircase(tuple(speeds), dwell, acceleration)
        self.write_motion(Trajectory({"x": stairs, "z": stairs}, 0.2, 0.2))
        self.go()

    def go(self) -> None:
        for opcode in (Opcode.ENABLE, Opcode.ARM, Opcode.START):
            self.command(opcode)
            self.silence(0.01)
        self.silence(0.3)

    @rule(which=st.integers(0, 2))
    def stage_and_commit(self, which: int) -> None:
        self.stage(self.sets[which])
        self.command(Opcode.COMMIT)

    @rule()
    def stage_what_the_board_must_refuse(self) -> None:
        self.stage(self.illegal)

    @rule()
    def commit_odd_gains_that_may_be(self) -> None:
        self.stage(self.odd)
        self.command(Opcode.COMMIT)

    @rule(address=st.sampled_from(SHADOW_VALUES), value=numbers, mended=st.booleans())
    def change_a_gain_and_commit(self, address: int, value: float, mended: bool) -> None:
        self.write(address, encode("shadow.x.proportional", value))
        if mended:
            crc = encode("shadow.crc", crc32(self.shadow))
            self.write(REGISTERS["shadow.crc"].address, crc)
        self.command(Opcode.COMMIT)

    @rule(pressed=st.booleans())
    def press_or_release_the_stop(self, pressed: bool) -> None:
        inputs = self.bench.virtual.inputs
        (inputs.press_stop if pressed else inputs.release_stop)()

    @rule(switches=st.integers(0, 15))
    def press_limit_switches(self, switches: int) -> None:
        self.bench.virtual.inputs.pressed_by_hand = switches

    @rule(seconds=st.sampled_from([0.01, 0.3, 1.3, 5.1]))
    def silence(self, seconds: float) -> None:
        self.bench.wait(seconds)

    @rule(more=st.integers(0, 1))
    def acknowledge(self, more: int = 0) -> None:
        pages = self.machine.capture.pages_written + more
        words = encode("capture.pages_acknowledged", pages)
        self.write(REGISTERS["capture.pages_acknowledged"].address, words)

    # ---- what must hold

    @invariant()
    def gains_are_old_or_new_never_mixed(self) -> None:
        assert self.bench.board.active_gains() in self.accepted
        in_force = [controller.gains for controller in self.machine.drive._controllers]
        assert in_force == list(self.machine.banks.active.values())

    @invariant()
    def one_motion_per_token_and_only_by_the_holder(self) -> None:
        assert self.motions == len(self.started_tokens)

    @invariant()
    def no_effort_without_being_asked(self) -> None:
        """And after every fault it must be asked for anew."""
        self.asked_for_effort &= self.machine.state is not State.FAULT
        assert self.asked_for_effort or not self.machine.enabled

    @invariant()
    def setpoints_and_efforts_are_numbers_and_asked_for(self) -> None:
        self.effort.check()

    @invariant()
    def nothing_is_acknowledged_that_was_not_written(self) -> None:
        capture = self.machine.capture
        assert 0 <= capture._acknowledged <= capture.pages_written
        assert not capture.full or capture.pages_written >= 256


TestBoardUnderRandomHosts = BoardUnderRandomHosts.TestCase
TestBoardUnderRandomHosts.settings = settings(max_examples=examples(25), stateful_step_count=30)

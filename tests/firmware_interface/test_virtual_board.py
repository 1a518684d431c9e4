"""What the board does by itself: watchdog, limits, roll back, tokens, ring, registers."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from firmware_interface.board import Board
from firmware_interface.codec import encode
from firmware_interface.errors import BoardError, LinkError
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import (
    MAP_CRC,
    REGISTERS,
    Fault,
    Opcode,
    Result,
    State,
    WatchdogAction,
)
from firmware_interface.virtual import gain_banks
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.clock import RequestClock, WallClock
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.settings import CONSERVATIVE_GAINS, DEFAULT_LIMITS, BoardSettings

BETTER = AxisGains(128.0, 16.0, 0.0, 0.0078125, 0.375, 0.75, 1.25, 0.5, 0.0625)
OLD = dict.fromkeys(
    "xz", replace(CONSERVATIVE_GAINS, velocity_filter_s=1 / 128, coulomb_smoothing_rad_s=0.125)
)
NEW = dict.fromkeys("xz", BETTER)


class Bench:
    """A board, the host's verbs for it, and time that passes without the host."""

    def __init__(self, **changed: object) -> None:
        self.clock = RequestClock()
        self.virtual = VirtualBoard(BoardSettings(gains=OLD, **changed), self.clock)  # type: ignore[arg-type]
        self.board = Board.connect(self.virtual)

    def wait(self, seconds: float) -> None:
        """Nobody asks the board anything for so long."""
        self.clock.let_pass(self.virtual.machine, round(seconds / SAMPLE_PERIOD_S))

    def start(self, motion: Trajectory) -> None:
        self.board.write_trajectory(motion)
        self.board.arm()
        self.board.start()

    def command(self, opcode: int, token: int, argument: int = 0) -> Result:
        words = encode("command.opcode", opcode) + encode("command.token", token)
        words += encode("command.argument", argument)
        self.virtual.write(REGISTERS["command.opcode"].address, words)
        return self.board.status().last_result


def long_motion(amplitude_rad: float = 1.0) -> Trajectory:
    sine = Multisine((SineComponent(amplitude_rad, 0.5, 0.0),))
    return Trajectory({"x": sine, "z": sine}, duration_s=60.0, lead_in_s=0.5)


@pytest.mark.parametrize("action", list(WatchdogAction))
def test_the_board_stops_by_itself_when_the_host_is_gone(action: WatchdogAction) -> None:
    bench = Bench()
    bench.virtual.write(REGISTERS["watchdog.action"].address, [action])
    bench.start(long_motion())
    bench.wait(0.8)
    assert bench.virtual.machine.state is State.MOVING
    bench.wait(3.0)
    machine = bench.virtual.machine
    assert (machine.state, machine.fault) == (State.FAULT, Fault.WATCHDOG)
    assert max(abs(machine.drive.plant.output_rad_s)) < 1e-3
    with pytest.raises(BoardError, match="no valid frame came from the host"):
        list(bench.board.capture_pages())


def test_any_frame_keeps_the_watchdog_quiet() -> None:
    bench = Bench()
    bench.start(long_motion())
    for _ in range(5):
        bench.wait(0.6)
        bench.board.status()
    assert bench.virtual.machine.state is State.MOVING


def test_a_shorter_watchdog_time_counts() -> None:
    bench = Bench()
    bench.virtual.write(REGISTERS["watchdog.timeout"].address, encode("watchdog.timeout", 0.3))
    bench.start(long_motion())
    bench.wait(1.5)
    assert bench.virtual.machine.fault is Fault.WATCHDOG


def test_silence_at_rest_is_no_fault() -> None:
    bench = Bench()
    bench.wait(5.0)
    assert bench.virtual.machine.state is State.IDLE


@pytest.mark.parametrize(
    ("fault", "limit"),
    [
        (Fault.TRAVEL, {"travel_rad": 0.5}),
        (Fault.SPEED, {"speed_rad_s": 0.2}),
        (Fault.FOLLOWING_ERROR, {"following_error_rad": 0.02}),
    ],
)
def test_the_board_enforces_its_limits_during_the_motion(
    fault: Fault, limit: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(limits=dict.fromkeys("xz", replace(DEFAULT_LIMITS, **limit)))
    # a motion within limits that goes astray: the check before the motion is not what is tested
    monkeypatch.setattr(
        "firmware_interface.virtual.machine.within_limits", lambda *_arguments: True
    )
    bench.start(long_motion())
    with pytest.raises(BoardError, match=f"fault {fault.name}"):
        list(bench.board.capture_pages())
    bench.wait(1.0)
    machine = bench.virtual.machine
    assert machine.state is State.FAULT
    assert machine.fault_sample > 0
    assert max(abs(machine.drive.plant.output_rad_s)) < 1e-3


def test_effort_is_clipped_at_its_limit(short_motion: Trajectory) -> None:
    weak = dict.fromkeys("xz", replace(DEFAULT_LIMITS, effort_nm=2.0))
    bench = Bench(limits=weak)
    bench.start(short_motion)
    efforts = [abs(page.effort_nm).max() for page in bench.board.capture_pages()]
    assert max(efforts) == pytest.approx(2.0, abs=0.004)


def test_quick_stop_decelerates_instead_of_dropping_the_effort() -> None:
    bench = Bench()
    bench.start(long_motion())
    bench.wait(0.6)
    bench.board.quick_stop()
    machine = bench.virtual.machine
    assert machine.state is State.IDLE
    assert machine.drive.powered
    assert max(abs(machine.drive.plant.output_rad_s)) < 1e-3


def test_unconfirmed_gains_are_rolled_back_when_the_window_ends(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(gain_banks, "CONFIRM_WINDOW_S", 2.0)
    bench = Bench()
    bench.board.stage_gains(NEW)
    bench.board.commit()
    bench.wait(1.9)
    assert bench.board.active_gains() == NEW
    assert 0.0 < bench.board.status().confirm_remaining_s < 0.2
    bench.wait(0.2)
    assert bench.board.active_gains() == OLD
    with pytest.raises(BoardError, match="window may have expired"):
        bench.board.confirm()


def test_the_window_does_not_change_gains_during_a_motion(
    monkeypatch: pytest.MonkeyPatch, short_motion: Trajectory
) -> None:
    monkeypatch.setattr(gain_banks, "CONFIRM_WINDOW_S", 0.3)
    bench = Bench()
    bench.board.stage_gains(NEW)
    bench.board.commit()
    bench.start(short_motion)
    bench.wait(0.5)
    assert bench.board.status().state is State.MOVING
    assert bench.board.active_gains() == NEW
    list(bench.board.capture_pages())
    bench.board.finish()
    assert bench.board.active_gains() == OLD


@pytest.mark.parametrize("end", ["quick stop", "watchdog"])
def test_a_stop_with_unconfirmed_gains_rolls_back_once_at_rest(end: str) -> None:
    bench = Bench()
    bench.board.stage_gains(NEW)
    bench.board.commit()
    bench.start(long_motion())
    bench.wait(0.6)
    if end == "quick stop":
        bench.board.quick_stop()
    else:
        bench.wait(3.0)
    assert not bench.board.status().unconfirmed
    assert bench.board.active_gains() == OLD


def test_committed_gains_are_those_that_the_controllers_use() -> None:
    """Twice the stiffness, without anything else, halves the lag behind a constant speed."""
    lags = []
    for scale in (1.0, 2.0):
        bench = Bench()
        old = OLD["x"]
        stiffer = replace(
            old, proportional=scale * old.proportional, derivative=scale * old.derivative
        )
        bench.board.stage_gains(dict.fromkeys("xz", stiffer))
        bench.board.commit()
        bench.start(long_motion())
        page = next(islice(bench.board.capture_pages(), 30, None))
        lags.append(page.following_error_rad[0])
    assert lags[1] == pytest.approx(lags[0] / 2.0, rel=0.1)


def test_a_token_seen_before_is_ignored_even_if_not_the_last() -> None:
    bench = Bench()
    bench.board.stage_gains(NEW)
    assert bench.command(Opcode.COMMIT, 101) is Result.DONE
    assert bench.command(Opcode.ROLL_BACK, 102) is Result.DONE
    assert bench.command(Opcode.COMMIT, 101) is Result.DONE  # still the result of 102
    assert bench.board.status().last_token == 102
    assert bench.board.active_gains() == OLD


def test_start_needs_the_map_crc(short_motion: Trajectory) -> None:
    bench = Bench()
    bench.board.write_trajectory(short_motion)
    bench.board.arm()
    assert bench.command(Opcode.START, 900, MAP_CRC ^ 1) is Result.WRONG_ARGUMENT
    assert bench.command(99, 901) is Result.UNKNOWN_COMMAND
    assert bench.command(Opcode.START, 902, MAP_CRC) is Result.DONE


def test_store_needs_its_signature() -> None:
    assert Bench().command(Opcode.STORE, 900, 0x12345678) is Result.WRONG_ARGUMENT


def test_registers_keep_their_access_and_ranges() -> None:
    board = VirtualBoard()
    for address, words in (
        (REGISTERS["identity.magic"].address, [0, 0]),
        (REGISTERS["active.x.proportional"].address, [0, 0]),
        (REGISTERS["watchdog.timeout"].address, [0]),
        (REGISTERS["command.opcode"].address, [Opcode.ARM]),  # without token and argument
        (0x0F00, [1]),
        (0xFFFF, [1]),
    ):
        with pytest.raises(BoardError):
            board.write(address, words)
    with pytest.raises(BoardError, match="no registers to read"):
        board.read(0x0F00, 1)


def test_time_stands_still_while_the_ring_is_full() -> None:
    """At full speed nothing is lost, however late the host fetches."""
    bench = Bench()
    bench.start(replace(long_motion(), duration_s=12.0))
    for _ in range(60):
        bench.board.status()
    assert bench.board.status().pages_written == 256
    pages = list(bench.board.capture_pages())
    assert [page.first_sample for page in pages] == list(range(0, 4800, 14))


def test_a_ring_that_overflows_in_real_time_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr(WallClock, "now_s", lambda self: now)
    virtual = VirtualBoard(clock=WallClock(1.0))

    def passing() -> Iterator[None]:
        nonlocal now
        while True:
            now += 0.02
            yield

    ticks = passing()
    read = virtual.read
    monkeypatch.setattr(virtual, "read", lambda a, n: (next(ticks), read(a, n))[1])
    board = Board.connect(virtual)
    board.write_trajectory(long_motion())
    next(ticks)
    for _ in range(10):
        board.status()
    board.arm()
    board.start()
    while board.status().overflows == 0:
        pass
    with pytest.raises(LinkError, match="overwritten before they were fetched"):
        list(board.capture_pages())


class BoardUnderRandomHosts(RuleBasedStateMachine):
    """Whatever the order of commands, repeats and silences: one motion per token, and the
    active gains are one whole set or another."""

    sets = (OLD, NEW, dict.fromkeys("xz", replace(BETTER, proportional=64.0)))
    illegal = dict.fromkeys("xz", replace(BETTER, derivative=100.0))

    @initialize()
    def power_up(self) -> None:
        self.bench = Bench()
        self.token = 0
        self.sent: list[tuple[int, int, int]] = []
        self.started_tokens: set[int] = set()
        self.motions = 0
        follow = self.bench.virtual.machine._setpoints.follow

        def counted(trajectory: Trajectory) -> None:
            self.motions += 1
            follow(trajectory)

        self.bench.virtual.machine._setpoints.follow = counted  # type: ignore[method-assign]
        sine = Multisine((SineComponent(0.2, 2.0, 0.0),))
        self.bench.board.write_trajectory(Trajectory({"x": sine, "z": sine}, 0.2, 0.2))

    def send(self, opcode: int, token: int, argument: int) -> None:
        fresh = token not in [sent[1] for sent in self.sent]
        self.sent.append((opcode, token, argument))
        result = self.bench.command(opcode, token, argument)
        if fresh and opcode == Opcode.START and result is Result.DONE:
            self.started_tokens.add(token)

    @rule(opcode=st.sampled_from(Opcode))
    def command(self, opcode: Opcode) -> None:
        self.token += 1
        self.send(opcode, self.token, MAP_CRC if opcode is Opcode.START else 0)

    @precondition(lambda self: self.sent)
    @rule(data=st.data())
    def repeat_an_old_frame(self, data: st.DataObject) -> None:
        self.send(*data.draw(st.sampled_from(self.sent[-10:])))

    @rule()
    def repeat_a_start_after_its_motion(self) -> None:
        self.command(Opcode.ARM)
        self.command(Opcode.START)
        start = self.sent[-1]
        self.silence(0.5)
        self.fetch_and_acknowledge()
        self.silence(0.5)
        self.command(Opcode.FINISH)
        self.command(Opcode.ARM)
        self.send(*start)

    @rule(which=st.integers(0, 2))
    def stage(self, which: int) -> None:
        self.bench.board.stage_gains(self.sets[which])

    @rule(which=st.integers(0, 2))
    def stage_and_commit(self, which: int) -> None:
        self.stage(which)
        self.command(Opcode.COMMIT)

    @rule()
    def stage_what_the_board_must_refuse(self) -> None:
        self.bench.board.stage_gains(self.illegal)

    @rule(word=st.integers(0, 35))
    def change_a_word_of_the_bank_and_commit(self, word: int) -> None:
        address = REGISTERS["shadow.x.proportional"].address + word
        self.bench.virtual.write(address, [self.bench.virtual.read(address, 1)[0] ^ 1])
        self.command(Opcode.COMMIT)

    @rule(seconds=st.sampled_from([0.01, 0.3, 1.3]))
    def silence(self, seconds: float) -> None:
        self.bench.wait(seconds)

    @rule()
    def fetch_and_acknowledge(self) -> None:
        pages = self.bench.board.status().pages_written
        self.bench.board._acknowledge(pages)

    @invariant()
    def gains_are_old_or_new_never_mixed(self) -> None:
        assert self.bench.board.active_gains() in self.sets
        machine = self.bench.virtual.machine
        in_force = [controller.gains for controller in machine.drive._controllers]
        assert in_force == list(machine.banks.active.values())

    @invariant()
    def one_motion_per_token(self) -> None:
        assert self.motions == len(self.started_tokens)


TestBoardUnderRandomHosts = BoardUnderRandomHosts.TestCase
TestBoardUnderRandomHosts.settings = settings(max_examples=25, stateful_step_count=30)

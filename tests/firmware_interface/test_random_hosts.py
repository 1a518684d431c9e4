"""Any order of commands, repeats and silences, against the in-memory board."""

from dataclasses import replace

from board_bench import BETTER, NEW, OLD, Bench
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import MAP_CRC, REGISTERS, Opcode, Result


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

    @rule(word=st.integers(0, 95))
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

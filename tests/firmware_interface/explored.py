"""Every sequence of operations up to a length on the virtual board, as `simulated/explore.c` on C.

Two sequences that lead to the same situation are one: the board's state, with times and speeds in a
few steps. The first that leads there, a shortest one, goes on. What must hold is looked at after
every sample and every operation. Where nobody asks for anything, the board's clock runs faster than
its samples, as it may on a busy computer.
"""

import pickle
from collections import Counter
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import Final

from board_bench import OLD

from firmware_interface.board import Board
from firmware_interface.codec import crc32, encode
from firmware_interface.errors import BusyError
from firmware_interface.gains import bank_spans
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import (
    MAP_CRC,
    MAP_VERSION,
    REGISTERS,
    STORE_SIGNATURE,
    Fault,
    Opcode,
    Result,
    State,
)
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.machine import Machine
from firmware_interface.virtual.settings import BoardSettings

KEY, OTHER_KEY = 0x13579BDF, 0x2468ACE0
WINDOW_S: Final = 2.0
OTHER: Final = {axis: replace(old, proportional=60.0, derivative=6.0) for axis, old in OLD.items()}
_SINE: Final = Multisine((SineComponent(0.3, 4.0, 0.0),))
_TABLE: Final = Trajectory({"x": _SINE, "z": _SINE}, duration_s=0.15, lead_in_s=0.1)
_LONGEST_STOP_SAMPLES: Final = 1010
"""0.5 s, and 2 s until the axes stand: docs/safety.md."""
_SHAKE_SAMPLES, _SHAKE_RAD_S, _PUSH_RAD_S = 8, 0.4, 1.5


class BrokenError(AssertionError):
    """What must hold does not."""


def require(holds: bool, what: str) -> None:
    if not holds:
        raise BrokenError(what)


class Time:
    """Passes a sample with every request; looks at each."""

    def __init__(self) -> None:
        self._now_s = 0.0
        self.step_s = SAMPLE_PERIOD_S
        self.shaking = False
        self.stopping = 0

    def now_s(self) -> float:
        return self._now_s

    def advance(self, machine: Machine, status_read: bool) -> None:
        self._now_s += self.step_s
        plant = machine.drive.plant
        if self.shaking:
            up = machine.samples // _SHAKE_SAMPLES % 2
            plant._axes[0].velocity = (_SHAKE_RAD_S * (2 * up - 1),) * 3
        powered, stopped = machine.enabled, machine.inputs.sto_active
        machine.sample()
        effort = any(plant._commands[-1])
        require(powered or not (effort or machine.enabled), "effort by itself")
        require(not (stopped and (effort or machine.enabled)), "effort under STO")
        stops = machine.state is State.STOPPING and machine.enabled
        self.stopping = self.stopping + 1 if stops else 0
        require(self.stopping <= _LONGEST_STOP_SAMPLES, "a stop lasts longer than it may")

    def idle(self, machine: Machine) -> None:
        pass


class Trial:
    """A board, and all that operations do to it; pickled, it is put aside."""

    def __init__(self) -> None:
        self.time = Time()
        self.virtual = VirtualBoard(BoardSettings(gains=OLD, confirm_window_s=WINDOW_S), self.time)
        host = Board.connect(self.virtual)
        host.write_trajectory(_TABLE)
        host.stage_gains(OTHER)
        self.table_crc = host._trajectory_crc
        self.bank_crc = self.virtual._registers.integer("shadow.crc")
        host.release()
        self.settled, self.token = OLD, 0
        self.unconfirmed = self.stopped = self.broken = False
        self.heartbeat()

    @property
    def machine(self) -> Machine:
        return self.virtual.machine

    def operate(self, name: str) -> None:
        """Carry out one of OPERATIONS, and look what became of it."""
        powered = self.machine.enabled
        OPERATIONS[name](self)
        self._note_commit()
        machine, active = self.machine, self.machine.banks.active
        require(powered or not machine.enabled or "ENABLE" in name, "enabled without ENABLE")
        require(active in (OLD, OTHER), "gains that are a mixture")
        words = self.virtual._registers.spans(bank_spans("active", MAP_VERSION))
        crc = self.virtual._registers.integer("active.crc")
        require(crc == crc32(words), "the active bank's CRC is wrong")
        told = machine.state in (State.FAULT, State.STOPPING)
        require(told or machine.fault is Fault.NONE, "a fault that the state does not tell")
        if not machine.banks.unconfirmed:
            self.settled = active

    def _note_commit(self) -> None:
        """Gains of another commit are not those that a stop takes back."""
        unconfirmed = self.machine.banks.unconfirmed
        self.stopped = self.stopped and (self.unconfirmed or not unconfirmed)
        self.unconfirmed = unconfirmed

    # ---- operations

    def command(self, opcode: Opcode, argument: int = 0, key: int = KEY) -> None:
        self.token += 1
        words = encode("command.opcode", opcode) + encode("command.token", self.token)
        words += encode("command.argument", argument) + encode("command.key", key)
        self.virtual.write(REGISTERS["command.opcode"].address, words)

    def stop(self, key: int = KEY) -> None:
        self.command(Opcode.QUICK_STOP, key=key)
        self.stopped = True

    def heartbeat(self) -> None:
        try:
            pages = self.machine.capture.pages_written
            words = encode("session.key", KEY) + encode("capture.pages_acknowledged", pages)
            self.virtual.write(REGISTERS["session.key"].address, words)
        except BusyError:  # this key was stopped
            pass

    def samples(self, count: int, seconds: float = 0.0) -> None:
        """Let so many pass, in so many seconds of the board's clock."""
        self.time.step_s = seconds / count if seconds else SAMPLE_PERIOD_S
        for _ in range(count):
            self.time.advance(self.machine, False)
            self._note_commit()
        self.time.step_s = SAMPLE_PERIOD_S

    def half_a_second(self) -> None:
        """After a stop or a fault the old gains are back as soon as the axes stand."""
        self.samples(200)
        over = self.stopped or self.machine.fault is not Fault.NONE
        waits = over and self.machine.drive.at_rest and self.machine.banks.unconfirmed
        require(not waits, "no roll-back after a stop or a fault")

    def leave_alone(self) -> None:
        """Every motion and every stop ends, and gains that nobody confirmed are gone."""
        # most stand, and then there is little to see
        moves = self.machine.busy or any(self.machine.drive.plant.output_rad_s)
        self.samples(1200 if moves or self.time.shaking else 200, 12.0)
        machine, over = self.machine, (State.IDLE, State.ARMED, State.DONE, State.FAULT)
        require(machine.state in over, "a motion or a stop without an end")
        require(machine.banks.active == self.settled, "no roll-back came")
        require(machine.session.key == 0, "a host that is gone holds the board")
        still = self.time.shaking or not machine.enabled or machine.drive.at_rest
        require(still, "effort that keeps an axis moving")

    def move(self) -> None:
        """Three at once, or most sequences would be too short to get into a motion."""
        self.command(Opcode.ENABLE)
        self.command(Opcode.ARM, self.table_crc)
        self.samples(10)
        self.command(Opcode.START, MAP_CRC)

    def push(self) -> None:
        self.machine.drive.plant._axes[0].velocity = (_PUSH_RAD_S,) * 3

    def break_coupling(self) -> None:
        self.machine.drive.plant.break_coupling(0)
        self.broken = True

    def shake(self) -> None:
        self.time.shaking = not self.time.shaking

    # ---- situations

    def situation(self) -> Hashable:
        """What tells two of them apart."""
        machine = self.machine
        session, banks = machine.session, machine.banks
        return (
            (machine.state, machine.fault, machine.enabled, machine.roll_back_due),
            (machine.inputs.sto_active, machine.inputs.sto_latched),
            (self.time.shaking, self.broken),
            (banks.unconfirmed, banks.active == OLD, banks.stored == OLD, self.settled == OLD),
            (machine.drive.at_rest, machine.moving, machine.capture.drained, self.stopped),
            (session.key, int(session.remaining_s), min(int(session.silence_s * 4.0), 4)),
            int(banks.remaining_s(self.time.now_s()) * 2.0),
            machine.handover.result is Result.PENDING,
            int(abs(machine.drive.plant.output_rad_s[0]) * 4.0),
        )


def _commands(opcode: Opcode, argument: str = "") -> Callable[[Trial], None]:
    return lambda trial: trial.command(opcode, getattr(trial, argument) if argument else 0)


OPERATIONS: Final[dict[str, Callable[[Trial], None]]] = {
    **{
        opcode.name: _commands(opcode)
        for opcode in (
            Opcode.ENABLE,
            Opcode.DISABLE,
            Opcode.FINISH,
            Opcode.CONFIRM,
            Opcode.ROLL_BACK,
            Opcode.CLEAR_FAULT,
        )
    },
    "ARM": _commands(Opcode.ARM, "table_crc"),
    "COMMIT": _commands(Opcode.COMMIT, "bank_crc"),
    "COMMIT_RUNNING": _commands(Opcode.COMMIT_RUNNING, "bank_crc"),
    "START": lambda trial: trial.command(Opcode.START, MAP_CRC),
    "STORE": lambda trial: trial.command(Opcode.STORE, STORE_SIGNATURE),
    "QUICK_STOP": Trial.stop,
    "QUICK_STOP by another host": lambda trial: trial.stop(OTHER_KEY),
    "heartbeat": Trial.heartbeat,
    "stop pressed": lambda trial: trial.virtual.inputs.press_stop(),
    "stop released": lambda trial: trial.virtual.inputs.release_stop(),
    "25 ms": lambda trial: trial.samples(10),
    "0.5 s": Trial.half_a_second,
    "silence of 1.25 s": lambda trial: trial.samples(200, 1.25),
    "silence of 12 s": Trial.leave_alone,
    "axis pushed": Trial.push,
    "shaking begins or ends": Trial.shake,
    "power cut": lambda trial: trial.virtual.power_cycle(),
    "ENABLE, ARM, 25 ms, START": Trial.move,
    "coupling broken": Trial.break_coupling,
}


@dataclass(frozen=True)
class Kept:
    """A trial put aside, with the operations that led there, and those still to be repeated."""

    path: tuple[str, ...]
    pickled: bytes
    repeated: tuple[str, ...]

    def trial(self) -> Trial:
        """The trial, as it was."""
        trial: Trial = pickle.loads(self.pickled)
        for name in self.repeated:
            trial.operate(name)
        return trial

    def then(self, name: str, trial: Trial) -> "Kept":
        """What an operation made of it."""
        path = (*self.path, name)
        try:
            return Kept(path, pickle.dumps(trial), ())
        except TypeError:  # in the middle of a check: a generator is not put aside
            return Kept(path, self.pickled, (*self.repeated, name))


@dataclass(frozen=True)
class Explored:
    """What a search met.

    Attributes
    ----------
    sequences : int
        That were tried.
    states : Counter
        Situations by the state of the board.
    """

    sequences: int
    states: Counter[State]


def explore(depth: int) -> Explored:
    """Try every sequence of operations up to this length.

    Raises
    ------
    BrokenError
        The shortest one that breaks something.
    """
    begun = Trial()
    known: set[Hashable] = {begun.situation()}
    ends = [Kept((), pickle.dumps(begun), ())]
    sequences, states = 0, Counter[State]()
    for length in range(depth):
        longer = []
        for end in ends:
            for name in OPERATIONS:
                trial = end.trial()
                sequences += 1
                try:
                    trial.operate(name)
                except BrokenError as broken:
                    raise BrokenError(f"{broken}, after: {', '.join((*end.path, name))}") from None
                if (situation := trial.situation()) not in known:
                    known.add(situation)
                    states[trial.machine.state] += 1
                    if length + 1 < depth:
                        longer.append(end.then(name, trial))
        ends = longer
    return Explored(sequences, states)

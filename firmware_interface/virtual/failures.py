"""What fails on a virtual board, its machine and its line, each at its time.

`encoder_lost=x@3s` is a failure as a person writes it: what fails, on which axis, and when. Times
are the board's own: from its start, or from the start of a motion.
"""

import difflib
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Self, cast

from firmware_interface.errors import NoReplyError
from firmware_interface.plant.feed_drive import feed_drive
from firmware_interface.plant.plant import Plant
from firmware_interface.registers import AXES, State
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.clock import Clock, RequestClock
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.identification import Identifier
from firmware_interface.virtual.machine import Machine
from firmware_interface.virtual.settings import BoardSettings

OF_AXIS: Final = ("encoder_lost", "jam", "coupling", "limit_switch")
OF_BOARD: Final = ("sto", "cable", "brownout")
ENDING: Final = ("limit_switch", "sto", "cable")
"""Those that may be over again; the others stay, and a brownout is over at once."""
_WISH: Final = re.compile(r"(?P<name>[^=@]*)(?:=(?P<axis>[^@]*))?(?:@(?P<time>.*))?", re.DOTALL)
_TIME: Final = re.compile(
    r"(?:motion(?P<motion>[1-9]?)\+)?(?P<begin>\d+(?:\.\d+)?)s(?:-(?P<end>\d+(?:\.\d+)?)s)?",
    re.ASCII,
)


@dataclass(frozen=True)
class Failure:
    """One failure and its time.

    Attributes
    ----------
    text : str
        As it was written.
    name : str
        One of OF_AXIS or OF_BOARD.
    axis : int
        Number of its axis; 0 where it has none.
    motion : int
        Times count from the start of this motion, 1 being the first; 0: from the board's start.
    begin_s, end_s : float
        `end_s` is infinite where it stays.
    """

    text: str
    name: str
    axis: int
    motion: int
    begin_s: float
    end_s: float

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read `NAME[=AXIS][@[motion[N]+]SECONDSs[-SECONDSs]]`; it begins at once by default.

        Raises
        ------
        ValueError
            There is no such failure, axis or time; says what there is.
        """
        wish = _WISH.fullmatch(text)
        assert wish is not None  # it takes any text
        name, axis = wish["name"], wish["axis"]
        if name not in OF_AXIS + OF_BOARD:
            near = difflib.get_close_matches(name, OF_AXIS + OF_BOARD, 1)
            meant = f": did you mean {near[0]}?" if near else "."
            known = ", ".join((*(f"{one}=AXIS" for one in OF_AXIS), *OF_BOARD))
            raise ValueError(f"there is no failure {name!r}{meant} Known are: {known}")
        if name in OF_AXIS and axis not in AXES:
            known = " and ".join(AXES)
            raise ValueError(f"{text}: name its axis, as in {name}={AXES[0]}@3s; there are {known}")
        if name in OF_BOARD and axis is not None:
            raise ValueError(f"{text}: {name} has no axis")
        motion, begin_s, end_s = _moment(text, wish["time"])
        if end_s < math.inf and name not in ENDING:
            raise ValueError(f"{text}: {name} does not end; these do: {', '.join(ENDING)}")
        return cls(text, name, AXES.index(axis) if axis else 0, motion, begin_s, end_s)


def _moment(text: str, time: str | None) -> tuple[int, float, float]:
    """Motion, begin and end of a failure, in s."""
    if time is None:
        return 0, 0.0, math.inf
    moment = _TIME.fullmatch(time)
    if moment is None:
        raise ValueError(
            f"{text}: {time!r} is no time. Write @3s for 3 s after the board's start, @motion+3s "
            "after that of the first motion, @motion2+3s of the second, and @3s-5s for what ends"
        )
    begin_s, end_s = float(moment["begin"]), float(moment["end"] or math.inf)
    if end_s <= begin_s:
        raise ValueError(f"{text}: it ends before it begins")
    motion = 0 if moment["motion"] is None else int(moment["motion"] or 1)
    return motion, begin_s, end_s


class FailingBoard(VirtualBoard):
    """A virtual board on which things fail, each at its time.

    Parameters
    ----------
    failures : sequence of Failure
    settings, clock, plant, identifier
        As of `VirtualBoard`.
    on_failure : callable, optional
        Gets a line when one begins or ends.
    """

    def __init__(
        self,
        failures: Sequence[Failure],
        settings: BoardSettings | None = None,
        clock: Clock | None = None,
        plant: Plant | None = None,
        identifier: Identifier | None = None,
        on_failure: Callable[[str], object] = lambda line: None,
    ) -> None:
        self._to_come = list(failures)
        self._lasting: list[Failure] = []
        self._on_failure = on_failure
        self._samples = 0
        self._starts = [0]
        """Samples at the board's start and at that of each motion."""
        self._moved = False
        clock = _ClockOf(self, clock or RequestClock())
        super().__init__(settings, clock, plant or Plant(feed_drive()), identifier)

    def read(self, address: int, count: int) -> list[int]:
        """Words of consecutive registers, if the line is whole."""
        self._check_line()
        return super().read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        """Write consecutive registers, if the line is whole."""
        self._check_line()
        super().write(address, words)

    def pass_sample(self) -> None:
        """Let one control period pass, and what is due before it."""
        moves = self.machine.state is State.MOVING
        if moves and not self._moved:
            self._starts.append(self._samples)
        self._moved = moves
        for failure in self._due(self._to_come, [one.begin_s for one in self._to_come]):
            self._tell(failure, "begins")
            self._lasting.append(failure)
            self._begin(failure)
        for failure in self._due(self._lasting, [one.end_s for one in self._lasting]):
            self._tell(failure, "ends")
            self._end(failure)
        self._samples += 1
        self.machine.sample()

    def _due(self, failures: list[Failure], after_s: Sequence[float]) -> list[Failure]:
        """Take those out whose time has come."""
        due = [
            failure
            for failure, seconds in zip(failures, after_s, strict=True)
            if failure.motion < len(self._starts)
            and self._samples >= self._starts[failure.motion] + seconds / SAMPLE_PERIOD_S
        ]
        for failure in due:
            failures.remove(failure)
        return due

    def _tell(self, failure: Failure, happens: str) -> None:
        time_s = self._samples * SAMPLE_PERIOD_S
        self._on_failure(f"{failure.text} {happens}, {time_s:.2f} s after the board's start")

    def _begin(self, failure: Failure) -> None:
        plant = self.machine.drive.plant
        match failure.name:
            case "encoder_lost":
                plant.lose_encoder(failure.axis)
            case "jam":
                plant.jam(failure.axis)
            case "coupling":
                plant.break_coupling(failure.axis)
            case "limit_switch":
                self.inputs.pressed_by_hand |= 0b11 << 2 * failure.axis
            case "sto":
                self.inputs.press_stop()
            case "brownout":
                self.power_cycle()

    def _end(self, failure: Failure) -> None:
        match failure.name:
            case "limit_switch":
                self.inputs.pressed_by_hand &= ~(0b11 << 2 * failure.axis)
            case "sto":
                self.inputs.release_stop()

    def _check_line(self) -> None:
        """A request on a line that is cut takes its time, and reaches nobody."""
        if any(failure.name == "cable" for failure in self._lasting):
            self._clock.advance(self.machine, False)
            raise NoReplyError("the virtual board's cable has failed", "look at the cable")


class _ClockOf:
    """A clock whose samples are those of a failing board, with the machine that it has then."""

    def __init__(self, board: FailingBoard, clock: Clock) -> None:
        self._clock = clock
        self._machine = cast(Machine, _MachineOf(board))
        self.now_s = clock.now_s

    def advance(self, machine: Machine, status_read: bool) -> None:
        """As the clock does."""
        self._clock.advance(self._machine, status_read)

    def idle(self, machine: Machine) -> None:
        """As the clock does."""
        self._clock.idle(self._machine)


class _MachineOf:
    """The machine that a board has at present: a brownout gives it another one."""

    def __init__(self, board: FailingBoard) -> None:
        self._board = board

    def sample(self) -> None:
        self._board.pass_sample()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._board.machine, name)

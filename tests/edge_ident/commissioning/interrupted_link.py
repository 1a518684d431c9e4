"""A link to the virtual board whose host is interrupted, or dies, at a phase of a run."""

from collections.abc import Callable

from firmware_interface.errors import LinkError
from firmware_interface.registers import REGISTERS, Opcode, State
from firmware_interface.virtual.board import VirtualBoard

_COMMAND = REGISTERS["command.opcode"].address
_SHADOW = REGISTERS["shadow.x.proportional"].address
_WELL_INTO_IT = 1000


class Killed(BaseException):
    """The host's process is gone: nothing that it would do afterwards happens."""


class InterruptedLink:
    """Passes requests on until a phase of a run is reached.

    Parameters
    ----------
    virtual : VirtualBoard
    phase : str
        A key of `PHASES`.
    end : type of BaseException
        KeyboardInterrupt is raised once; after Killed no request gets through any more.
    """

    def __init__(self, virtual: VirtualBoard, phase: str, end: type[BaseException]) -> None:
        self.virtual = virtual
        self.starts = 0
        self.struck = False
        self._reached = PHASES[phase]
        self._end = end

    def read(self, address: int, count: int) -> list[int]:
        self._look(address, [])
        return self.virtual.read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        self._look(address, words)
        if address == _COMMAND and words[0] == Opcode.START:
            self.starts += 1
        self.virtual.write(address, words)

    def close(self) -> None:
        """Nothing to let go of."""

    def _look(self, address: int, words: list[int]) -> None:
        if self.struck and self._end is Killed:
            raise LinkError("the host is dead", "start it again")
        if not self.struck and self._reached(self, address, words):
            self.struck = True
            raise self._end


def _moving(starts: int, *, captured: bool) -> Callable[[InterruptedLink, int, list[int]], bool]:
    def reached(link: InterruptedLink, address: int, words: list[int]) -> bool:
        machine = link.virtual.machine
        samples = machine.capture.samples
        in_it = samples > _WELL_INTO_IT if captured else samples == 0
        return link.starts == starts and machine.state is State.MOVING and in_it

    return reached


def _commands(opcode: Opcode) -> Callable[[InterruptedLink, int, list[int]], bool]:
    def reached(link: InterruptedLink, address: int, words: list[int]) -> bool:
        return _both_moved(link) and address == _COMMAND and words[:1] == [opcode]

    return reached


def _both_moved(link: InterruptedLink) -> bool:
    """Both motions with the old gains are over; before the second the window is asked for."""
    return link.starts >= 2 and link.virtual.machine.state is not State.MOVING


def _between(link: InterruptedLink, address: int, words: list[int]) -> bool:
    """The first motion with the new gains is over, the second has not begun."""
    at_rest = link.virtual.machine.state is State.IDLE
    return link.starts == 3 and at_rest and link.virtual.machine.banks.unconfirmed


PHASES: dict[str, Callable[[InterruptedLink, int, list[int]], bool]] = {
    "identification lead-in": _moving(1, captured=False),
    "identification capture": _moving(1, captured=True),
    "draining": lambda link, address, words: link.virtual.machine.state is State.DRAINING,
    "asking for the window": lambda link, address, words: (
        link.starts == 1 and link.virtual.machine.banks.unconfirmed
    ),
    "second capture": _moving(2, captured=True),
    "stage": lambda link, address, words: _both_moved(link) and address == _SHADOW and bool(words),
    "before commit": _commands(Opcode.COMMIT_RUNNING),
    "after commit": lambda link, address, words: (
        _both_moved(link) and link.virtual.machine.banks.unconfirmed
    ),
    "verification lead-in": _moving(3, captured=False),
    "verification capture": _moving(3, captured=True),
    "between the verifications": _between,
    "second verification capture": _moving(4, captured=True),
    "before confirm": _commands(Opcode.CONFIRM),
}

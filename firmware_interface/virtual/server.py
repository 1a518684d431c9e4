"""Puts a virtual board behind a pseudo-terminal or a TCP port."""

import asyncio
import difflib
import logging
import math
import os
import re
import select
import signal
import time
import tty
from collections.abc import Callable, Coroutine, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final, Self, cast

from firmware_interface import errors, modbus_server
from firmware_interface.link import Link
from firmware_interface.plant.feed_drive import feed_drive
from firmware_interface.plant.plant import Plant
from firmware_interface.registers import AXES, State
from firmware_interface.virtual import drive, register_file
from firmware_interface.virtual.board import Clock, RequestClock, VirtualBoard, WallClock
from firmware_interface.virtual.machine import Machine
from firmware_interface.virtual.settings import BoardSettings

# What fails on a virtual board, its machine and its line, each at its time.
#
# `encoder_lost=x@3s` is a failure as a person writes it: what fails, on which axis, and when. Times
# are the board's own: from its start, or from the start of a motion.

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
        identifier: register_file.Identifier | None = None,
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
            and self._samples >= self._starts[failure.motion] + seconds / drive.SAMPLE_PERIOD_S
        ]
        for failure in due:
            failures.remove(failure)
        return due

    def _tell(self, failure: Failure, happens: str) -> None:
        time_s = self._samples * drive.SAMPLE_PERIOD_S
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
            raise errors.NoReplyError("the virtual board's cable has failed", "look at the cable")


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


LOOPBACK: Final = "127.0.0.1"
"""Reached from this host alone."""
CONNECTION_LIMIT: Final = 64
"""TCP clients at one time. Each costs a few kilobytes; that many leave a new one the time to ask,
and to ask again, before as many others have come."""
IDLE_TIMEOUT_S: Final = 120.0
"""Time after which a TCP client that asks nothing is hung up on."""
_IDLE_S: Final = 0.005
_LOG: Final = logging.getLogger(__name__)


def serve(
    *,
    on_ready: Callable[[str], None],
    pty: bool = False,
    tcp_port: int | None = None,
    bind: str = LOOPBACK,
    speed: float | None = 1.0,
    settings: BoardSettings | None = None,
    plant: Plant | None = None,
    identifier: register_file.Identifier | None = None,
    failures: Sequence[Failure] = (),
    on_failure: Callable[[str], object] = _LOG.warning,
) -> None:
    """Serve a new board until Ctrl-C or SIGTERM; SIGUSR1 pulls its wired stop, SIGUSR2 releases it.

    Parameters
    ----------
    on_ready : callable
        Gets the device URL once a client can connect.
    pty : bool
        Serve Modbus RTU on a new pseudo-terminal; this or `tcp_port`.
    tcp_port : int, optional
        Serve Modbus TCP on this port; 0 takes a free one.
    bind : str
        Address of this host that a TCP port is bound to. Modbus has no authentication: whoever
        reaches the port commands the board.
    speed : float or None
        Board time per wall time; None lets every request advance it, as fast as it can.
    settings : BoardSettings, optional
    plant : Plant, optional
        The drive behind the board; by default a sound one.
    identifier : Identifier, optional
        The board's own network, loaded; by default it has none.
    failures : sequence of Failure
        What fails, each at its time.
    on_failure : callable
        Gets a line when one begins or ends.

    Raises
    ------
    LinkError
        The port is in use.
    """
    if pty == (tcp_port is not None):
        raise ValueError("choose one of pty and tcp_port")
    clock = RequestClock() if speed is None else WallClock(speed)
    board = FailingBoard(failures, settings, clock, plant, identifier, on_failure)
    if tcp_port is None:
        serving = serve_pty(board, board.idle, on_ready)
    else:
        serving = serve_tcp(board, tcp_port, board.idle, on_ready, bind)
    # the loop would take the two in any order, and so release before it pulls
    signal.signal(signal.SIGUSR1, lambda *_: board.inputs.press_stop())
    signal.signal(signal.SIGUSR2, lambda *_: board.inputs.release_stop())
    with suppress(KeyboardInterrupt, asyncio.CancelledError):
        asyncio.run(_until_terminated(serving))


async def _until_terminated(serving: Coroutine[None, None, None]) -> None:
    loop, task = asyncio.get_running_loop(), asyncio.ensure_future(serving)
    loop.add_signal_handler(signal.SIGTERM, task.cancel)
    await task


async def serve_tcp(
    link: Link,
    port: int,
    idle: Callable[[], None],
    on_ready: Callable[[str], None],
    bind: str = LOOPBACK,
) -> None:
    """Serve a link's registers as Modbus TCP until cancelled.

    Parameters
    ----------
    link : Link
    port : int
        0 takes a free one.
    idle : callable
        Called every few milliseconds.
    on_ready : callable
        Gets the device URL.
    bind : str
        Address of this host.

    Raises
    ------
    LinkError
        The address or port is in use, not allowed or not this host's.
    """
    loop = asyncio.get_running_loop()
    loop.set_exception_handler(_AcceptErrors())
    sessions: set[modbus_server.TcpSession] = set()

    def look_after() -> None:
        idle()
        quiet_since_s = time.monotonic() - IDLE_TIMEOUT_S
        for session in [session for session in sessions if session.heard_s < quiet_since_s]:
            session.hang_up()

    try:
        server = await loop.create_server(
            lambda: modbus_server.TcpSession(link, sessions, CONNECTION_LIMIT), bind, port
        )
    except OSError as error:
        raise errors.LinkError(
            f"port {port} on {bind} cannot be served: {error.strerror}",
            "choose another port or address, or stop the program that uses it",
        ) from error
    try:
        on_ready(f"tcp://{bind}:{server.sockets[0].getsockname()[1]}")
        await _forever(look_after)
    finally:
        server.close()
        for session in list(sessions):
            session.hang_up()


class _AcceptErrors:
    """Says once that connections cannot be accepted: the loop says so every second."""

    def __init__(self) -> None:
        self._said = False

    def __call__(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        if not isinstance(context.get("exception"), OSError) or "accept" not in context["message"]:
            loop.default_exception_handler(context)
        elif not self._said:
            self._said = True
            _LOG.warning("no further connection can be accepted: %s", context["exception"])


async def serve_pty(link: Link, idle: Callable[[], None], on_ready: Callable[[str], None]) -> None:
    """Serve a link's registers as Modbus RTU on a new pseudo-terminal until cancelled.

    Parameters are those of `serve_tcp`.
    """
    loop = asyncio.get_running_loop()
    # the board's own hold on the client's side keeps the line up between clients
    master, slave = os.openpty()
    try:
        tty.setraw(slave)
        os.set_blocking(master, False)
        session = modbus_server.RtuSession(link, lambda frame: _write_pty(master, slave, frame))
        loop.add_reader(master, lambda: session.data_received(_read_pty(master)))
        on_ready(os.ttyname(slave))

        def look_after() -> None:
            session.idle()
            idle()

        await _forever(look_after)
    finally:
        loop.remove_reader(master)
        os.close(master)
        os.close(slave)


def _read_pty(master: int) -> bytes:
    with suppress(BlockingIOError):
        return os.read(master, 4096)
    return b""


def _write_pty(master: int, slave: int, frame: bytes) -> None:
    while _read_pty(master):  # what came before the answer left
        pass
    with suppress(BlockingIOError):  # nobody reads: the bytes are lost, as on a real line
        os.write(master, frame)
    # a thread of the kernel moves them, which a busy computer lets wait for seconds, and the host
    # with it: so does the board, to look at the other end waits for that thread
    select.select([slave], [], [], 0.0)


async def _forever(look_after: Callable[[], None]) -> None:
    while True:
        look_after()
        await asyncio.sleep(_IDLE_S)

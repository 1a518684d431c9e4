"""The board's verbs, on top of a link: motion and effort.

Those for gains are in `firmware_interface.board_gains`. How a command travels, and who may give
one, is in `firmware_interface.board_session`.
"""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Final, Self

from firmware_interface.board_checks import check_map
from firmware_interface.board_gains import GainVerbs
from firmware_interface.board_identification import BoardIdentification, wait_for_identification
from firmware_interface.board_session import BEATS_PER_TIMEOUT, Session
from firmware_interface.board_types import (
    MAP_CRCS,
    AxisLimits,
    BoardIdentity,
    BoardStatus,
    CapturePage,
    read_identity,
    read_limits,
    twice,
)
from firmware_interface.capture_pages import CapturePace, fetch_pages, page_s, read_page
from firmware_interface.codec import (
    crc32,
    decode,
    decode_array,
    encode,
    encode_trajectory,
    trajectory_words,
)
from firmware_interface.errors import BoardError, EdgeIdentError, OvertakenError, SilentError
from firmware_interface.link import Heartbeat, Link
from firmware_interface.motion import Trajectory, stop_duration_s
from firmware_interface.registers import AXES, REGISTERS, Opcode, State

__all__ = ["AxisLimits", "Board", "BoardIdentity", "BoardStatus", "CapturePage"]


class Board(GainVerbs):
    """A connected board; made by `Board.connect`.

    Attributes
    ----------
    axes : tuple of str
        Names, in the order of the capture's columns.
    identity : BoardIdentity
    coming_to_rest : bool
        A motion was left to end by itself.
    """

    axes: Final = AXES

    def __init__(self, link: Link, identity: BoardIdentity) -> None:
        super().__init__(Session(link, identity.sample_period_s), identity)
        self._link = link
        self._limits: Mapping[str, AxisLimits] = {}
        self._motion_samples = 0
        self._trajectory_crc = 0
        self._motion_token: int | None = None
        self._heartbeat: Heartbeat | None = None
        self.coming_to_rest = False

    @classmethod
    def connect(cls, link: Link) -> Self:
        """Check that the board speaks a register map that this host knows; nothing is written.

        Raises
        ------
        LinkError
            No reply.
        BoardError
            No such board, another word order, another map, or stuck in its self-test.
        """
        check_map(link)
        board = cls(link, read_identity(twice(link.read)))
        board._session.wait_for(set(State) - {State.INIT}, "end its self-test")
        return board

    def close(self) -> None:
        """Let go of the board and of the link."""
        with suppress(EdgeIdentError):  # a hold that stays runs out by itself
            self.release()
        self._link.close()

    def status(self) -> BoardStatus:
        """State, fault, last command and counters, all of one moment; see `Session.status`."""
        return self._session.status()

    def limits(self) -> Mapping[str, AxisLimits]:
        """What the board enforces, by axis; like its identity, read once."""
        if not self._limits:
            read, version = twice(self._session.read), self.identity.map_version
            self._limits = {axis: read_limits(read, axis, version) for axis in self.axes}
        return self._limits

    def register_values(self, name: str) -> tuple[float, ...]:
        """Values of a register as they stand there, valid or not."""
        register = REGISTERS[name]
        return decode_array(name, self._session.read(register.address, register.words))

    def write_register(self, name: str, *values: float) -> None:
        """Write one register, read back and compared; see `codec.encode` for ValueError."""
        self._session.write_verified([(REGISTERS[name].address, encode(name, *values))])

    # ---- who commands

    def claim(self) -> None:
        """Hold the board, so that no other host commands it; see `Session.claim`.

        Commands do this by themselves. The hold runs out seconds after the last command or
        heartbeat, but not while the machine moves.
        """
        self._session.claim()

    def release(self) -> None:
        """Let go of the board; it must not be moving. A host that was stopped may then go on."""
        self._session.release()

    def held_by_another(self) -> bool:
        """Whether another host holds the board now."""
        return self._session.held_by_another()

    @property
    def holds(self) -> bool:
        """Whether this host holds the board, as far as it knows without asking."""
        return self._session.holds

    def heartbeat(self) -> None:
        """Renew the hold and feed the watchdog."""
        self._session.beat()

    @contextmanager
    def beating(self) -> Iterator[None]:
        """Give signs of life from a thread of their own, however long the body computes.

        Only while this host holds the board; none where time waits for the host. Where the board
        hears none all the same, the error says what this host has measured.
        """
        if self._session.line is None or self._heartbeat is not None:
            yield
            return
        self._session.beat_every(self._patience_s())
        beats = Heartbeat(
            self._session.line, self._session.give_sign, lambda: self._session.beat_every_s
        )
        self._heartbeat = beats
        beats.start()
        try:
            yield
        except SilentError as error:
            error.measured(*beats.silence)
            raise
        finally:
            self._heartbeat = None
            beats.end()

    # ---- effort

    def enable(self) -> None:
        """Release the brake and let the control law act, where the axes stand."""
        self._session.command(Opcode.ENABLE)

    def disable(self) -> None:
        """Apply the brake and switch the effort off, at rest only."""
        self._session.command(Opcode.DISABLE)

    # ---- motion

    def write_trajectory(self, trajectory: Trajectory) -> None:
        """Hand over a trajectory, read back and compared.

        Raises
        ------
        BoardError
            The board cannot represent it, or another host controls the board.
        LinkError
            What was read back differs.
        """
        try:
            writes = encode_trajectory(trajectory, self.identity.sample_period_s)
        except ValueError as error:
            raise BoardError(
                f"the board cannot follow this motion: {error}", "choose another motion"
            ) from error
        self._session.hold()
        self._session.write_verified(writes)
        self._trajectory_crc = crc32(trajectory_words(writes))
        motion_s = trajectory.lead_in_s + trajectory.duration_s
        self._motion_samples = math.ceil(motion_s / self.identity.sample_period_s) + 1

    def arm(self) -> None:
        """Have the board check the trajectory that was written, from where the axes stand."""
        self._session.command(Opcode.ARM, self._trajectory_crc)

    def start(self) -> None:
        """Start the armed motion."""
        self._session.pages_in_hand = 0
        self._session.beat_every(self._patience_s())
        if self._heartbeat is not None:
            self._heartbeat.measure_anew()
        started = self._session.command(Opcode.START, MAP_CRCS[self.identity.map_version])
        self._motion_token = started.last_token

    def capture_pages(self) -> Iterator[CapturePage]:
        """Fetch the capture of the motion just started, while it runs, to its last sample.

        Raises
        ------
        BoardError
            The board is in fault, the motion was stopped or does not end.
        LinkError
            A page was lost or cannot be read.
        """
        return fetch_pages(self._session, self.identity, self._motion_samples)

    def capture_pace(self, samples: int) -> CapturePace:
        """How fast so many samples are filled, and would be fetched with signs of life in between.

        Some pages are read to find out.
        """
        fetched_s = page_s(self._session)
        if fetched_s:
            fetched_s *= 1.0 + min(fetched_s * BEATS_PER_TIMEOUT / self._patience_s(), 1.0)
        return CapturePace.of(samples, self.identity.sample_period_s, fetched_s)

    def read_last_page(self) -> CapturePage:
        """The newest page of the last capture, once more; it stays until the next start.

        Raises
        ------
        BoardError
            Nothing was captured since power-up.
        """
        pages = self.status().pages_written
        if not pages:
            raise BoardError("the board holds no capture", "run a motion first")
        return read_page(self._session, self.identity, pages - 1)

    def finish(self) -> None:
        """Wait until the machine is at rest and has every page acknowledged, then leave the motion.

        The last acknowledgement may have been lost: each heartbeat repeats it.
        """
        self.coming_to_rest = False
        at_its_end = {State.DONE, State.FAULT, State.IDLE}
        self._session.wait_for(at_its_end, "come to rest after the motion")
        self._session.command(Opcode.FINISH)

    def leave_to_rest(self) -> None:
        """Let the axes come to rest by themselves; `finish` where the board needs this host for it.

        It does unless it takes gains meanwhile, and its watchdog is patient enough for any stop.
        """
        stop_s = max(stop_duration_s(limits.speed_rad_s) for limits in self.limits().values())
        if self._patience_s() > stop_s and self.takes_gains_running():
            self._session.beat()
            self.coming_to_rest = True
        else:
            self.finish()

    def settle(self) -> None:
        """Finish a motion that was left to end by itself; nothing where none was."""
        if self.coming_to_rest:
            self.finish()

    def quick_stop(self) -> None:
        """Decelerate to rest and wait for it. No safety function; needs no hold."""
        self.coming_to_rest = False
        for again in (True, True, False):  # it may be said as often as it takes
            try:
                self._session.command(Opcode.QUICK_STOP)
                break
            except OvertakenError:
                if not again:
                    raise
        self._session.wait_for({State.IDLE, State.FAULT}, "stop")

    def clear_fault(self) -> None:
        """Leave a latched fault, once its cause is gone and the machine at rest; effort is off."""
        self._session.command(Opcode.CLEAR_FAULT)

    def identification(self, longest_s: float) -> BoardIdentification | None:
        """What the board identified by itself from the motion that this host started last.

        None where it has no network; waits so many seconds at most, see `wait_for_identification`.
        """
        read, version = self._session.read, self.identity.map_version
        return wait_for_identification(read, version, self._motion_token, longest_s)

    def _patience_s(self) -> float:
        """Of the board's watchdog."""
        register = REGISTERS["watchdog.timeout"]
        return decode(register.name, self._session.read(register.address, register.words))

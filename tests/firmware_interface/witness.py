"""What really happened on a virtual board, seen from inside, and what must hold of it."""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace

import numpy as np
from board_bench import NEW, OLD
from fault_line import Sender

from firmware_interface.board import CapturePage
from firmware_interface.codec import bytes_to_words, decode_integer
from firmware_interface.registers import REGISTERS, Opcode
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.controller import Setpoint
from firmware_interface.virtual.drive import RAD_PER_COUNT, DriveSample
from firmware_interface.virtual.settings import DEFAULT_LIMITS, BoardSettings

_COMMAND = REGISTERS["command.opcode"].address
_STANDSTILL_RAD_S = 1e-3
_LARGEST_EFFORT_NM = DEFAULT_LIMITS.effort_nm + 1e-9
SETS = (OLD, NEW)
LIMITS = {"x": DEFAULT_LIMITS, "z": replace(DEFAULT_LIMITS, travel_rad=9.0)}
SETTINGS = BoardSettings(gains=OLD, limits=LIMITS)
"""Of a board that is watched."""


class EffortWatch:
    """Looks at every sample of a board: what it sets, commands and has enabled.

    Parameters
    ----------
    virtual : VirtualBoard
    """

    def __init__(self, virtual: VirtualBoard) -> None:
        machine = virtual.machine
        self._drive, self._setpoints = machine.drive, machine._setpoints
        self.wrong: list[str] = []
        sample = self._drive.sample

        def watched(setpoints: Sequence[Setpoint]) -> DriveSample:
            enabled, measured = self._drive.powered, sample(setpoints)
            self._look(enabled, setpoints, measured)
            return measured

        self._drive.sample = watched  # type: ignore[method-assign]

    def check(self) -> None:
        """Nothing was wrong so far."""
        assert not self.wrong, self.wrong[:3]

    def _look(self, enabled: bool, setpoints: Sequence[Setpoint], measured: DriveSample) -> None:
        if not all(setpoint.finite for setpoint in setpoints):
            self.wrong.append(f"setpoint {setpoints}")
        effort_nm = self._drive.plant.torque_nm
        if not all(abs(effort) <= _LARGEST_EFFORT_NM for effort in effort_nm):
            self.wrong.append(f"effort {effort_nm}")
        if not enabled and (any(effort_nm) or any(measured.effort)):
            self.wrong.append(f"effort {effort_nm} while not enabled")
        if not enabled and self._setpoints.moving:
            self.wrong.append("a motion while not enabled")
        if not np.isfinite(self._drive.plant.output_rad_s).all():
            self.wrong.append("a plant beyond numbers")


class Witness:
    """Counts motions and keeps the samples of the last one.

    Parameters
    ----------
    virtual : VirtualBoard
    lock : context manager
        Held while looking at a board that another thread serves.

    Attributes
    ----------
    motions : int
        Begun since power was first on.
    samples : list of DriveSample
        Captured in the last one.
    power_ups : int
    starts : set of (int, int)
        Power-up and token of the START requests that were sent: a board that was off has
        forgotten its tokens.
    written_twice : bool
        The host has written a command again, token and all.
    effort : EffortWatch
        Of the board that is on now.
    """

    def __init__(
        self, virtual: VirtualBoard, lock: AbstractContextManager[object] | None = None
    ) -> None:
        self.virtual = virtual
        self._lock = lock or nullcontext()
        self.motions = 0
        self.samples: list[DriveSample] = []
        self.power_ups = 1
        self.starts: set[tuple[int, int]] = set()
        self.written_twice = False
        self._last_command = b""
        self._watch()

    def power_cycle(self) -> None:
        """Cut the board's power and bring it back."""
        with self._lock:
            self.virtual.power_cycle()
            self.power_ups += 1
            self._watch()

    def see(self, sender: Sender, frame: bytes) -> None:
        """Look at a frame on the line."""
        body = frame[7:-2]
        if sender is Sender.HOST and frame[1:4] == bytes([16, 0, _COMMAND]) and len(body) == 12:
            self.written_twice |= frame == self._last_command
            self._last_command = frame
            words = bytes_to_words(body)
            if decode_integer("command.opcode", words, _COMMAND) == Opcode.START:
                token = decode_integer("command.token", words, _COMMAND)
                self.starts.add((self.power_ups, token))

    def _watch(self) -> None:
        machine = self.virtual.machine
        follow, add = machine._setpoints.follow, machine.capture.add

        def counted(trajectory: object) -> None:
            self.motions += 1
            self.samples = []
            follow(trajectory)  # type: ignore[arg-type]

        def kept(sample: DriveSample) -> None:
            self.samples.append(sample)
            add(sample)

        self.effort = EffortWatch(self.virtual)
        machine._setpoints.follow = counted  # type: ignore[method-assign]
        machine.capture.add = kept  # type: ignore[method-assign]

    # ---- what must hold

    def one_motion_per_token(self) -> None:
        """No START frame moves the machine twice, and nothing else does; none is written again."""
        assert not self.written_twice
        assert self.motions <= len(self.starts)

    def effort_is_asked_for(self) -> None:
        """None while the board is not enabled, and never a number that is none."""
        self.effort.check()

    def gains_are_whole(self) -> None:
        """In force is one whole set of gains, the same for registers and controllers."""
        with self._lock:
            machine = self.virtual.machine
            active, stored = machine.banks.active, machine.banks.stored
            in_force = [controller.gains for controller in machine.drive._controllers]
        assert active in SETS
        assert stored in SETS
        assert in_force == list(active.values())

    def nothing_is_missing(self, pages: list[CapturePage]) -> None:
        """What the host has in hand is every sample that the board took, in order."""
        in_hand = np.vstack([page.position_rad for page in pages])
        taken = np.array([sample.position for sample in self.samples])
        np.testing.assert_array_equal(np.rint(in_hand / RAD_PER_COUNT), taken)

    def stands_still(self) -> None:
        """No axis moves, and none is about to."""
        with self._lock:
            machine = self.virtual.machine
            moving, speed_rad_s = machine.moving, machine.drive.plant.output_rad_s
        assert not moving
        assert np.all(np.abs(speed_rad_s) < _STANDSTILL_RAD_S)

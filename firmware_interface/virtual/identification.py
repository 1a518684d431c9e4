"""The virtual board's own identification: it keeps the capture, and computes when it is asked.

How it computes comes from outside, as a microcontroller gets its network: this package knows
nothing of identification.
"""

import math
from array import array
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from firmware_interface.board_identification import (
    SINCE,
    BoardAxis,
    BoardIdentification,
    CapturedCounts,
    identification_words,
)
from firmware_interface.board_types import BoardIdentity, read_identity
from firmware_interface.registers import AXES, IdentificationReason, IdentificationState
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S, DriveSample
from firmware_interface.virtual.register_file import RegisterFile


class Identifier(Protocol):
    """Identifies a captured motion with a network."""

    @property
    def network(self) -> int:
        """Code of the network, see `firmware_interface.board_identification.network_code`."""

    @property
    def longest_s(self) -> float:
        """How much of a motion it looks at."""

    def identify(self, captured: CapturedCounts, board: BoardIdentity) -> Mapping[str, BoardAxis]:
        """What the network says of each axis."""


@dataclass
class OwnIdentification:
    """What becomes of a motion.

    The board computes when a host reads the registers, and answers that host when it is done: so
    the same requests always get the same answers.

    Parameters
    ----------
    registers : RegisterFile
    map_version : int
    identifier : Identifier or None
        Without one the board has no network.
    """

    registers: RegisterFile
    map_version: int
    identifier: Identifier | None

    def __post_init__(self) -> None:
        self._state = IdentificationState.NONE
        self._motion = 0
        self._axes: Mapping[str, BoardAxis] = {}
        self._forget()
        longest_s = self.identifier.longest_s if self.identifier else 0.0
        self._most_samples = math.ceil(longest_s / SAMPLE_PERIOD_S)
        self._put()

    def begin(self, token: int) -> None:
        """A motion begins: what was found of another is gone."""
        self._motion, self._axes = token, {}
        self._forget()
        self._state = IdentificationState.CAPTURING
        self._put()

    def add(self, sample: DriveSample) -> None:
        """Take a captured sample."""
        if len(self._position) < self._most_samples * len(AXES):
            self._position.extend(sample.position)
            self._effort.extend(sample.effort)

    def captured(self) -> None:
        """The last sample was captured."""
        self._state = IdentificationState.RUNNING
        self._put()

    def stopped(self) -> None:
        """The motion is over; it may not have got to the end of its capture."""
        if self._state is IdentificationState.CAPTURING:
            reason = BoardAxis(IdentificationReason.STOPPED)
            self._end(dict.fromkeys(AXES, reason))

    def asked(self) -> None:
        """A host is about to read: compute, if there is something to compute."""
        if self._state is IdentificationState.RUNNING and self.identifier is not None:
            by_sample = (
                np.array(of).reshape(-1, len(AXES)) for of in (self._position, self._effort)
            )
            counts = CapturedCounts(*by_sample)
            board = read_identity(self.registers.words)
            self._end(self.identifier.identify(counts, board))

    def _end(self, axes: Mapping[str, BoardAxis]) -> None:
        identified = [axis.reason is IdentificationReason.NONE for axis in axes.values()]
        self._axes = axes
        self._forget()
        self._state = IdentificationState.DONE if any(identified) else IdentificationState.FAILED
        self._put()

    def _forget(self) -> None:
        """Nothing is captured: counts (samples, axes), row after row, as a board keeps them."""
        self._position, self._effort = array("q"), array("q")

    def _put(self) -> None:
        """Put it where the host reads it."""
        if self.identifier is None or self.map_version < SINCE:
            return
        found = BoardIdentification(self._state, self._motion, self.identifier.network, self._axes)
        address = self.registers.address("identification.state")
        self.registers.put_words(address, identification_words(found))

"""What a board with a network identified by itself: its registers, in SI units, and back."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from firmware_interface.codec import crc32, decode_integer, encode
from firmware_interface.errors import LinkError
from firmware_interface.received import received, received_integer
from firmware_interface.registers import AXES, REGISTERS, IdentificationReason, IdentificationState

ReadWords = Callable[[int, int], list[int]]

SINCE: Final = REGISTERS["identification.state"].since
"""Version of the map that brought these registers."""
PARAMETERS: Final = ("inertia", "viscous_friction", "coulomb_friction", "offset")
_VALUES: Final = (*PARAMETERS, "relative_residual")
_BASE: Final = REGISTERS["identification.state"].address
_CRC: Final = REGISTERS["identification.crc"]
_WORDS: Final = _CRC.address - _BASE
_TRIES: Final = 3
_POLL_S: Final = 0.02
_UNDER_WAY: Final = (IdentificationState.CAPTURING, IdentificationState.RUNNING)


@dataclass(frozen=True)
class BoardAxis:
    """What the board says of an axis.

    Attributes
    ----------
    reason : IdentificationReason
        Why it is not identified, else NONE.
    images : int
        That the network was shown.
    parameters : tuple of float
        Inertia, viscous friction, Coulomb friction and offset; kg·m², N·m·s/rad, N·m, N·m.
    relative_residual : float
        What they leave of the effort, as a share of it.
    """

    reason: IdentificationReason = IdentificationReason.NONE
    images: int = 0
    parameters: tuple[float, ...] = (0.0,) * len(PARAMETERS)
    relative_residual: float = 0.0


@dataclass(frozen=True)
class BoardIdentification:
    """What the board identified by itself.

    Attributes
    ----------
    state : IdentificationState
    motion : int
        Token of the START whose motion it is of.
    network : int
        First four bytes of the SHA-256 of the network's file.
    axes : mapping of axis name to BoardAxis
    """

    state: IdentificationState
    motion: int
    network: int
    axes: Mapping[str, BoardAxis]


@dataclass(frozen=True)
class CapturedCounts:
    """What a board captured of a motion.

    Attributes
    ----------
    position, effort : (N, axes) arrays of int
        In encoder counts and PWM counts.
    """

    position: NDArray[np.int64]
    effort: NDArray[np.int64]


def network_code(sha256: str) -> int:
    """The register's value for a network, from the hexadecimal digest of its file."""
    return int(sha256[:8], 16)


def read_identification(read: ReadWords, version: int) -> BoardIdentification | None:
    """What the board says, or None where it has no network.

    Raises
    ------
    LinkError
        What was read is of no single moment, however often.
    BoardError
        A value that cannot be.
    """
    if version < SINCE:
        return None
    for _ in range(_TRIES):
        words = read(_BASE, _WORDS + _CRC.words)
        if decode_integer("identification.network", words, _BASE) == 0:
            return None
        if decode_integer(_CRC.name, words, _BASE) == crc32(words[:_WORDS]):
            return decoded_identification(words)
    raise LinkError(
        "what the board identified does not match its CRC",
        "read it again; if that persists, install the same release on board and host",
    )


def wait_for_identification(
    read: ReadWords, version: int, motion: int | None, longest_s: float
) -> BoardIdentification | None:
    """Read until the board has identified the motion, or the time is over.

    Parameters
    ----------
    read : callable
    version : int
        Of the board's register map.
    motion : int or None
        Token of its START; None where nothing was started.
    longest_s : float

    Returns
    -------
    BoardIdentification or None
        As it is then; None where the board has no network, or speaks of another motion.

    Raises
    ------
    LinkError, BoardError
        As `read_identification`.
    """
    deadline = time.monotonic() + longest_s
    while (found := read_identification(read, version)) is not None and found.motion == motion:
        if found.state not in _UNDER_WAY or time.monotonic() > deadline:
            return found
        time.sleep(_POLL_S)
    return None


def identification_words(found: BoardIdentification) -> list[int]:
    """The words of all registers of the group, CRC included, from `identification.state` on."""
    words = encode("identification.state", found.state)
    words += encode("identification.motion", found.motion)
    words += encode("identification.network", found.network)
    for axis in AXES:
        at, group = found.axes.get(axis, BoardAxis()), f"identification.{axis}"
        words += encode(f"{group}.reason", at.reason) + encode(f"{group}.images", at.images)
        for name, value in zip(_VALUES, (*at.parameters, at.relative_residual), strict=True):
            words += encode(f"{group}.{name}", value)
    return words + encode(_CRC.name, crc32(words))


def decoded_identification(words: list[int]) -> BoardIdentification:
    """The reverse of `identification_words`; the CRC is not looked at.

    Raises
    ------
    BoardError
        A value that cannot be.
    """

    def integer(name: str) -> int:
        return received_integer(f"identification.{name}", words, _BASE)

    return BoardIdentification(
        state=IdentificationState(integer("state")),
        motion=integer("motion"),
        network=integer("network"),
        axes={
            axis: BoardAxis(
                reason=IdentificationReason(integer(f"{axis}.reason")),
                images=integer(f"{axis}.images"),
                parameters=tuple(
                    received(f"identification.{axis}.{name}", words, _BASE) for name in PARAMETERS
                ),
                relative_residual=received(
                    f"identification.{axis}.relative_residual", words, _BASE
                ),
            )
            for axis in AXES
        },
    )

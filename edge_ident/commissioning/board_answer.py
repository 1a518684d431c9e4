"""The board's own identification beside that of this host: what both say, and whether they agree.

The board has its own capture, a network in int8, and nothing else. This host has least squares, the
diagnosis, and the same network: what it finds with that tells a firmware that computes wrongly from
a method that finds something else.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np

from edge_ident.errors import EdgeIdentError
from edge_ident.estimation.network import Network, load_network
from edge_ident.estimation.network_estimate import BoardNetwork, NetworkEstimate
from edge_ident.estimation.trust import AGREEMENT
from edge_ident.identification.result import AxisIdentification, Identification
from edge_ident.model.model import PARAMETERS, Array
from edge_ident.signals.recording import Recording
from firmware_interface import registers
from firmware_interface.board import Board
from firmware_interface.board_identification import (
    BoardAxis,
    BoardIdentification,
    CapturedCounts,
    network_code,
)
from firmware_interface.board_types import BoardIdentity

log = logging.getLogger(__name__)


LONGEST_WAIT_S: Final = 4.0
"""Longest wait for the board's answer, less than the hold on the board lasts: from the end of the
capture, a Cortex-M7 of 480 MHz takes 1.1 s for the most images, a Cortex-M4 of 168 MHz 4 s."""
SAME_COMPUTATION: Final = 1.0
"""Standard deviations of the network within which board and host compute the same. Rounding alone
moves an int8 network by tenths of one; an error of the firmware moves it by many."""


class Verdict(StrEnum):
    """What the comparison says of the board's answer for an axis."""

    AGREES = "agrees"
    DIFFERS = "differs"
    COMPUTES_OTHERWISE = "computes_otherwise"
    UNKNOWN_NETWORK = "unknown_network"
    NOT_IDENTIFIED = "not_identified"


@dataclass(frozen=True)
class AxisAnswer:
    """The board's answer for an axis.

    Attributes
    ----------
    board : BoardAxis
    std : (4,) array or None
        Of the board's parameters; None where this host does not have its network.
    recomputed : (4,) array or None
        What the same network finds on this host; None where it finds nothing.
    difference : (4,) array
        Board minus host.
    deviations : float
        Largest difference, in combined standard deviations.
    verdict : Verdict
    sentence : str
    """

    board: BoardAxis
    std: Array | None
    recomputed: Array | None
    difference: Array
    deviations: float
    verdict: Verdict
    sentence: str


@dataclass(frozen=True)
class BoardAnswer:
    """The board's answer.

    Attributes
    ----------
    state : IdentificationState
    network : int
        First four bytes of the SHA-256 of its network's file.
    axes : mapping of axis name to AxisAnswer
        Empty where the board was not ready.
    """

    state: registers.IdentificationState
    network: int
    axes: Mapping[str, AxisAnswer]

    @property
    def sentences(self) -> list[str]:
        """One for each axis, or why there are none."""
        if not self.axes:
            return [f"the board's own network had no answer after {LONGEST_WAIT_S:g} s"]
        return [f"axis {name}: {answer.sentence}" for name, answer in self.axes.items()]


def board_answer(
    board: Board, recording: Recording, found: Identification, network: Network | None
) -> BoardAnswer | None:
    """Ask the board what it identified from the motion that was captured last, and compare.

    Parameters
    ----------
    board : Board
    recording : Recording
        Of that motion.
    found : Identification
        This host's, of the same motion.
    network : Network or None
        This host's, which may be the board's.

    Returns
    -------
    BoardAnswer or None
        None where the board has no network, or cannot be asked.
    """
    try:
        said = board.identification(LONGEST_WAIT_S)
    except EdgeIdentError as error:
        log.warning("the board's own identification cannot be read: %s", error.cause)
        return None
    if said is None:
        return None
    if said.state not in (registers.IdentificationState.DONE, registers.IdentificationState.FAILED):
        return BoardAnswer(said.state, said.network, {})
    estimates = _recomputed(said, recording, board.identity, network)
    axes = {
        name: _compared(
            axis, found.axes[name], (estimates or {}).get(name), known=estimates is not None
        )
        for name, axis in said.axes.items()
    }
    return BoardAnswer(said.state, said.network, axes)


def counts_of(recording: Recording, board: BoardIdentity, axes: tuple[str, ...]) -> CapturedCounts:
    """A board's capture, in its counts."""
    units = {"position": board.encoder_resolution_rad, "effort": board.effort_per_count_nm}
    columns = {
        quantity: np.stack(
            # a capture is whole counts times the unit: rounding gives back what the board had
            [np.rint(getattr(recording.axes[axis], quantity) / unit) for axis in axes],
            axis=1,
        ).astype(np.int64)
        for quantity, unit in units.items()
    }
    return CapturedCounts(**columns)


def _recomputed(
    said: BoardIdentification, recording: Recording, board: BoardIdentity, network: Network | None
) -> dict[str, NetworkEstimate | None] | None:
    """What the board's network finds on this host, if it is here."""
    # the board computes with int8: only that variant can give the same numbers here
    known = network
    if known is None or known.variant != "int8" or network_code(known.sha256) != said.network:
        known = load_network("int8")
    if network_code(known.sha256) != said.network:
        return None
    captured = counts_of(recording, board, tuple(said.axes))
    estimates = BoardNetwork(known).estimates(captured, board)
    return {name: estimate for name, (_, estimate) in estimates.items()}


def _compared(
    said: BoardAxis, own: AxisIdentification, again: NetworkEstimate | None, *, known: bool
) -> AxisAnswer:
    """What the board says of an axis, beside what this host says."""
    found = np.array(said.parameters)
    recomputed, std = (None, None) if again is None else (again.parameters, again.std)
    difference = found - own.estimate.parameters
    # both err, and independently: deviations add in squares
    scale = np.hypot(own.estimate.std, 0.0 if std is None else std)
    verdict, sentence = Verdict.AGREES, ""
    if said.reason is not registers.IdentificationReason.NONE:
        verdict, sentence = Verdict.NOT_IDENTIFIED, _why_not(said.reason)
    elif not known:
        verdict = Verdict.UNKNOWN_NETWORK
    elif again is None or np.max(np.abs(found - again.parameters) / again.std) > SAME_COMPUTATION:
        verdict = Verdict.COMPUTES_OTHERWISE
    elif np.max(np.abs(difference) / scale) > AGREEMENT:
        verdict = Verdict.DIFFERS
    answer = AxisAnswer(
        said, std, recomputed, difference, float(np.max(np.abs(difference) / scale)), verdict, ""
    )
    return replace(answer, sentence=sentence or _sentence(answer, own))


def _why_not(reason: registers.IdentificationReason) -> str:
    meaning, next_step = registers.IDENTIFICATIONREASON_TEXTS[reason]
    return f"the board's own network has no answer: {meaning}; next: {next_step}"


def _sentence(answer: AxisAnswer, own: AxisIdentification) -> str:
    values = ", ".join(
        f"{name.replace('_', ' ')} {value:.4g} {unit}"
        for name, value, unit in zip(PARAMETERS, answer.board.parameters, own.units, strict=True)
    )
    return f"the board's own network finds {values}; {_judged(answer, own)}"


def _judged(answer: AxisAnswer, own: AxisIdentification) -> str:
    apart = f"{answer.deviations:.1f} combined standard deviations"
    if answer.verdict is Verdict.AGREES:
        return f"agrees with this host, within {apart}"
    if answer.verdict is Verdict.UNKNOWN_NETWORK:
        return "this host does not have its network, and cannot judge"
    if answer.verdict is Verdict.COMPUTES_OTHERWISE:
        return (
            "the same network finds something else on this host: check the firmware's build, and "
            "that no sample was lost"
        )
    if not own.adequacy.adequate:
        return (
            f"differs from this host by {apart}: the base model, which is all that the board "
            "knows, is not enough on this axis"
        )
    return f"differs from this host by {apart}, and this host finds the same with its network"

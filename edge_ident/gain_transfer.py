"""Gains on their way to the board: backed up, checked, read back, never half written."""

import dataclasses
import logging
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from edge_ident.errors import BoardError, GainError
from edge_ident.json_text import write_json
from firmware_interface.board import AxisLimits, Board
from firmware_interface.gains import POSITIVE, SIGNED, AxisGains

log = logging.getLogger(__name__)


def backup_gains(gains: Mapping[str, AxisGains], path: Path) -> None:
    """Keep the gains that the board has now, before anything else is done to it."""
    document = {
        "schema": "edge-ident/gain-backup/1",
        "axes": {axis: dataclasses.asdict(values) for axis, values in gains.items()},
    }
    write_json(document, path)


def check_gains(
    wanted: Mapping[str, AxisGains],
    active: Mapping[str, AxisGains],
    limits: Mapping[str, AxisLimits],
) -> None:
    """Check bounds and step size on the host, before the board is asked.

    Raises
    ------
    GainError
        Names the gain, its value and the limit.
    """
    for axis, gains in wanted.items():
        now, largest = active[axis].numbers(), limits[axis].gain_maximum.numbers()
        for name, value in gains.numbers().items():
            step = limits[axis].gain_step * largest[name]
            _check_gain(axis, name, value, now[name], largest[name], step)


def _check_gain(
    axis: str, name: str, value: float, now: float, bound: float, largest: float
) -> None:
    lowest = -bound if name in SIGNED else 0.0
    if not lowest <= value <= bound or (name in POSITIVE and value == 0.0):
        raise GainError(
            f"axis {axis}: {name} {value:.4g} is outside the board's limits "
            f"{lowest:.4g} to {bound:.4g}",
            "ask for a lower --bandwidth, take the effect out of the model file, "
            "or raise the limit in the board's firmware",
        )
    if abs(value - now) > largest:
        raise GainError(
            f"axis {axis}: {name} would change by {abs(value - now):.4g} at once; the board allows "
            f"{largest:.4g}",
            "approach the goal in steps with --bandwidth",
        )


def write_gains(board: Board, wanted: Mapping[str, AxisGains]) -> None:
    """Stage, read back, commit, read back: the board runs the new gains, unconfirmed.

    Raises
    ------
    BoardError
        What was read back differs; the board still has, or is given back, the old gains.
    """
    board.stage_gains(wanted)
    compare_gains("staged", wanted, board.staged_gains())
    board.commit()
    compare_gains("active", wanted, board.active_gains())
    log.info("gains committed and read back")


def compare_gains(what: str, wanted: Mapping[str, AxisGains], got: Mapping[str, AxisGains]) -> None:
    """Require that what was read back is what was written, to the last bit of a 32-bit float.

    Raises
    ------
    BoardError
    """
    for axis, gains in wanted.items():
        back = got[axis].numbers()
        for name, value in gains.numbers().items():
            read = back[name]
            if np.float32(value) != np.float32(read):
                raise BoardError(
                    f"axis {axis}: {what} {name} reads back as {read!r}, not {value!r}",
                    "nothing was confirmed; check the link and try again",
                )

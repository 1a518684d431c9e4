"""Gains on their way to the board: backed up, checked, read back, never half written."""

import dataclasses
import logging
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import numpy as np

from edge_ident.errors import BoardError, DataError, EdgeIdentError, GainError
from edge_ident.support.documents import no_file, read_json, write_json
from edge_ident.support.process import deaf_to_interrupts, uncut
from firmware_interface.board import AxisLimits, Board, BoardIdentity
from firmware_interface.board_gains import RunningCommit
from firmware_interface.control_law import feedback_stable
from firmware_interface.errors import BusyError, StoppedError
from firmware_interface.gains import FEEDBACK, POSITIVE, SIGNED, AxisGains, Bank
from firmware_interface.registers import Result

log = logging.getLogger(__name__)


LARGEST_FACTOR: Final = 5.0
"""Factor by which a feedback gain may grow or shrink at once, without --large-steps."""


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
    axis: str, name: str, value: float, now: float, bound: float, largest_step: float
) -> None:
    lowest = -bound if name in SIGNED else 0.0
    too_small = value < lowest or (name in POSITIVE and value == 0.0)
    if too_small or not value <= bound:
        least = "more than 0" if name in POSITIVE else f"{lowest:.4g}"
        large = (
            "give other gains: of a lower --bandwidth, or of a model without the effect that they "
            "compensate; or raise the limit in the board's firmware"
        )
        raise GainError(
            f"axis {axis}: {name} {value:.4g} is outside the board's limits, "
            f"{least} to {bound:.4g}",
            "correct that number, or design the gains anew" if too_small else large,
        )
    if abs(value - now) > largest_step:
        raise GainError(
            f"axis {axis}: {name} would change by {abs(value - now):.4g} at once; the board allows "
            f"{largest_step:.4g}",
            "approach it in smaller steps with --bandwidth",
        )


def check_factor(wanted: Mapping[str, AxisGains], active: Mapping[str, AxisGains]) -> None:
    """Refuse feedback that changes by more than `LARGEST_FACTOR`, to or from zero included.

    Raises
    ------
    GainError
    """
    for axis, gains in wanted.items():
        for name in FEEDBACK:
            now, then = active[axis].numbers()[name], gains.numbers()[name]
            factor = change_factor(now, then)
            if factor > LARGEST_FACTOR:
                raise GainError(
                    f"axis {axis}: {name} would change from {now:.4g} to {then:.4g}; a "
                    f"change by more than a factor of {LARGEST_FACTOR:g} needs --large-steps",
                    "use smaller steps, or add --large-steps if this change is intended",
                )


def check_feedback(board: Board, wanted: Mapping[str, AxisGains]) -> tuple[str, ...]:
    """Refuse feedback that is unstable with the inertia and friction that the board states.

    The board refuses it, too, when it is to come into force.

    Returns
    -------
    tuple of str
        Axes of which the board states no inertia: nothing was checked.

    Raises
    ------
    GainError
    """
    identity, limits = board.identity, board.limits()
    for axis, gains in wanted.items():
        stated = limits[axis]
        if stated.inertia > 0.0 and not feedback_stable(
            gains,
            stated.inertia,
            stated.viscous_friction,
            period_s=identity.sample_period_s,
            control_delay_s=identity.control_delay_s,
        ):
            raise GainError(
                f"axis {axis}: the loop would be unstable with the inertia {stated.inertia:.4g} "
                f"kg*m^2 and the viscous friction {stated.viscous_friction:.4g} N*m*s/rad that the "
                "board's settings state",
                "use softer feedback; if the drive is another one, correct the board's settings",
            )
    return tuple(axis for axis in wanted if not limits[axis].inertia)


def change_factor(now: float, then: float) -> float:
    """How many times a positive number grows or shrinks; infinite to or from zero."""
    # the board keeps 32-bit floats: what is the same there is no change
    if np.float32(now) == np.float32(then):
        return 1.0
    return max(now / then, then / now) if now > 0.0 and then > 0.0 else math.inf


def write_gains(
    board: Board, wanted: Mapping[str, AxisGains], say: Callable[[str], None] = log.warning
) -> RunningCommit | None:
    """Stage, read back, commit, read back: the board runs the new gains, unconfirmed.

    Parameters
    ----------
    board : Board
    wanted : mapping of axis name to AxisGains
    say : callable
        Takes what the person at the machine should know.

    Returns
    -------
    RunningCommit or None
        What became of a commit while the axes came to rest; None where they stood.

    Raises
    ------
    BoardError
        What was read back differs; the board still has, or is given back, the old gains.
    """
    stage_gains(board, wanted)
    return commit_gains(board, wanted, say)


def stage_gains(board: Board, wanted: Mapping[str, AxisGains]) -> None:
    """Write the shadow bank and read it back; what is in force stays.

    Raises
    ------
    LinkError
        What was read back differs.
    """
    board.stage_gains(wanted)
    log.info("gains staged and read back")


def commit_gains(
    board: Board, wanted: Mapping[str, AxisGains], say: Callable[[str], None] = log.warning
) -> RunningCommit | None:
    """Put the staged gains in force, unconfirmed, and read them back; as `write_gains`."""
    running = board.commit_running() if board.coming_to_rest else None
    if running is not None and not running.taken:
        say(_why_at_rest(running))
    if running is None or not running.taken:
        board.settle()
        board.commit()
    compare_gains(wanted, board.active_gains())
    how = "while the control law ran" if running is not None and running.taken else "at rest"
    log.info("gains committed %s and read back", how)
    return running


def _why_at_rest(running: RunningCommit) -> str:
    """Why gains come into force after a stop on a board that could do without."""
    if running.result is not Result.EFFORT_JUMP:
        return "the axes are too near to the end of their travel: gains are committed at rest"
    jumps = ", ".join(f"{axis} {jump:.2g} N*m" for axis, jump in running.jumps_nm.items())
    return f"the effort would jump too far ({jumps}): gains are committed at rest"


def compare_gains(wanted: Mapping[str, AxisGains], got: Mapping[str, AxisGains]) -> None:
    """Require that the gains in force are those that were written, to the last bit of a 32-bit
    float.

    Raises
    ------
    BoardError
    """
    for axis, gains in wanted.items():
        back = got[axis].numbers()
        for name, value in gains.numbers().items():
            read = back[name]
            # to the last bit of what the board can hold: a tolerance would pass a wrong register
            if np.float32(value) != np.float32(read):
                raise BoardError(
                    f"axis {axis}: active {name} reads back as {read!r}, not {value!r}",
                    "check the link; see which gains are in force: edge-ident gains show",
                )


# The shadow bank: what somebody staged in it, and how that outlasts another use of the bank.

_STAGE: Final = "edge-ident gains stage"
_LOST: Final = f"the staged gains may be lost: stage them again with {_STAGE}"


def staged_whole(board: Board, active: Bank) -> dict[str, AxisGains]:
    """Gains in the shadow bank, as somebody staged them.

    Parameters
    ----------
    board : Board
    active : mapping of axis name to AxisGains
        In force.

    Raises
    ------
    BoardError
        Nothing was staged, not all of it arrived, or it is in force already.
    """
    if not board.status().staged_crc_ok:
        raise BoardError("no gains are staged, or they are incomplete", f"stage gains: {_STAGE}")
    staged = board.staged_gains()
    if staged == active:
        raise BoardError(
            "the staged gains are in force already: there is nothing to commit",
            f"stage other gains: {_STAGE}",
        )
    return staged


@contextmanager
@uncut
def staged_kept(board: Board) -> Iterator[None]:
    """Stage again what was staged before the body, however it ends; noted where that fails."""
    staged = board.staged_gains() if board.status().staged_crc_ok else None
    try:
        yield
        if staged is not None:
            board.stage_gains(staged)
    # Ctrl-C too must not cost somebody the gains that he staged
    except BaseException as reason:
        with deaf_to_interrupts():
            if staged is not None and not _staged_again(board, staged, reason):
                reason.add_note(_LOST)
        raise


def confirm_window_s(board: Board) -> float:
    """How long the board waits for new gains to be confirmed.

    It tells only while gains wait, so those in force are committed once more and taken back.
    Nothing changes by that, and what was staged is staged again.
    """
    with staged_kept(board):
        board.stage_gains(board.active_gains())
        board.commit()
        # asked at once: it runs down from the commit on
        window_s = board.status().confirm_remaining_s
        board.roll_back()
    return window_s


def _staged_again(board: Board, staged: Bank, reason: BaseException) -> bool:
    if isinstance(reason, BusyError | StoppedError):  # then another host may use the bank
        return False
    try:
        board.stage_gains(staged)
    except EdgeIdentError as error:
        log.error("stage again: %s", error.cause)
        return False
    return True


# Gains as files: backups of a board's, and designs; both can be staged or restored.

BACKUP_FILE: Final = "gains_before.json"
"""The backup of a run, in its folder."""
BACKUP_SCHEMA: Final = "edge-ident/gain-backup/1"
_DESIGN_SCHEMA: Final = "edge-ident/gains/1"
_FIELDS: Final = {field.name: field for field in dataclasses.fields(AxisGains)}


@dataclass(frozen=True)
class GainFile:
    """What a file holds.

    Attributes
    ----------
    gains : mapping of axis name to AxisGains
    serial_number : int or None
        Of the board whose backup it is.
    """

    gains: Bank
    serial_number: int | None


def save_backup(gains: Bank, identity: BoardIdentity, path: Path) -> None:
    """Keep the gains that the board has now, before anything else is done to it."""
    document = {
        "schema": BACKUP_SCHEMA,
        "serial_number": identity.serial_number,
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "axes": {axis: dataclasses.asdict(values) for axis, values in gains.items()},
    }
    write_json(document, path)


def keep_backup(gains: Bank, identity: BoardIdentity, folder: Path) -> None:
    """Make sure that a folder has the backup of a run; where it was removed, it is written again.

    Raises
    ------
    DataError
        The folder has the backup of another run, which is not overwritten.
    """
    path = folder / BACKUP_FILE
    if not path.exists():
        save_backup(gains, identity, path)
    elif load_gains(path) != GainFile(dict(gains), identity.serial_number):
        raise DataError(
            f"{path} holds other gains than the board: it is of another run",
            "choose another folder; to have these gains back, use edge-ident gains restore",
        )


def back_up(gains: Bank, identity: BoardIdentity, folder: Path) -> Path:
    """Keep gains in a folder of backups, by serial number of the board and time (UTC)."""
    time = datetime.now(UTC).strftime("%Y-%m-%dT%H-%M-%S.%fZ")
    path = folder / f"board-{identity.serial_number}-{time}.json"
    save_backup(gains, identity, path)
    log.info("gains of board %d saved in %s", identity.serial_number, path)
    return path


def load_gains(path: Path) -> GainFile:
    """Read a backup, or the document of a design (schema edge-ident/gains/1).

    Raises
    ------
    DataError
        No such file, another kind of document, or a number that is missing, unknown or not
        finite.
    """
    if not path.is_file():
        raise DataError(
            no_file(path), "give a backup, or gains.json from `edge-ident gains FILE --output DIR`"
        )
    try:
        document = read_json(path)
    except ValueError as error:
        raise _error(path, f"not a JSON document ({error})") from error
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema not in (BACKUP_SCHEMA, _DESIGN_SCHEMA):
        raise _error(path, f"its schema is {schema!r}")
    axes = document.get("axes")
    if not isinstance(axes, dict) or not axes:
        raise _error(path, "it contains no gains")
    gains = {}
    for axis, entry in axes.items():
        if schema == _DESIGN_SCHEMA and isinstance(entry, dict):
            entry = entry.get("gains")
        gains[axis] = _axis_gains(path, axis, entry)
    return GainFile(gains, _owner(path, document) if schema == BACKUP_SCHEMA else None)


def _owner(path: Path, backup: dict[str, Any]) -> int:
    """Serial number of the board of a backup; gains without one would go to any board."""
    serial_number = backup.get("serial_number")
    if not isinstance(serial_number, int) or isinstance(serial_number, bool):
        raise _error(path, f"serial_number is {serial_number!r:.30}, not a whole number")
    return serial_number


def _axis_gains(path: Path, axis: str, entry: Any) -> AxisGains:
    if not isinstance(entry, dict):
        raise _error(path, f"axis {axis} has no gains")
    for name in entry:
        if name not in _FIELDS:
            raise _error(path, f"axis {axis}: there is no gain {name}")
    values: dict[str, Any] = {}
    for name, field in _FIELDS.items():
        if name in entry:
            values[name] = _value(path, f"axis {axis}: {name}", field.default, entry[name])
        elif field.default is dataclasses.MISSING:
            raise _error(path, f"axis {axis}: {name} is missing")
    return AxisGains(**values)


def _value(path: Path, place: str, default: Any, value: Any) -> float | tuple[float, ...]:
    if not isinstance(default, tuple):
        return _number(path, place, value)
    if not isinstance(value, list) or len(value) != len(default):
        raise _error(path, f"{place} is not a list of {len(default)}")
    return tuple(_number(path, f"{place}[{k}]", entry) for k, entry in enumerate(value))


def _number(path: Path, place: str, value: Any) -> float:
    try:
        number = math.nan if isinstance(value, bool | str) else float(value)
    except (TypeError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise _error(path, f"{place} is {value!r:.30}, not a finite number")
    return number


def _error(path: Path, cause: str) -> DataError:
    return DataError(
        f"{path}: {cause}", "give a backup, or gains.json from `edge-ident gains FILE --output DIR`"
    )

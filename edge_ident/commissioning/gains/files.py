"""Gains as files: backups of a board's, and designs; both can be staged or restored."""

import dataclasses
import logging
import math
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from edge_ident.errors import DataError
from edge_ident.support.atomic_files import no_file
from edge_ident.support.json_text import read_json, write_json
from firmware_interface.board import BoardIdentity
from firmware_interface.gains import AxisGains, Bank

log = logging.getLogger(__name__)

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
            no_file(path),
            "give a backup, or gains.json from `edge-ident gains FILE --output DIR`",
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

"""Gives the diagnosis other thresholds, and a memory of what they do not reach."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from hashlib import sha256
from io import BytesIO
from pickle import Pickler
from typing import Any, Final

from edge_ident.diagnosis import motion_check
from edge_ident.diagnosis.fit import fitting, held_out, noise_floor, summary
from edge_ident.diagnosis.judge import causes
from edge_ident.diagnosis.prepare import preparation
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select import search
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.thresholds import thresholds

# Functions that no threshold reaches, and that take the time.
_PURE: Final[tuple[tuple[object, str], ...]] = (
    (preparation, "prepare_axis"),
    (fitting, "fit"),
    (held_out, "held_out_residuals"),
    (held_out, "standard_deviations"),
    (noise_floor, "noise_floor"),
    (summary, "model_fit"),
    (fitting, "contributions"),
    (summary, "traces"),
    (search, "model_discrepancy"),
    (causes, "_orthogonal_shares"),
    (motion_check, "with_motion_errors"),
    (Search, "of"),
    (Search, "_coarse"),
)


@contextmanager
def changed_threshold(name: str, value: float) -> Iterator[None]:
    """Give a threshold another value in every module that imported it."""
    present: Any = thresholds()[name]
    changed = replace(present, value=value)
    with _exchanged([(place, attribute, changed) for place, attribute in _places(present)]):
        yield


@contextmanager
def remembering() -> Iterator[None]:
    """Let the pure functions return what they returned for the same arguments before."""
    memory = _Memory()
    changes: list[tuple[object, str, object]] = []
    for owner, attribute in _PURE:
        present = vars(owner)[attribute]
        places = [(owner, attribute)] if isinstance(owner, type) else _places(present)
        changes += [(place, name, memory.of(present)) for place, name in places]
    with _exchanged(changes):
        yield


@contextmanager
def _exchanged(changes: Sequence[tuple[object, str, object]]) -> Iterator[None]:
    """Set attributes of modules and classes for a while."""
    before = [(owner, name, vars(owner)[name]) for owner, name, _ in changes]
    for owner, name, value in changes:
        setattr(owner, name, value)
    try:
        yield
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)


def _places(wanted: object) -> list[tuple[object, str]]:
    """Modules of the diagnosis that have an object, and its name there."""
    return [
        (module, name)
        for path, module in list(sys.modules.items())
        if path.startswith("edge_ident.diagnosis")
        for name, value in list(vars(module).items())
        if value is wanted
    ]


class _Memory:
    """Results by function and by the contents of its arguments."""

    def __init__(self) -> None:
        self._results: dict[bytes, Any] = {}
        self._kept: dict[int, object] = {}

    def of(self, function: Any) -> Any:
        """The same function, with this memory; a class method stays one."""
        if isinstance(function, classmethod):
            return classmethod(self.of(function.__func__))

        @wraps(function)
        def remembered(*args: Any, **named: Any) -> Any:
            key = self._key((function.__qualname__, args, named))
            if key not in self._results:
                self._results[key] = function(*args, **named)
            return self._results[key]

        return remembered

    def _key(self, arguments: object) -> bytes:
        buffer = BytesIO()
        _Arguments(buffer, self._identity).dump(arguments)
        return sha256(buffer.getvalue()).digest()

    def _identity(self, value: object) -> int | None:
        """Large objects that are made once are told apart by identity."""
        if isinstance(value, Search):
            value = value.library
        elif not isinstance(value, AxisData):
            return None
        self._kept[id(value)] = value
        return id(value)


class _Arguments(Pickler):
    """Writes arguments, some of them by an identity."""

    def __init__(self, buffer: BytesIO, identity: Callable[[object], int | None]) -> None:
        super().__init__(buffer, protocol=5)
        self._identity = identity

    def persistent_id(self, value: object) -> int | None:
        """The identity that stands for a value; None where it is written itself."""
        return self._identity(value)

"""What a message says of options of the command line, as a program says it."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from edge_ident.errors import DataError

_NAMES: Final = {
    "column": "columns", "unit": "units", "period": "period_s", "axis": "axes",
    "effort_shift": "effort_shift_s",
}  # fmt: skip
"""Fields of `ReadOptions` that are not named as the option is."""
_MAPPINGS: Final = frozenset({"columns", "units"})
_WORDS: Final = ("comma", "point", "semicolon", "tab", "blanks", "sign-magnitude")
_VALUE: Final = (
    r"'[^']*'|[^\s,;:)]*[=\d][^\s,;:)]*|[A-Z_/]+\b|(?<=--axis )[^\s,;:)]+"
    rf"|(?:{'|'.join(_WORDS)})\b"
)
"""What follows an option and is its value, and no word of the sentence."""
_OPTION: Final = re.compile(rf"--([a-z][a-z-]*)(?: ({_VALUE}))?")
_RUN: Final = re.compile(rf"{_OPTION.pattern}(?: {_OPTION.pattern})*")


@contextmanager
def speaking_python(wanted: bool = True) -> Iterator[None]:
    """Reword what a refusal says, where a program reads the data and no command does."""
    try:
        yield
    except DataError as error:
        if not wanted:
            raise
        said = DataError(in_python(error.cause), in_python(error.next_step))
        said.code = error.code
        raise said from error


def in_python(text: str) -> str:
    """The text with `ReadOptions` in the place of options of the command line.

    Examples
    --------
    >>> in_python("accept it: --column 'pos=x_position_rad' --period 0.001")
    "accept it: options=ReadOptions(columns={'pos': 'x_position_rad'}, period_s=0.001)"
    """
    return _RUN.sub(lambda run: _call(run[0]), text)


def _call(run: str) -> str:
    """One call for options that follow each other."""
    given: dict[str, str] = {}
    pairs: dict[str, dict[str, str]] = {}
    axes: list[str] = []
    for option in _OPTION.finditer(run):
        name = option[1].replace("-", "_")
        name, value = _NAMES.get(name, name), (option[2] or "").strip("'")
        heading, equals, meaning = value.partition("=")
        if name in _MAPPINGS and equals:
            pairs.setdefault(name, {})[heading] = meaning
            given[name] = repr(pairs[name])
        elif name == "axes" and value:
            axes.append(value)
            given[name] = repr(axes)
        elif value:
            given[name] = value if _is_number(value) or value.isupper() else repr(value)
        else:
            given[name] = "…"
    called = ", ".join(f"{name}={value}" for name, value in given.items())
    return f"options=ReadOptions({called})"


def _is_number(value: str) -> bool:
    try:
        float(value)
    except ValueError:
        return False
    return True

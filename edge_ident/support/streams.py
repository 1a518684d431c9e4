"""Standard streams that the caller closed, that nobody reads any more, or that lack a character.

The script loads this module first: what it imports must load fast.
"""

import codecs
import io
import os
import sys

from edge_ident.support.words import escaped, visible

TYPE_CHECKING = False  # loading typing takes longer than all that a script's start needs
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any, TextIO

AS_NUMBER = "edge-ident-number"
"""Error handler of encodings."""


def open_closed() -> None:
    """Let the standard streams that the caller closed, as daemons do, lead nowhere.

    Otherwise the next file or board that is opened gets the number of one of them.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(number)
    sys.stdin = sys.stdin or os.fdopen(0)
    sys.stdout = sys.stdout or os.fdopen(1, "w")
    sys.stderr = sys.stderr or os.fdopen(2, "w")


def show_any_character() -> None:
    """Let standard streams show as its number, as JSON writes it, what is not to reach a terminal.

    That is what acts on a terminal or hides (`edge_ident.support.words`), and what it lacks:
    one without UTF-8 has no arrow, and no encoding has what stands in the name of a file that is no
    text. All that a command prints passes here, also what other packages print.
    """
    codecs.register_error(AS_NUMBER, _as_number)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=AS_NUMBER)
        setattr(sys, name, Shown(stream))


def _as_number(error: UnicodeError) -> "tuple[str, int]":
    assert isinstance(error, UnicodeEncodeError)
    return escaped(error.object[error.start : error.end]), error.end


class Shown:
    """A stream whose text is visible; `raw` is for what has made its text so, and draws with it."""

    def __init__(self, raw: "TextIO") -> None:
        self.raw = raw

    def __getattr__(self, name: str) -> "Any":
        return getattr(self.raw, name)

    def write(self, text: str) -> int:
        """Write a text as it may be shown."""
        return self.raw.write(visible(text))

    def writelines(self, lines: "Iterable[str]") -> None:
        """Write texts as they may be shown."""
        self.raw.writelines(map(visible, lines))


def raw(stream: "TextIO") -> "TextIO":
    """A stream as it is, for what escapes names by itself, and draws with escape sequences."""
    return stream.raw if isinstance(stream, Shown) else stream


def flushed(stream: "TextIO") -> None:
    """Write what a stream holds; where that fails, it and all that follows goes nowhere.

    It would fail again at the end of the process, and change the exit code.
    """
    try:
        stream.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)

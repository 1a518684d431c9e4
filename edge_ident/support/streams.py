"""Standard streams that the caller closed, that nobody reads any more, or that lack a character.

The script loads this module first: what it imports must load fast.
"""

import io
import os
import sys

TYPE_CHECKING = False  # loading typing takes longer than all that a script's start needs
if TYPE_CHECKING:
    from typing import TextIO


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


def take_any_character() -> None:
    """Let standard streams show a character that they lack as its number, as JSON writes it.

    A terminal without UTF-8 has no arrow, and no encoding has what stands in the name of a file
    that is no text: a command would end there with its work done and its result untold.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


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

"""Errors that a user can act on, with their exit codes."""

import errno
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Final, NamedTuple

from edge_ident.cli.messages import print_document, say, say_always
from edge_ident.errors import EdgeIdentError
from edge_ident.support.interrupts import INTERRUPTED, interrupted
from edge_ident.support.streams import flushed
from edge_ident.support.words import on_a_line

USAGE: Final = 2
FILE: Final = 5
"""A file that cannot be read, or a result that cannot be written."""
UNREAD: Final = 141
"""Nobody reads the result any more: as a shell says of other programs that a closed pipe ends."""
INTERNAL: Final = 70
"""A defect of the program itself, by the number that sysexits.h has for it."""
_LONGEST: Final = 4000
"""Characters of a cause or a next step: forty columns by headings of a line each."""
_NO_ROOM: Final = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)


class Failure(NamedTuple):
    """An error as it is reported.

    Attributes
    ----------
    exit_code : int
    code : {"link", "board", "data", "model", "gains", "file", "usage", "interrupted", "internal"}
        What failed, for scripts.
    cause, next_step : str
        One line each.
    """

    exit_code: int
    code: str
    cause: str
    next_step: str


INTERRUPTION: Final = Failure(
    INTERRUPTED, "interrupted", "the command was interrupted", "run it again when you are ready"
)
CLOSED: Final = Failure(
    FILE,
    "file",
    "the output was closed before the result was written to it",
    "let what reads it read to the end; files are written",
)
UNREAD_RESULT: Final = CLOSED._replace(exit_code=UNREAD)


def failure_of(error: BaseException) -> Failure | None:
    """What to tell about an error; None for what a user cannot act on."""
    if isinstance(error, EdgeIdentError):
        return Failure(error.exit_code, error.code, error.cause, error.next_step)
    if isinstance(error, BrokenPipeError):
        return CLOSED if _notes(error) else UNREAD_RESULT
    if isinstance(error, OSError):
        return Failure(FILE, "file", str(error), _remedy(error))
    if isinstance(error, KeyboardInterrupt) or interrupted():
        return INTERRUPTION
    return None


def tell(error: BaseException, failure: Failure, *, as_json: bool) -> int:
    """Print an error on stderr, as a document on stdout where JSON is wanted; the exit code."""
    if failure is INTERRUPTION:
        say("interrupted")
    elif failure is not UNREAD_RESULT:
        say_always(f"error: {_line(failure.cause)}")
        say_always(f"next:  {_line(failure.next_step)}")
    for note in _notes(error):
        say_always(f"note:  {_line(note)}")
    flushed(sys.stdout)
    if as_json:
        print_failure(error, failure)
    return failure.exit_code


def _line(sentence: str) -> str:
    """One line, whatever stands in the names that it quotes, and no more than a person reads."""
    line = on_a_line(sentence)
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]}…"


def print_failure(error: BaseException, failure: Failure) -> None:
    """Print the one JSON document of a command that failed, schema edge-ident/error/1."""
    document = {
        "schema": "edge-ident/error/1",
        "code": failure.code,
        "error": type(error).__name__,
        "message": failure.cause,
        "cause": failure.cause,
        "next_step": failure.next_step,
        "notes": _notes(error),
        "exit_code": failure.exit_code,
    }
    try:
        print_document(document)
    except OSError:  # stdout may be what failed
        flushed(sys.stdout)


@contextmanager
def noting(done: Iterable[str]) -> Iterator[None]:
    """Note on whatever ends the body early what has been done to the machine by then."""
    try:
        yield
    except BaseException as error:
        for sentence in done:
            error.add_note(sentence)
        raise


def _notes(error: BaseException) -> list[str]:
    """What became of the machine, one line each."""
    return list(getattr(error, "__notes__", ()))


def _remedy(error: OSError) -> str:
    full = error.errno in _NO_ROOM
    remedy = "free some space on that disk" if full else "check the path and your rights to it"
    return f"{remedy}, or choose another folder with --output"

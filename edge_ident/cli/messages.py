"""Data goes to stdout, messages to stderr; how much is said is chosen once for a command."""

import shutil
import sys
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from edge_ident import report
from edge_ident.support.streams import flushed
from edge_ident.support.words import visible

if TYPE_CHECKING:
    import logging


@dataclass(frozen=True)
class Verbosity:
    """How much a command tells a person on stderr.

    Attributes
    ----------
    quiet : bool
        Only errors.
    verbose : bool
        Also what is done, and how long it took.
    """

    quiet: bool = False
    verbose: bool = False


NORMAL: Final = Verbosity()
_LOGGERS: Final = ("edge_ident", "firmware_interface", "export")
_chosen: Final = [NORMAL]


def verbosity() -> Verbosity:
    """What the command that runs was asked to tell."""
    return _chosen[-1]


@contextmanager
def telling(wanted: Verbosity) -> Iterator[None]:
    """Tell as much as wanted while the body runs."""
    _chosen.append(wanted)
    try:
        with _log_on_stderr() if wanted.verbose else nullcontext():
            yield
    finally:
        _chosen.pop()


def _log_on_stderr() -> AbstractContextManager[None]:
    import logging  # only a person who asks for it needs it

    return logged(logging.StreamHandler(), "%(message)s", _LOGGERS)


def say(message: str) -> None:
    """Print a message for the person on stderr, unless --quiet."""
    if not verbosity().quiet:
        say_always(message)


def say_always(message: str) -> None:
    """Print a message on stderr in any case; on a terminal its lines break between words.

    Where nobody can read it, on a full disk or a closed pipe, the command goes on without a word.
    """
    message = visible(message)  # progress that is shown takes it apart
    if sys.stderr.isatty():
        width = shutil.get_terminal_size().columns
        message = textwrap.fill(message, width, break_long_words=False, break_on_hyphens=False)
    with suppress(OSError):
        print(message, file=sys.stderr)
    flushed(sys.stderr)


def detail(message: str) -> None:
    """Print a message on stderr with --verbose only."""
    if verbosity().verbose:
        say_always(message)


def print_document(document: dict[str, Any]) -> None:
    """Print the one JSON document on stdout."""
    print(report.to_json(document), flush=True)


# Where a command's log goes while it runs.


@contextmanager
def logged(handler: "logging.Handler", line: str, names: Sequence[str]) -> Iterator[None]:
    """Give what loggers of these names tell to a handler, as lines of a format."""
    import logging

    handler.setFormatter(logging.Formatter(line))
    loggers = [logging.getLogger(name) for name in names]
    for logger in loggers:
        logger.setLevel(logging.INFO)
        logger.addHandler(handler)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeHandler(handler)

"""What a command tells: data on stdout, messages and progress on stderr, as much as was chosen."""

import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from threading import Event, Thread
from typing import IO, TYPE_CHECKING, Any, Final, NamedTuple, cast

from edge_ident.support.documents import to_json
from edge_ident.support.process import flushed, raw
from edge_ident.support.words import visible

if TYPE_CHECKING:
    import logging

    from rich.progress import Progress as Bars
    from rich.progress import TaskID


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
    print(to_json(document), flush=True)


def print_result(document: dict[str, Any], *lines: object, as_json: bool) -> None:
    """Print a result on stdout: the one document, or lines for a person."""
    for line in [to_json(document)] if as_json else lines:
        print(line, flush=True)


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


# Progress of a command on stderr: bars on a terminal, lines elsewhere, nothing with --quiet.


LINE_EVERY_S: Final = 5.0
"""Least time between two lines of progress where there is no terminal."""
# Share of that time after which it is looked whether a line is due: the most that one is late.
_LOOK_EVERY: Final = 0.2
_WIDE: Final = 64  # columns of a terminal in which a bar leaves room for words and numbers


class _Count(NamedTuple):
    """How far a stage was at a time."""

    at_s: float
    done: int
    of: int


class Progress:
    """Stages of a job and their counts; with --verbose, how long each stage took.

    This one shows no counts: it is what --quiet leaves.
    """

    def __init__(self) -> None:
        self._title = ""
        self._began_s = time.monotonic()

    def stage(self, title: str) -> None:
        """End the last stage, begin another."""
        self.end()
        self._title = title
        self._began_s = time.monotonic()
        self._begin()

    def samples(self, in_hand: int, expected: int) -> None:
        """Show how far the stage is."""

    def say(self, message: str) -> None:
        """Print a message for the person."""
        say(message)

    def note(self, text: str) -> None:
        """Show a remark beside the count."""

    def show(self, stage: str, done: int, total: int) -> None:
        """Show how far a stage is, and begin it where it is not the one that is shown."""
        if stage != self._title:
            self.stage(stage)
        self.samples(done, total)

    def end(self) -> None:
        """Complete the stage that is shown."""
        if self._title:
            detail(f"{self._title}: {time.monotonic() - self._began_s:.2f} s")
        self._title = ""

    def _begin(self) -> None:
        """Show that a stage begins."""


class ProgressLines(Progress):
    """One line every few seconds, for logs and pipes."""

    def __init__(self) -> None:
        super().__init__()
        self._printed_s = time.monotonic()
        self._note = ""
        self._counts: list[_Count] = []

    def samples(self, in_hand: int, expected: int) -> None:
        """Print a line if the last one is some seconds ago.

        What is left is reckoned from the first count on: a motion's lead-in comes before it.
        """
        now_s = time.monotonic()
        self._counts[1:] = [_Count(now_s, in_hand, expected)]
        if self._due(now_s):
            self._print(self._counts, now_s)

    def beat(self) -> None:
        """Print a line also where a stage has had nothing to count for some seconds."""
        now_s, counts = time.monotonic(), self._counts  # a new stage begins a new list
        if not self._title or not self._due(now_s):
            return
        if counts and counts[0].done < counts[-1].done:
            self._print(counts, now_s)
        else:
            say(f"{self._title}: {duration(now_s - self._began_s)} so far")

    def _due(self, now_s: float) -> bool:
        """Whether a line is due, which then counts as printed."""
        due = now_s - self._printed_s >= LINE_EVERY_S
        if due:
            self._printed_s = now_s
        return due

    def _print(self, counts: Sequence[_Count], now_s: float) -> None:
        first, last = counts[0], counts[-1]
        parts = [f"{self._title}: {last.done} of {last.of}"]
        if first.done < last.done < last.of:
            each_s = (last.at_s - first.at_s) / (last.done - first.done)
            left_s = (last.of - last.done) * each_s - (now_s - last.at_s)
            if left_s >= 0.0:  # a step that takes longer than those before ends the estimate
                parts.append(f"{duration(left_s)} left")
        say(", ".join([*parts, *filter(None, [self._note])]))

    def note(self, text: str) -> None:
        """Keep a remark for the next line."""
        self._note = text

    def _begin(self) -> None:
        self._note, self._counts = "", []
        if time.monotonic() - self._printed_s >= LINE_EVERY_S:
            self._printed_s = time.monotonic()
            say(self._title)


class ProgressBars(Progress):
    """One bar for each stage, with the time that is left, on a terminal."""

    def __init__(self, bars: "Bars") -> None:
        super().__init__()
        self._bars = bars
        self._task: TaskID | None = None

    def samples(self, in_hand: int, expected: int) -> None:
        """Show how far the stage is."""
        if self._task is not None:
            self._bars.update(self._task, completed=in_hand, total=expected)

    def note(self, text: str) -> None:
        """Show a remark beside the bar."""
        if self._task is not None:
            self._bars.update(self._task, note=text)

    def end(self) -> None:
        """Fill the bar of the stage that is shown."""
        super().end()
        for task in self._bars.tasks[-1:]:
            total = task.total or 1
            self._bars.update(task.id, total=total, completed=total)

    def _begin(self) -> None:
        self._task = self._bars.add_task(self._title, total=None, note="")


class _Terminal:
    """Stderr for the bars: where the terminal is gone, they are lost and the command goes on."""

    def __init__(self) -> None:
        self._stream = raw(sys.stderr)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> None:
        """Write what can be written."""
        with suppress(OSError):
            self._stream.write(text)

    def flush(self) -> None:
        """Let it appear."""
        flushed(self._stream)


@contextmanager
def shown_progress() -> Iterator[Progress]:
    """Show progress on stderr while the body runs."""
    with ExitStack() as stack:
        progress: Progress
        if verbosity().quiet:
            progress = Progress()
        elif not sys.stderr.isatty():
            progress = lines = ProgressLines()
            stack.enter_context(_beating(lines))
        else:
            progress = ProgressBars(stack.enter_context(_bars()))
        yield progress
        progress.end()


@contextmanager
def _beating(lines: ProgressLines) -> Iterator[None]:
    """Let lines appear while the body computes and tells nothing."""
    ended = Event()

    def beat() -> None:
        while not ended.wait(_LOOK_EVERY * LINE_EVERY_S):
            lines.beat()

    thread = Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _bars() -> "Bars":
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.table import Column

    from edge_ident.support.console import VisibleConsole

    console = VisibleConsole(file=cast(IO[str], _Terminal()))
    return Progress(
        TextColumn("{task.description}", markup=False),
        *([BarColumn(bar_width=16)] if console.width >= _WIDE else []),
        MofNCompleteColumn(table_column=Column(no_wrap=True)),
        TimeElapsedColumn(table_column=Column(no_wrap=True)),
        TimeRemainingColumn(table_column=Column(no_wrap=True)),
        TextColumn("{task.fields[note]}", markup=False),
        console=console,
    )


def duration(seconds: float) -> str:
    """A time that is left, in seconds, minutes or hours."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


@contextmanager
def progress_if_any() -> Iterator[Callable[[str, int, int], None]]:
    """Show progress from the first call on; most jobs are over before there is any."""
    with ExitStack() as stack:
        shown: list[Progress] = []

        def show(stage: str, done: int, total: int) -> None:
            if not shown:
                shown.append(stack.enter_context(shown_progress()))
            shown[0].show(stage, done, total)

        yield show

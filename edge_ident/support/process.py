"""The signals and the standard streams of a process.

This is the first module that the script loads: what it imports must load fast.
"""

import _thread
import codecs
import io
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import CodeType, FrameType

from edge_ident.support.words import escaped, visible

TYPE_CHECKING = False  # loading typing takes longer than all that a script's start needs
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any, Final, ParamSpec, TextIO, TypeVar

    _P = ParamSpec("_P")
    _R = TypeVar("_R")


# Signals that end a command as Ctrl-C does, and how what must be done then is protected from them.
#
# The first raises KeyboardInterrupt. Those that follow close behind change nothing: a service
# manager sends two at once, and a person in a hurry presses Ctrl-C again. A with statement could
# lose its end to them, and the machine its stop.

_NAMES: "Final" = (
    *("SIGINT", "SIGQUIT", "SIGTERM", "SIGHUP", "SIGABRT", "SIGUSR1", "SIGUSR2"),
    *("SIGALRM", "SIGVTALRM", "SIGPROF", "SIGXCPU", "SIGIO", "SIGPWR"),
)
ENDING: "Final" = tuple(s for s in signal.Signals if s.name in _NAMES)
"""Ctrl-C, Ctrl-\\, a service manager, a closed terminal, a limit of computing time, and whatever
else ends a program that does not catch it, but its own faults; not every system has them all."""
SUSPENDING: "Final" = tuple(
    s for s in signal.Signals if s.name in ("SIGTSTP", "SIGTTIN", "SIGTTOU")
)
"""Ctrl-Z, and what a terminal sends to a program in the background that reads or writes there."""
HANGUP: "Final" = tuple(s for s in ENDING if s.name == "SIGHUP")
"""A closed terminal alone."""
INTERRUPTED: "Final" = 130
"""Exit code of a command that such a signal ended."""

# Until a destructor or a few lines have ended; if they have not, the same happens again.
_SOON_S: "Final" = 1e-3
# For so long after an interruption, and after what it had to wait for, none follows. It ends the
# command within that time, unless something has swallowed it.
_QUIET_S: "Final" = 1.0
_received: "Final[list[int]]" = []
_uncut: "Final[set[CodeType]]" = set()
_quiet_until_s = 0.0


def end_at_once() -> None:
    """Let every ending signal end the process where it stands, with a message and no traceback.

    For the time in which modules load or the interpreter shuts down. A signal that the caller has
    this process ignore (nohup, a shell's background) stays ignored.
    """
    _handle_endings(_end_process)


def end_as_by_ctrl_c() -> None:
    """Let every ending signal raise KeyboardInterrupt, so that the machine is stopped.

    A signal that the caller has this process ignore stays ignored.
    """
    sys.unraisablehook = _not_lost
    _handle_endings(_interrupt)


def exit_code_counts() -> None:
    """Have the interpreter end with the exit code that it is given, after an interruption as well.

    It would end by SIGINT where that came while code of a string ran, such as that of a dataclass:
    it remembers so until code of a string runs again. Another one would end it by SIGINT, too, once
    the interpreter has let go of its handlers, but not of those that ignore a signal.
    """
    exec("")
    if _received:
        for ending in ENDING:
            signal.signal(ending, signal.SIG_IGN)


def interrupted() -> bool:
    """Whether an ending signal has raised KeyboardInterrupt in this process.

    A C extension that is interrupted while it loads raises ImportError in its place.
    """
    return bool(_received)


@contextmanager
def ended_by_suspension() -> Iterator[None]:
    """Have Ctrl-Z end the command as Ctrl-C does while the body runs, which nobody may leave alone.

    So does whatever else would suspend it. A signal that is ignored, or means something else, stays
    so.
    """
    if not _in_main_thread():
        yield
        return
    taken = [s for s in SUSPENDING if signal.getsignal(s) is signal.SIG_DFL]
    for suspending in taken:
        signal.signal(suspending, _interrupt)
    try:
        yield
    finally:
        for suspending in taken:
            signal.signal(suspending, signal.SIG_DFL)


@contextmanager
def deaf_to_interrupts(
    endings: "tuple[signal.Signals, ...]" = ENDING + SUSPENDING,
) -> Iterator[None]:
    """Ignore ending signals, or some of them, while the body runs; it must end by itself."""
    if not _in_main_thread():
        yield
        return
    previous = {ending: signal.signal(ending, signal.SIG_IGN) for ending in endings}
    try:
        yield
    finally:
        _be_quiet()
        for ending, handler in previous.items():
            signal.signal(ending, handler)


def uncut(function: "Callable[_P, _R]") -> "Callable[_P, _R]":
    """Have no ending signal cut into the lines of a function, but only into what it calls.

    For one that has to do something in any case: its first line after an exception comes to pass.
    """
    _uncut.add(function.__code__)
    return function


def _in_main_thread() -> bool:
    """Only this one may set the handlers of signals."""
    import threading

    return threading.current_thread() is threading.main_thread()


def _handle_endings(handler: Callable[[int, FrameType | None], None]) -> None:
    for ending in ENDING:
        if signal.getsignal(ending) is not signal.SIG_IGN:
            signal.signal(ending, handler)


def _end_process(number: int, frame: FrameType | None) -> None:
    if not _received:  # else it has been said
        os.write(2, b"interrupted\n")
    os._exit(INTERRUPTED)


def _interrupt(number: int, frame: FrameType | None) -> None:
    _received.append(number)
    if time.monotonic() < _quiet_until_s:
        return
    if frame is not None and _must_not_be_cut(frame):
        _again_soon()
        return
    _be_quiet()
    raise KeyboardInterrupt


def _must_not_be_cut(frame: FrameType) -> bool:
    """Whether these lines enter or leave a with statement, are `uncut`, or called from here."""
    if frame.f_code in _uncut or frame.f_globals.get("__name__") == "contextlib":
        return True
    caller: FrameType | None = frame
    while caller is not None and caller.f_globals is not globals():
        caller = caller.f_back
    return caller is not None


def _be_quiet() -> None:
    global _quiet_until_s
    _quiet_until_s = time.monotonic() + _QUIET_S


def _again_soon() -> None:
    global _quiet_until_s
    _quiet_until_s = 0.0
    _thread.start_new_thread(_interrupt_soon, (_thread.get_ident(),))


def _not_lost(swallowed: "sys.UnraisableHookArgs") -> None:
    """Interrupt again what was interrupted in a destructor, where no exception gets out."""
    if swallowed.exc_type is KeyboardInterrupt:
        _again_soon()
    else:
        sys.__unraisablehook__(swallowed)


def _interrupt_soon(thread: int) -> None:
    time.sleep(_SOON_S)
    if sys.platform == "win32":
        _thread.interrupt_main(_received[-1])
    else:
        signal.pthread_kill(thread, _received[-1])  # also where it waits for something


# Standard streams that the caller closed, that nobody reads any more, or that lack a character.


# Standard streams that the caller closed, that nobody reads any more, or that lack a character.

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

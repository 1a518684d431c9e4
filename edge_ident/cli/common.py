"""What all commands share: options, errors turned into exit codes, output to the right stream.

Data goes to stdout, messages and progress to stderr.
"""

import errno
import functools
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Final, ParamSpec

import typer

from edge_ident.errors import EdgeIdentError

P = ParamSpec("P")

UNTRUSTED: Final = 1
USAGE: Final = 2
INTERRUPTED: Final = 130
_NO_ROOM: Final = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]
Output = Annotated[
    Path | None,
    typer.Option("--output", envvar="EDGE_IDENT_OUTPUT", help="Folder for results."),
]
DriveFile = Annotated[
    Path | None,
    typer.Option(
        "--drive", envvar="EDGE_IDENT_DRIVE", help="Drive description (TOML); default: built in."
    ),
]
Device = Annotated[
    str | None,
    typer.Option(
        "--device",
        envvar="EDGE_IDENT_DEVICE",
        help="/dev/ttyACM0, a pySerial URL, tcp://HOST:PORT, or virtual.",
    ),
]
BaudRate = Annotated[
    int | None,
    typer.Option("--baud-rate", min=50, envvar="EDGE_IDENT_BAUD_RATE", help="Of a serial device."),
]
NetworkFile = Annotated[
    Path | None,
    typer.Option(
        "--network", envvar="EDGE_IDENT_NETWORK", help="Network (.onnx) with its manifest beside."
    ),
]
ModelFile = Annotated[
    Path | None,
    typer.Option(
        "--model",
        envvar="EDGE_IDENT_MODEL",
        help="Model file (.json): effects that are known of the drive.",
    ),
]
Precision = Annotated[
    str,
    typer.Option(
        "--precision", envvar="EDGE_IDENT_PRECISION", help="Built-in network: fp32 or int8."
    ),
]
Seed = Annotated[
    int, typer.Option("--seed", envvar="EDGE_IDENT_SEED", help="Of the random starting points.")
]


def guarded(command: Callable[P, None]) -> Callable[P, None]:
    """Report the user's errors in two lines and leave with the exit code of the contract."""

    @functools.wraps(command)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            command(*args, **kwargs)
        except EdgeIdentError as error:
            _report(error, error.cause, error.next_step, kwargs.get("json"))
            raise typer.Exit(error.exit_code) from error
        except OSError as error:
            full = error.errno in _NO_ROOM
            remedy = "make room there" if full else "check that the path exists and may be written"
            _report(error, str(error), f"{remedy}, or give another folder", kwargs.get("json"))
            raise typer.Exit(USAGE) from error
        except KeyboardInterrupt:
            say("interrupted")
            raise typer.Exit(INTERRUPTED) from None

    return wrapper


def _report(error: Exception, cause: str, next_step: str, as_json: object) -> None:
    say(f"error: {cause}")
    say(f"next:  {next_step}")
    if as_json:
        print_document(
            {
                "schema": "edge-ident/error/1",
                "error": type(error).__name__,
                "cause": cause,
                "next_step": next_step,
            }
        )


def say(message: str) -> None:
    """A message for the person, on stderr."""
    print(message, file=sys.stderr, flush=True)


def deliver(document: dict[str, Any], name: str, output: Path | None, as_json: bool) -> None:
    """Put a command's document where the options say: a file in the folder, stdout, or nowhere."""
    if output:
        from edge_ident.support.json_text import write_json

        write_json(document, output / name)
    if as_json:
        print_document(document)


def print_document(document: dict[str, Any]) -> None:
    """The one JSON document, on stdout."""
    from edge_ident.support.json_text import to_json

    print(to_json(document), flush=True)


def given_model(path: Path | None) -> Any:
    """Load the model that an option names."""
    if path is None:
        return None
    from edge_ident.model.model_files import load_model

    return load_model(path)


def leave_model(found: Any, file: Path, known: Any, folder: Path) -> None:
    """Leave what was identified in a recording's file, with the effects that were assumed."""
    from edge_ident.model.model_files import MODEL_FILE, save_model, sourced_model

    axes = {name: axis.model for name, axis in found.axes.items()}
    save_model(sourced_model(axes, [file], known), folder / MODEL_FILE)


def built_in_or_given_network(path: Path | None, precision: str) -> Any:
    """Load the network that the options name."""
    from edge_ident.estimation.network import VARIANTS, load_network, variant_named

    if precision not in VARIANTS:
        raise typer.BadParameter(f"choose {' or '.join(VARIANTS)}", param_hint="--precision")
    return load_network(variant_named(precision), path)


class ProgressBars:
    """Stages and their counts as rich bars on stderr."""

    def __init__(self, progress: Any) -> None:
        self._progress = progress
        self._task: Any = None

    def stage(self, title: str) -> None:
        """End the last stage, begin another."""
        self.end()
        self._task = self._progress.add_task(title, total=None, note="")

    def samples(self, in_hand: int, expected: int) -> None:
        """Show how far the stage is."""
        self._progress.update(self._task, completed=in_hand, total=expected)

    def say(self, message: str) -> None:
        """Say something above the bars."""
        self._progress.console.print(message, highlight=False, markup=False, soft_wrap=True)

    def note(self, text: str) -> None:
        """Show a word beside the bar."""
        self._progress.update(self._task, note=text)

    def end(self) -> None:
        """Complete the stage that is shown."""
        for task in self._progress.tasks[-1:]:
            total = task.total or 1
            self._progress.update(task.id, total=total, completed=total)


@contextmanager
def shown_progress() -> Iterator[ProgressBars]:
    """Progress on stderr while the body runs."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description:24}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns, console=Console(stderr=True)) as progress:
        bars = ProgressBars(progress)
        yield bars
        bars.end()

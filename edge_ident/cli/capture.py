"""The command capture: a motion and its recording."""

from typing import Annotated, Any, Final

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli.command import command
from edge_ident.cli.hiding import HideOptions
from edge_ident.cli.messages import say
from edge_ident.cli.motion_options import MOTIONS, Cycles, check_named, periods
from edge_ident.cli.options import BoardOptions, ResultOptions, deliver
from edge_ident.cli.progress import shown_progress
from edge_ident.cli.sessions import session

_WRITES: Final = ("capture*.npz", "capture.json")
MotionOrFile = Annotated[
    str,
    typer.Option(
        "--motion",
        metavar="sinusoid|multisine|staircase|FILE",
        envvar="EDGE_IDENT_MOTION",
        help="Motion that the axes make, or a file that plan wrote.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(capture)


@command
def capture(
    *,
    context: typer.Context,
    where: BoardOptions,
    motion: MotionOrFile = "sinusoid",
    cycles: Cycles = None,
    faults: HideOptions,
    results: ResultOptions,
) -> None:
    """Move the axes and record the motion; no gains are written.

    The recording is written to capture.npz in the folder given by --output, which must not hold a
    recording yet. Without --output, each capture gets a folder, named by date and time, in
    edge-ident-runs or in the folder of the setting output. The path of the recording is printed.

    Example: `edge-ident capture --device virtual --motion multisine --output captures/a`
    """
    check_named(motion)
    cycles = periods(context, motion, cycles)
    followed: Any = motion if motion in MOTIONS else edge_ident.load_motion(motion)
    hidden = faults.hidden()
    with session(context, where, results.output, _WRITES, hidden) as opened:
        path = opened.folder / commissioning.CAPTURE_FILE
        with shown_progress() as bars:
            found = commissioning.record_motion(
                opened.board, opened.drive, followed, cycles, path, bars
            )
    document = report.capture_document(found, path)
    faults.add_to(document, hidden)
    deliver(document, "capture.json", opened.folder, results.json)
    if not results.json:
        print(path, flush=True)
        faults.tell(hidden)
        say(f"identify it with: edge-ident identify {path}")

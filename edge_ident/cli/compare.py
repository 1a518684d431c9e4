"""The command compare: identification methods side by side."""

from typing import Annotated

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli.command import UNTRUSTED, command
from edge_ident.cli.file_options import RecordingOptions
from edge_ident.cli.messages import say
from edge_ident.cli.options import NetworkFile, ResultOptions, Seed
from edge_ident.cli.progress import shown_progress

Methods = Annotated[
    list[str] | None,
    typer.Option(
        "--method",
        metavar="NAME",
        help="Use only this method, such as least_squares; may be repeated. An unknown "
        "name lists all methods.",
    ),
]
Tries = Annotated[
    int,
    typer.Option(
        "--tries",
        min=1,
        max=10_000,
        metavar="NUMBER",
        help="Number of tries of random search; the network makes 8 passes.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(compare)


@command
def compare(
    *,
    recording: RecordingOptions,
    network: NetworkFile = None,
    method: Methods = None,
    tries: Tries = 8,
    seed: Seed = 0,
    results: ResultOptions,
) -> None:
    """Identify a recording with every method, from the same signals, and compare the results.

    The comparison is printed; with --output, comparison.json and comparison.png are written to
    that folder.

    Example: `edge-ident compare recording.csv --output comparison`
    """
    known = edge_ident.comparison_methods()
    for name in method or []:
        if name not in known:
            raise typer.BadParameter(
                f"there is no {name}; choose from {', '.join(known)}", param_hint="--method"
            )
    folder = results.folder()
    measured, loaded = recording.load(), edge_ident.load_network(path=network)
    with shown_progress() as bars:
        found = edge_ident.compare(
            measured, loaded, methods=method or (), tries=tries, seed=seed,
            on_stage=bars.stage, on_note=bars.note,
        )  # fmt: skip
    if folder:
        say(f"written: {report.save_figure(found.plot(), folder / 'comparison.png')}")
    results.deliver(report.comparison_document(found), "comparison.json")
    results.show(found)
    if not found.answered:
        raise typer.Exit(UNTRUSTED)

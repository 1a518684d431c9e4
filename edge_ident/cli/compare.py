"""The command that sets identification methods side by side: compare."""

from typing import Annotated

import typer

from edge_ident.cli.common import (
    UNTRUSTED,
    Json,
    NetworkFile,
    Output,
    Seed,
    built_in_or_given_network,
    deliver,
    guarded,
    say,
    shown_progress,
)
from edge_ident.cli.files import Columns, RecordingFile, parse_renames


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(compare)


@guarded
def compare(
    file: RecordingFile,
    column: Columns = None,
    network: NetworkFile = None,
    method: Annotated[
        list[str] | None,
        typer.Option("--method", metavar="NAME", help="Only this method; repeatable."),
    ] = None,
    tries: Annotated[
        int, typer.Option("--tries", min=1, help="Of random search; the network has 8 passes.")
    ] = 8,
    seed: Seed = 0,
    output: Output = None,
    json: Json = False,
) -> None:
    """Identify a recording by every method, on the same signals and samples, side by side.

    Example: `edge-ident compare recording.csv --output comparison`
    """
    from edge_ident.baselines.comparison import compare as compare_methods
    from edge_ident.baselines.comparison_figure import draw_comparison
    from edge_ident.baselines.comparison_report import comparison_document, print_comparison
    from edge_ident.baselines.methods import all_methods
    from edge_ident.signals.recording_files import load_recording

    for name in method or []:
        if name not in all_methods():
            raise typer.BadParameter(
                f"there is no {name}; choose from {', '.join(all_methods())}",
                param_hint="--method",
            )
    recording = load_recording(file, parse_renames(column))
    loaded = built_in_or_given_network(network, "fp32")
    with shown_progress() as bars:
        found = compare_methods(
            recording,
            loaded,
            methods=method or (),
            tries=tries,
            seed=seed,
            on_stage=bars.stage,
            on_note=bars.note,
        )
    deliver(comparison_document(found), "comparison.json", output, json)
    if not json:
        print_comparison(found)
    if output:
        say(f"drawn: {draw_comparison(found, output / 'comparison.png')}")
    if not all(any(row.estimate for row in axis.rows) for axis in found.axes.values()):
        raise typer.Exit(UNTRUSTED)

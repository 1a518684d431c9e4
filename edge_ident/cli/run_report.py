"""The command report: what a run measured, as a figure."""

from pathlib import Path
from typing import Annotated

import typer

from edge_ident import report as reports
from edge_ident.cli.command import command
from edge_ident.cli.messages import print_document
from edge_ident.cli.options import ResultOptions


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(report)


@command
def report(
    *,
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Folder written by run or capture.")
    ],
    results: ResultOptions,
) -> None:
    """Draw the results of a run: effort and model, residual, tracking error before and after.

    The figure is written to report.png in the folder of the run, or in the folder given by
    --output. Its path is printed.

    Example: `edge-ident report edge-ident-runs/2026-01-31T09-15-00`
    """
    figure = reports.draw_run(folder)
    picture = reports.save_figure(figure, results.file("report.png") or folder / "report.png")
    if results.json:
        print_document({"schema": "edge-ident/report/1", "figure": str(picture)})
    else:
        print(picture)

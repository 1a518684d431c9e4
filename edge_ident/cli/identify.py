"""Commands that identify a recording: identify, and compare, several methods side by side."""

from typing import Annotated

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli.command import UNTRUSTED, command
from edge_ident.cli.file_options import RecordingOptions
from edge_ident.cli.messages import say
from edge_ident.cli.options import (
    Details,
    ModelFile,
    NetworkFile,
    NetworkOptions,
    NoDiagnose,
    ResultOptions,
    Seed,
    check_no_run,
    model_for,
    save_result_model,
)
from edge_ident.cli.progress import progress_if_any, shown_progress

# The command identify: from a recording to parameters.


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(identify)
    app.command()(compare)


@command
def identify(
    *,
    recording: RecordingOptions,
    network: NetworkOptions,
    model: ModelFile = None,
    seed: Seed = 0,
    no_diagnose: NoDiagnose = False,
    details: Details = False,
    results: ResultOptions,
) -> None:
    """Identify the parameters of every axis in a recording.

    If a rigid body with friction does not describe an axis, the axis is diagnosed, and the
    parameters are those of the extended model. With --model, the effects of that model are
    compensated first. The result is printed; with --output, identification.json and model.json are
    written to that folder, which must not be that of a run.

    Example: `edge-ident identify recording.csv --column pos=x_position_rad --json`
    """
    check_no_run(results.output)
    watch = edge_ident.Stopwatch()
    with watch.stage("load"):
        measured, loaded = recording.load(), network.load()
        known = model_for(model, measured.axes)
    with progress_if_any() as show:
        found = edge_ident.identify(
            measured, loaded, model=known, seed=seed, diagnose=not no_diagnose, on_progress=show,
            stopwatch=watch,
        )  # fmt: skip
    done = recording.done(recording.file, model=model)
    found = report.with_next_steps(found, done)
    if results.output:
        save_result_model(found.model, [recording.file], results.output, known)
    results.deliver(report.identification_document(found), "identification.json")
    results.answer(lambda: report.identification_answer(found, done, details=details))
    if not found.shows_something:
        raise typer.Exit(UNTRUSTED)


# The command compare: identification methods side by side.

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

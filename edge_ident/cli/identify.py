"""The command identify: from a recording to parameters."""

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli.command import UNTRUSTED, command
from edge_ident.cli.file_options import RecordingOptions
from edge_ident.cli.options import (
    Details,
    ModelFile,
    NetworkOptions,
    NoDiagnose,
    ResultOptions,
    Seed,
    check_no_run,
    model_for,
    save_result_model,
)
from edge_ident.cli.progress import progress_if_any


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(identify)


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

"""Commands on recordings: import, identify; compare, by several methods; survey, of a folder."""

import sys
from pathlib import Path
from typing import Annotated, Literal, NoReturn

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli import options
from edge_ident.cli.command import FILE, UNTRUSTED, command
from edge_ident.cli.file_options import FileOptions, RecordingOptions
from edge_ident.cli.messages import detail, print_document, progress_if_any, say, shown_progress
from edge_ident.cli.options import Setting, setting

# The command identify: from a recording to parameters.


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command("import")(import_file)
    app.command()(identify)
    app.command()(compare)
    app.command()(survey)


@command
def identify(
    *,
    recording: RecordingOptions,
    network: options.NetworkOptions,
    model: Setting[Path | None] = None,
    seed: options.Seed = 0,
    no_diagnose: Setting[bool] = False,
    details: bool = False,
    results: options.ResultOptions,
) -> None:
    """Identify the parameters of every axis in a recording.

    If a rigid body with friction does not describe an axis, the axis is diagnosed, and the
    parameters are those of the extended model. With --model, the effects of that model are
    compensated first. With --output, identification.json and model.json are written to that folder,
    which must not be that of a run.

    Example: `edge-ident identify recording.csv --column pos=x_position_rad --json`
    """
    options.check_no_run(results.output)
    watch = edge_ident.Stopwatch()
    with watch.stage("load"):
        measured, loaded = recording.load(), network.load()
        known = options.model_for(model, measured.axes)
    with progress_if_any() as show:
        found = edge_ident.identify(
            measured, loaded, model=known, seed=seed, diagnose=not no_diagnose, on_progress=show,
            stopwatch=watch,
        )  # fmt: skip
    done = recording.done(recording.file, model=model)
    found = report.findings.with_next_steps(found, done)
    if results.output:
        options.save_result_model(found.model, [recording.file], results.output, known)
    results.deliver(report.documents.identification_document(found), "identification.json")
    results.answer(
        lambda: report.identification.identification_answer(found, done, details=details)
    )
    if not found.shows_something:
        raise typer.Exit(UNTRUSTED)


# The command compare: identification methods side by side.


@command
def compare(
    *,
    recording: RecordingOptions,
    network: Setting[Path | None] = None,
    method: list[str] | None = None,
    tries: Annotated[int, typer.Option(min=1, max=10_000)] = 8,
    seed: options.Seed = 0,
    results: options.ResultOptions,
) -> None:
    """Identify a recording with every method, from the same signals, and compare the results.

    With --output, comparison.json and comparison.png are written to that folder.

    Example: `edge-ident compare recording.csv --output comparison`

    Parameters
    ----------
    method : NAME
        Use only this method, such as least_squares; may be repeated. An unknown name lists all
        methods.
    tries : NUMBER
        Number of tries of random search; the network makes 8 passes.
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
        say(f"written: {report.render.save_figure(found.plot(), folder / 'comparison.png')}")
    results.deliver(report.comparison.comparison_document(found), "comparison.json")
    results.show(found)
    if not found.answered:
        raise typer.Exit(UNTRUSTED)


# The command import: what a file of another program holds, and a recording made of it.


@command
def import_file(
    *,
    recording: RecordingOptions,
    output: Annotated[Path | None, options.RECORDING] = None,
    json: bool = False,
) -> None:
    """Show the columns, units and sampling of a file, and convert it to a recording in SI units.

    If the meaning of a column is not certain, a proposal is printed with the command that accepts
    it, and nothing is written. All commands that read a recording have the same options. With
    --output, the recording is written to that file or folder, and its path is printed.

    Example: `edge-ident import scope.csv --unit Position=mm -o drive.npz`
    """
    target = None if output is None else options.recording_file(output)
    if target is not None and target.exists() and target.samefile(recording.file):
        raise typer.BadParameter(
            f"{target} is the file to import, which may hold more than the recording",
            param_hint="--output",
        )
    found = recording.inspect(recording.file)
    if found.questions:
        _ask(found, recording, json)
    made = found.recording()
    if target is not None:
        edge_ident.save_recording(made, target)
    for line in (
        *report.recordings.resting_lines(found, made),
        *report.recordings.scale_lines(made),
    ):
        say(line)
    if json:
        print_document(report.recordings.import_document(found, made, target))
        return
    tell = print if target is None else say  # where a file is written, its path is the result
    for line in (
        *report.recordings.inspection_lines(found),
        *report.recordings.recording_lines(made),
    ):
        tell(line)
    if target is not None:
        print(target)


def _ask(found: "edge_ident.Inspection", recording: RecordingOptions, as_json: bool) -> NoReturn:
    """Show a proposal, what is not certain of it, and the command that accepts it."""
    if as_json:
        print_document(report.recordings.import_document(found, None, None))
    else:
        for line in report.recordings.inspection_lines(found):
            print(line)
    say(f"error: {recording.doubt(found)}")
    say(f"next:  {recording.accepting(found, recording.file)}")
    raise typer.Exit(edge_ident.DataError.exit_code)


# The command survey: every recording of a folder, and which unit stands out.


_LINES = 20  # where nobody scrolls


@command
def survey(
    *,
    folder: Annotated[Path, typer.Argument()],
    units: Literal["file", "folder"] = "file",
    files: str | None = None,
    jobs: Annotated[int | None, setting("-j", min=1)] = None,
    cluster: Setting[str | None] = None,
    model: Setting[Path | None] = None,
    no_diagnose: Setting[bool] = False,
    machine: Setting[str] = "",
    reading: FileOptions,
    output: Annotated[Path | None, setting("-o", parser=options.result_folder)] = None,
    json: bool = False,
) -> None:
    """Identify and diagnose every recording of a folder, and say which unit stands out.

    A table (survey.csv, survey.parquet), a page (report.html) and survey.json are written to the
    folder given by --output, which must not be that of a run. Results are kept there: the next
    survey does only what is missing or has changed. The result is printed.

    Example: `edge-ident survey recordings --jobs 4 --output comparison`

    Parameters
    ----------
    folder : FOLDER
        Folder with recordings; subfolders count, too.
    units
        What counts as one unit: each file, or each subfolder with all its recordings.
    files : PATTERN
        Recordings to take, such as '*.csv'; default: all.
    jobs : NUMBER
        Number of recordings analysed at the same time; default: one for each core.
    cluster : ADDRESS
        Dask scheduler, such as tcp://HOST:8786, whose workers do the work.
    output : FOLDER
        Folder to write the results to; default: edge-ident-survey in the folder.
    """
    options.check_no_run(kept := output or folder / "edge-ident-survey")
    with shown_progress() as bars:
        found = edge_ident.survey(
            folder, units=units, pattern=files, options=reading.options(),
            model=options.given_model(model), diagnose=not no_diagnose, jobs=jobs, cluster=cluster,
            output=kept, on_progress=bars.show, on_recording=_tell,
        )  # fmt: skip
    document = report.survey.survey_document(found)
    written = report.survey.write_survey_tables(found, kept)
    say(f"written: {report.survey_page.write_survey_page(found, document, kept, machine, folder)}")
    options.deliver(document, "survey.json", kept, as_json=json)
    if not any(path.suffix == ".parquet" for path in written):
        say("no survey.parquet: pip install 'edge-ident[parquet]'")
    if not json:
        _show(found)
    if not found.units:
        raise typer.Exit(FILE)
    if not found.trusted:
        raise typer.Exit(UNTRUSTED)


def _show(found: "edge_ident.Survey") -> None:
    """Print all of it on a terminal, and no more than a screen elsewhere."""
    if sys.stdout.isatty():
        report.render.show(found)
    else:
        print(*report.survey.survey_lines(found, _LINES), sep="\n", flush=True)


def _tell(recording: "edge_ident.SurveyedRecording") -> None:
    """Say what failed, and with --verbose how long each recording took."""
    if recording.failed:
        say(f"{recording.file}: {recording.failed.cause}")
    else:
        detail(f"{recording.file}: {recording.duration_s:.2f} s")

"""The command survey: every recording of a folder, and which unit stands out."""

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli import options
from edge_ident.cli.command import FILE, UNTRUSTED, command
from edge_ident.cli.file_options import FileOptions
from edge_ident.cli.messages import detail, say, shown_progress
from edge_ident.cli.options import option, setting

RecordingFolder = Annotated[
    Path, typer.Argument(metavar="FOLDER", help="Folder with recordings; subfolders count, too.")
]
Jobs = Annotated[
    int | None,
    setting(
        "--jobs -j NUMBER",
        "Number of recordings analysed at the same time; default: one for each core.",
        min=1,
    ),
]
Cluster = Annotated[
    str | None,
    setting(
        "--cluster ADDRESS", "Dask scheduler, such as tcp://HOST:8786, whose workers do the work."
    ),
]
Units = Annotated[
    Literal["file", "folder"],
    option(
        "--units", "What counts as one unit: each file, or each subfolder with all its recordings."
    ),
]
Pattern = Annotated[
    str | None, option("--files PATTERN", "Recordings to take, such as '*.csv'; default: all.")
]
SurveyFolder = Annotated[
    Path | None,
    setting(
        "--output -o FOLDER",
        "Folder to write the results to; default: edge-ident-survey in the folder.",
        parser=options.result_folder,
    ),
]


_LINES = 20  # where nobody scrolls


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(survey)


@command
def survey(
    *,
    folder: RecordingFolder,
    units: Units = "file",
    files: Pattern = None,
    jobs: Jobs = None,
    cluster: Cluster = None,
    model: options.ModelFile = None,
    no_diagnose: options.NoDiagnose = False,
    machine: options.Machine = "",
    reading: FileOptions,
    output: SurveyFolder = None,
    json: options.Json = False,
) -> None:
    """Identify and diagnose every recording of a folder, and say which unit stands out.

    A table (survey.csv, survey.parquet), a page (report.html) and survey.json are written to the
    folder given by --output, which must not be that of a run. Results are kept there: the next
    survey does only what is missing or has changed. The result is printed.

    Example: `edge-ident survey recordings --jobs 4 --output comparison`
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
    options.deliver(document, "survey.json", kept, json)
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

"""What a model gets wrong: diagnose, and plan, the motion that separates causes."""

from pathlib import Path
from typing import Annotated, Literal

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli import options
from edge_ident.cli.command import UNTRUSTED, command
from edge_ident.cli.file_options import FileOptions
from edge_ident.cli.messages import print_document, say, shown_progress
from edge_ident.cli.options import Setting, setting
from edge_ident.support.stopwatch import keep

# The command diagnose: what a model gets wrong, and why.

RecordingFiles = Annotated[
    list[Path], typer.Argument(metavar="FILE", help="Recordings of one machine.")
]


_PAGES = {"html": "report.html", "markdown": "report.md"}  # name of the page in the folder


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(diagnose)
    app.command()(plan)


@command
def diagnose(
    *,
    files: RecordingFiles,
    validate: Setting[Path | None] = None,
    model: Setting[Path | None] = None,
    tolerance: Annotated[float, setting(parser=options.part)] = edge_ident.TOLERANCE,
    stability: Annotated[bool | None, typer.Option("--stability/--no-stability")] = None,
    keep_minor: Annotated[bool | None, typer.Option("--keep-minor")] = None,
    page: Annotated[Literal["html", "markdown"], setting("--format")] = "html",
    machine: Setting[str] = "",
    reading: FileOptions,
    details: bool = False,
    results: options.ResultOptions,
) -> None:
    """Find out what the base model gets wrong, and extend it by physical causes.

    The base model is a rigid body with friction. With --output, a page (report.html),
    diagnosis.json and the extended model (model.json) are written to that folder, which must not be
    that of a run.

    Example: `edge-ident diagnose monday.csv tuesday.csv --validate friday.csv --output diagnosis`

    Parameters
    ----------
    validate : FILE
        Another recording of the machine, on which the fitted models are tested.
    tolerance : SHARE
        Smallest part of the rms effort that a cause must explain to be reported, such as 1% or
        0.01.
    stability
        Deprecated, and without effect: no search is repeated any more.
    keep_minor
        Deprecated, and without effect: the model has the causes that are smaller than --tolerance.
    page
        Format of the page in the folder: one HTML file, or Markdown with pictures.
    """
    options.check_no_run(results.output)
    if stability is not None:
        say("ignored: --stability and --no-stability are deprecated, and have no effect")
    if keep_minor is not None:
        say("ignored: --keep-minor is deprecated, and has no effect")
    keep()
    with shown_progress() as bars:
        bars.stage("reading")
        recordings = [reading.read(file) for file in files]
        known = options.model_for(model, recordings[0].axes)
        found = edge_ident.diagnose(
            recordings, model=known, validate=reading.read(validate) if validate else None,
            tolerance=tolerance, on_progress=bars.show,
        )  # fmt: skip
    shown = results.output and results.output / _PAGES[page]
    done = reading.done(*files, validate, page=shown, model=model)
    found = report.findings.with_next_steps(found, done)
    model_file = None
    if results.output:
        model_file = options.save_result_model(found.model, files, results.output, known)
        source = report.rendering.Provenance.of(files, validate, machine)
        say(f"written: {_written(page, found, source, results.output, model_file)}")
    results.deliver(report.diagnosis.diagnosis_document(found, model_file), "diagnosis.json")
    results.answer(lambda: report.diagnosis.diagnosis_answer(found, done, details=details))
    if not found.conclusive:
        raise typer.Exit(UNTRUSTED)


def _written(
    page: str,
    found: edge_ident.Diagnosis,
    source: report.rendering.Provenance,
    folder: Path,
    model_file: Path | None,
) -> Path:
    """The page that was written."""
    if page == "markdown":
        return report.diagnosis_page.write_markdown(
            found, [name for name, _ in source.files], folder
        )
    return report.diagnosis_page.write_page(found, source, folder, model_file)


# The command plan: the motion that separates causes.


@command
def plan(
    *,
    files: RecordingFiles,
    drive: Setting[Path | None] = None,
    model: Setting[Path | None] = None,
    seconds: Annotated[float | None, setting(min=1.0, max=600.0)] = None,
    seed: options.Seed = 0,
    reading: FileOptions,
    output: Annotated[Path | None, typer.Option("-o", parser=options.named)] = None,
    json: bool = False,
) -> None:
    """Design a motion that separates the causes that the recordings leave open.

    The recordings are diagnosed first. The motion and its overshoot stay inside the limits of the
    drive description (--drive; default: the built-in drive). The motion and the causes that it
    separates are printed; with --output, the motion is written to that file.

    Example: `edge-ident plan recording.csv --drive press.toml --output motion.json`

    Parameters
    ----------
    seconds : NUMBER
        Duration of the motion; default: as in the drive description.
    output : FILE
        File to write the motion to, for capture --motion FILE.
    """
    recordings = [reading.read(file) for file in files]
    axes = recordings[0].axes
    limits, known = options.drive_for(drive, axes), options.model_for(model, axes)
    say(_whose(drive))
    keep()
    with shown_progress() as bars:
        diagnosis = edge_ident.diagnose(recordings, model=known, on_progress=bars.show)
        bars.stage("designing the motion")
        found = edge_ident.plan_motion(diagnosis, recordings, limits, duration_s=seconds, seed=seed)
    written = output if found.trajectory is not None else None
    if found.trajectory is not None and output is not None:
        edge_ident.save_motion(found.trajectory, output)
        say(f"written: {output}; run it with: edge-ident capture --motion {output}")
    elif found.trajectory is not None:
        say("keep the motion with --output FILE, and run it with: edge-ident capture --motion FILE")
    if json:
        print_document(report.plan.plan_document(found, written))
    else:
        report.render.show(found)
    if found.trajectory is None:
        say("next:  " + report.plan.plan_next_step(found))
    if found.pairs and not all(pair.separated for pair in found.pairs):
        raise typer.Exit(UNTRUSTED)


def _whose(drive: Path | None) -> str:
    """Sentence that says whose limits the motion keeps."""
    if drive is not None:
        return f"limits: those of {drive}"
    return (
        "limits: those of the built-in drive, which may be more than your machine bears. Give its "
        "own with --drive FILE; edge-ident init writes such a file"
    )

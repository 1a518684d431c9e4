"""The command gains: designs from a recording, or runs one of the verbs of board_gains."""

from typing import Annotated, Any, Final

import typer

import edge_ident
from edge_ident import report
from edge_ident.cli import board_gains
from edge_ident.cli.command import UNTRUSTED, command
from edge_ident.cli.command_group import CommandGroup, with_example
from edge_ident.cli.file_options import RecordingOptions
from edge_ident.cli.messages import say
from edge_ident.cli.options import (
    Bandwidth,
    Details,
    DriveFile,
    ModelFile,
    NetworkOptions,
    NoDiagnose,
    ResultOptions,
    drive_for,
    model_for,
)
from edge_ident.cli.progress import progress_if_any

_HELP: Final = """Design gains from a recording (gains FILE), or manage the gains of a board.

Example: `edge-ident gains capture.npz --bandwidth 12`
"""
_NEXT: Final = "write the gains to a file: edge-ident gains FILE --output gains.json"
ControlDelay = Annotated[
    float,
    typer.Option(
        "--control-delay",
        min=0.0,
        metavar="SECONDS",
        help="Time from reading the encoder to applying the new effort.",
    ),
]


class _DesignUnlessVerb(CommandGroup):
    """`gains FILE` is short for `gains design FILE`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] != "--help" and args[0] not in self.commands:
            args = ["design", *args]
        return super().parse_args(ctx, args)


def register(app: typer.Typer) -> None:
    """Add this file's command, a group of verbs."""
    group = typer.Typer(cls=_DesignUnlessVerb, no_args_is_help=True, rich_markup_mode=None)
    group.command()(design)
    board_gains.register(group)
    app.add_typer(group, name="gains", help=with_example(_HELP))


@command
def design(
    *,
    recording: RecordingOptions,
    drive: DriveFile = None,
    bandwidth: Bandwidth = None,
    control_delay: ControlDelay = 0.0005,
    network: NetworkOptions,
    model: ModelFile = None,
    no_diagnose: NoDiagnose = False,
    details: Details = False,
    results: ResultOptions,
) -> None:
    """Identify a recording and design controller gains; nothing is written to a board.

    The gains are printed; with --output they are also written to gains.json in that folder, from
    which `edge-ident gains stage` can write them to a board.

    Example: `edge-ident gains capture.npz --bandwidth 12`
    """
    recorded = recording.load()
    described = drive_for(drive, recorded.axes)
    with progress_if_any() as show:
        found = edge_ident.identify(
            recorded, network.load(), model=model_for(model, recorded.axes),
            diagnose=not no_diagnose, on_progress=show,
        )  # fmt: skip
    done = recording.done(recording.file, model=model)
    found = report.with_next_steps(found, done)
    if not found.trusted:
        results.deliver(report.gains_document(found, {}), "gains.json")
        _show(found, results, done, details=details)
        if not results.json:
            say("no gains were designed: the parameters are not trusted")
        raise typer.Exit(UNTRUSTED)
    designs = edge_ident.design_gains(
        found.model, described, bandwidth_rad_s=bandwidth, control_delay_s=control_delay,
        at_s=max(axis.end_s for axis in found.axes.values()),
    )  # fmt: skip
    results.deliver(report.gains_document(found, designs.axes), "gains.json")
    _show(found, results, done, details=details)
    results.show(designs)
    if results.output and not results.json:
        file = results.file("gains.json")
        say(f"written: {file}; write them to a board with: edge-ident gains stage {file}")


def _show(
    found: edge_ident.Identification, results: ResultOptions, done: "report.Done", *, details: bool
) -> None:
    then = _NEXT if results.output is None else ""
    results.answer(
        lambda: report.identification_answer(found, done, details=details, without_findings=then)
    )

"""The life of a board's gains: show, diff, stage, commit, rollback, store, restore."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from edge_ident.cli.common import (
    UNTRUSTED,
    BaudRate,
    Device,
    DriveFile,
    Json,
    ModelFile,
    Output,
    deliver,
    given_model,
    guarded,
    say,
    shown_progress,
)
from edge_ident.cli.sessions import connected

if TYPE_CHECKING:
    from edge_ident.commissioning.gain_forecast import Forecasts
    from edge_ident.report.gain_report import GainReport
    from firmware_interface.board import Board
    from firmware_interface.gains import Bank

GainsFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="Backup, or what `gains FILE --output DIR` left.")
]
MotionFile = Annotated[
    Path | None,
    typer.Option(
        "--recording",
        metavar="FILE",
        help="Of the drive: margins and tracking on its motion are foretold from it.",
    ),
]
Backups = Annotated[
    Path,
    typer.Option("--backups", envvar="EDGE_IDENT_BACKUPS", help="Folder for gains of before."),
]
LargeSteps = Annotated[
    bool,
    typer.Option(
        "--large-steps", help="Let feedback gains grow or shrink more than five times at once."
    ),
]
_BACKUPS: Final = Path("edge-ident-gains")


def register(group: typer.Typer) -> None:
    """Add this file's verbs."""
    for verb in (show, diff, stage, commit, rollback, store, restore):
        group.command()(verb)


@guarded
def show(
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    model: ModelFile = None,
    recording: MotionFile = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Show the gains in force and those staged; with a model or recording, what they promise.

    Example: `edge-ident gains show --device /dev/ttyACM0 --model model.json`
    """
    from edge_ident.report.gain_report import GainReport

    with connected(device, baud_rate, drive) as (board, _):
        active, status = board.active_gains(), board.status()
        staged = board.staged_gains() if status.staged_crc_ok else None
        banks = [active] if staged is None else [active, staged]
        report = GainReport(
            board.identity.serial_number,
            active,
            staged,
            _foretold(board, banks, model, recording),
            unconfirmed_s=status.confirm_remaining_s if status.unconfirmed else None,
        )
    _deliver(report, output, json)


@guarded
def diff(
    file: GainsFile,
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    model: ModelFile = None,
    recording: MotionFile = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Compare a file's gains with those in force; nothing is written.

    Example: `edge-ident gains diff gains.json --device /dev/ttyACM0 --recording capture.npz`
    """
    from edge_ident.commissioning.gain_change import wanted_gains
    from edge_ident.commissioning.gain_files import load_gains
    from edge_ident.report.gain_report import GainReport

    loaded = load_gains(file)
    with connected(device, baud_rate, drive) as (board, _):
        active = board.active_gains()
        wanted = wanted_gains(active, loaded)
        foretold = _foretold(board, [active, wanted], model, recording)
        report = GainReport(board.identity.serial_number, active, wanted, foretold)
    _deliver(report, output, json)


@guarded
def stage(
    file: GainsFile,
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    model: ModelFile = None,
    recording: MotionFile = None,
    backups: Backups = _BACKUPS,
    large_steps: LargeSteps = False,
    output: Output = None,
    json: Json = False,
) -> None:
    """Check a file's gains and write them beside those in force, with read-back.

    Example: `edge-ident gains stage gains.json --device /dev/ttyACM0 --model model.json`
    """
    from edge_ident.commissioning.gain_change import check_change, wanted_gains
    from edge_ident.commissioning.gain_files import back_up, load_gains
    from edge_ident.commissioning.gain_transfer import stage_gains
    from edge_ident.report.gain_report import GainReport

    loaded = load_gains(file)
    with connected(device, baud_rate, drive) as (board, _):
        active = board.active_gains()
        wanted = wanted_gains(active, loaded)
        check_change(board, active, wanted, large_steps)
        foretold = _stable(_foretold(board, [active, wanted], model, recording))
        backup = back_up(active, board.identity, backups)
        stage_gains(board, wanted)
        report = GainReport(board.identity.serial_number, active, wanted, foretold, backup)
    _deliver(report, output, json)
    say("staged and read back; put them in force with: edge-ident gains commit")


@guarded
def commit(
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    model: ModelFile = None,
    recording: MotionFile = None,
    backups: Backups = _BACKUPS,
    large_steps: LargeSteps = False,
    output: Output = None,
    json: Json = False,
) -> None:
    """Put the staged gains in force; they stay if the drive follows a motion no worse with them.

    The machine moves twice, with the old gains and with the new ones. Gains that the motion would
    not tell from those in force are not written.

    Example: `edge-ident gains commit --device /dev/ttyACM0`
    """
    from edge_ident.commissioning.gain_change import check_change, commit_staged, staged_whole
    from edge_ident.commissioning.gain_files import back_up
    from edge_ident.commissioning.safety import make_ready
    from edge_ident.report.gain_report import GainReport

    with connected(device, baud_rate, drive) as (board, described):
        make_ready(board)
        staged = staged_whole(board)
        active = board.active_gains()
        check_change(board, active, staged, large_steps)
        foretold = _stable(_foretold(board, [active, staged], model, recording))
        backup = back_up(active, board.identity, backups)
        with shown_progress() as observer:
            change = commit_staged(board, described, staged, observer)
        report = GainReport(board.identity.serial_number, active, staged, foretold, backup, change)
    _deliver(report, output, json)
    if not (change.confirmed or change.unchanged):
        raise typer.Exit(UNTRUSTED)


@guarded
def rollback(
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Take back gains that were committed and not confirmed; `restore` takes back older ones.

    Example: `edge-ident gains rollback --device /dev/ttyACM0`
    """
    from edge_ident.commissioning.gain_change import roll_back_unconfirmed
    from edge_ident.report.gain_report import GainReport

    with connected(device, baud_rate, drive) as (board, _):
        roll_back_unconfirmed(board)
        report = GainReport(board.identity.serial_number, board.active_gains())
    _deliver(report, output, json)


@guarded
def store(
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    backups: Backups = _BACKUPS,
    output: Output = None,
    json: Json = False,
) -> None:
    """Write the gains in force to the board's permanent memory, so that they outlast its power.

    Example: `edge-ident gains store --device /dev/ttyACM0`
    """
    from edge_ident.commissioning.gain_files import back_up
    from edge_ident.report.gain_report import GainReport

    with connected(device, baud_rate, drive) as (board, _):
        active = board.active_gains()
        backup = back_up(active, board.identity, backups)
        board.store()
        report = GainReport(board.identity.serial_number, active, backup=backup)
    _deliver(report, output, json)
    say("stored")


@guarded
def restore(
    file: GainsFile,
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    model: ModelFile = None,
    recording: MotionFile = None,
    backups: Backups = _BACKUPS,
    large_steps: LargeSteps = False,
    output: Output = None,
    json: Json = False,
) -> None:
    """Stage a backup's gains and put them in force; they stay if a motion ends without a fault.

    The machine moves once, with the restored gains.

    Example: `edge-ident gains restore edge-ident-gains/board-1-….json --device /dev/ttyACM0`
    """
    from edge_ident.commissioning.gain_change import (
        check_change,
        check_owner,
        restore_gains,
        wanted_gains,
    )
    from edge_ident.commissioning.gain_files import back_up, load_gains
    from edge_ident.commissioning.safety import make_ready
    from edge_ident.report.gain_report import GainReport

    loaded = load_gains(file)
    with connected(device, baud_rate, drive) as (board, described):
        check_owner(board, loaded)
        make_ready(board)
        active = board.active_gains()
        wanted = wanted_gains(active, loaded)
        check_change(board, active, wanted, large_steps)
        foretold = _stable(_foretold(board, [active, wanted], model, recording))
        backup = back_up(active, board.identity, backups)
        with shown_progress() as observer:
            change = restore_gains(board, described, wanted, observer)
        report = GainReport(board.identity.serial_number, active, wanted, foretold, backup, change)
    _deliver(report, output, json)


def _foretold(
    board: "Board", banks: list["Bank"], model: Path | None, recording: Path | None
) -> "Forecasts":
    """What the banks promise; nothing where neither model nor recording is given."""
    if model is None and recording is None:
        return ()
    from edge_ident.commissioning.gain_forecast import Forecaster
    from edge_ident.signals.recording_files import load_recording

    motion = None if recording is None else load_recording(recording)
    forecaster = Forecaster(board.identity, board.limits(), given_model(model), motion)
    with shown_progress() as observer:
        observer.stage("forecast")
        return forecaster.forecast(banks, observer.samples)


def _stable(forecasts: "Forecasts") -> "Forecasts":
    """Pass forecasts on if the new gains can work."""
    from edge_ident.commissioning.gain_forecast import check_stable

    for of_new in forecasts[1:]:
        check_stable(of_new)
    return forecasts


def _deliver(report: "GainReport", output: Path | None, json: bool) -> None:
    from edge_ident.report.gain_report import gain_report_document, gain_report_view
    from edge_ident.report.output import show

    deliver(gain_report_document(report), "board_gains.json", output, json)
    if not json:
        show(gain_report_view(report))

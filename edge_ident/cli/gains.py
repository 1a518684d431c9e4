"""The command gains: designs from a recording, or runs one of its verbs on a board."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli import options
from edge_ident.cli.command import UNTRUSTED, CommandGroup, command, noting, with_example
from edge_ident.cli.file_options import RecordingOptions
from edge_ident.cli.messages import progress_if_any, say, shown_progress
from edge_ident.cli.options import Setting
from edge_ident.cli.sessions import connected, located
from edge_ident.support.next_step import Done
from edge_ident.support.words import listed

if TYPE_CHECKING:
    from edge_ident import Board, Drive, GainDesigns
    from edge_ident.commissioning.promise import Forecasts
    from firmware_interface.gains import Bank


_HELP: Final = """Design gains from a recording (gains FILE), or manage the gains of a board.

Example: `edge-ident gains capture.npz --bandwidth 12`
"""
_NEXT: Final = "write the gains to a file: edge-ident gains FILE --output gains.json"


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
    for verb in (show, diff, stage, commit, rollback, store, restore):
        group.command()(verb)
    app.add_typer(group, name="gains", help=with_example(_HELP))


@command
def design(
    *,
    recording: RecordingOptions,
    drive: Setting[Path | None] = None,
    bandwidth: options.Bandwidth = None,
    control_delay: Annotated[float, typer.Option(min=0.0)] = 0.0005,
    network: options.NetworkOptions,
    model: Setting[Path | None] = None,
    no_diagnose: Setting[bool] = False,
    details: bool = False,
    results: options.ResultOptions,
) -> None:
    """Identify a recording and design controller gains; nothing is written to a board.

    With --output, the gains are also written to gains.json, from which `edge-ident gains stage` can
    write them to a board.

    Example: `edge-ident gains capture.npz --bandwidth 12`

    Parameters
    ----------
    control_delay : SECONDS
        Time from reading the encoder to applying the new effort.
    """
    recorded = recording.load()
    described = options.drive_for(drive, recorded.axes)
    for axis in recorded.axes.values():
        commissioning.position_loop.check_units(axis.units)
    with progress_if_any() as show:
        found = edge_ident.identify(
            recorded, network.load(), model=options.model_for(model, recorded.axes),
            diagnose=not no_diagnose, on_progress=show,
        )  # fmt: skip
    done = recording.done(recording.file, model=model)
    found = report.findings.with_next_steps(found, done)
    if not found.consistent:
        results.deliver(report.documents.gains_document(found, {}), "gains.json")
        _show(found, results, done, details=details)
        if not results.json:
            say("no gains were designed: the data contradict themselves")
        raise typer.Exit(UNTRUSTED)
    designs = edge_ident.design_gains(
        found.model, described, bandwidth_rad_s=bandwidth, control_delay_s=control_delay,
        at_s=max(axis.end_s for axis in found.axes.values()),
    )  # fmt: skip
    results.deliver(report.documents.gains_document(found, designs.axes), "gains.json")
    _show(found, results, done, details=details)
    results.show(designs)
    if results.json:
        return
    for line in _not_known(found, designs, described, control_delay, given=drive is not None):
        say(line)
    if results.output:
        file = results.file("gains.json")
        say(f"written: {file}; write them to a board with: edge-ident gains stage {file}")


def _not_known(
    found: edge_ident.Identification,
    designs: "GainDesigns",
    drive: "Drive",
    control_delay_s: float,
    *,
    given: bool,
) -> Iterator[str]:
    """What the margins rest on, and what a recording cannot show of a loop."""
    limits = ", ".join(
        f"{name} {drive.axes[name].effort_limit_nm:.3g} N·m" for name in designs.axes
    )
    yield (
        f"designed for {1.0 / drive.sampling_period_s:.4g} Hz, {1e3 * control_delay_s:.3g} ms from "
        f"encoder to effort, and at most {limits}"
        + ("" if given else ": the built-in drive; give yours with --drive and --control-delay")
    )
    for name, loop in designs.loops.items():
        yield (
            f"axis {name}: it moved at up to {found.axes[name].moved_up_to_hz:.3g} Hz, and its "
            f"loop acts up to {loop.crossover_hz:.3g} Hz. The margins know of no resonance that "
            "the motion did not show: approach the gains in steps with --bandwidth, and listen"
        )


def _show(
    found: edge_ident.Identification, results: options.ResultOptions, done: Done, *, details: bool
) -> None:
    then = _NEXT if results.output is None else ""
    results.answer(
        lambda: report.identification.identification_answer(
            found, done, details=details, without_findings=then
        )
    )


# The life of a board's gains: show, diff, stage, commit, rollback, store, restore.

GainsFile = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="Backup of gains, or the file that edge-ident gains FILE --output gains.json wrote.",
    ),
]


@dataclass(frozen=True)
class ForecastOptions:
    """Options that say from what margins and tracking are predicted.

    Attributes
    ----------
    recording : FILE
        Recording of the drive, from which margins and tracking error are predicted.
    """

    model: Setting[Path | None] = None
    recording: Path | None = None

    def predict(self, board: "Board", banks: Sequence["Bank"]) -> "Forecasts":
        """Predict margins and tracking; nothing where neither model nor recording is given."""
        if self.model is None and self.recording is None:
            return ()
        motion = None if self.recording is None else edge_ident.load_recording(self.recording)
        known = options.model_for(self.model, board.axes)
        forecaster = commissioning.promise.Forecaster(board.identity, board.limits(), known, motion)
        return forecaster.forecast(banks)

    def predict_stable(self, board: "Board", banks: Sequence["Bank"]) -> "Forecasts":
        """Predict, and refuse new gains that cannot work."""
        forecasts = self.predict(board, banks)
        for of_new in forecasts[1:]:
            commissioning.promise.check_stable(of_new)
        return forecasts


@dataclass(frozen=True)
class ChangeOptions:
    """What surrounds a change of gains.

    Attributes
    ----------
    large_steps
        Allow feedback gains to change by more than a factor of five at once.
    """

    backups: Setting[Path] = Path("edge-ident-gains")
    large_steps: bool = False


@command
def show(
    *, where: options.BoardOptions, forecast: ForecastOptions, results: options.ResultOptions
) -> None:
    """Show the active and the staged gains of a board.

    With --model or --recording, the margins and the tracking error are predicted. With --output,
    the gains are also written to board_gains.json.

    Example: `edge-ident gains show --device /dev/ttyACM0 --model model.json`
    """
    with connected(where) as (board, _):
        active, status = board.active_gains(), board.status()
        staged = board.staged_gains() if status.staged_crc_ok else None
        banks = [active] if staged is None else [active, staged]
        found = report.gains.GainReport(
            board.identity.serial_number,
            active,
            staged,
            forecast.predict(board, banks),
            unconfirmed_s=status.confirm_remaining_s if status.unconfirmed else None,
        )
    _deliver(found, results)


@command
def diff(
    *,
    file: GainsFile,
    where: options.BoardOptions,
    forecast: ForecastOptions,
    results: options.ResultOptions,
) -> None:
    """Compare the gains of a file with the active gains; nothing is written to the board.

    With --output, the comparison is also written to board_gains.json.

    Example: `edge-ident gains diff gains.json --device /dev/ttyACM0 --recording capture.npz`
    """
    loaded = commissioning.gain_transfer.load_gains(file)
    with connected(where) as (board, _):
        active = board.active_gains()
        wanted = commissioning.gain_change.wanted_gains(active, loaded)
        predicted = forecast.predict(board, [active, wanted])
        found = report.gains.GainReport(board.identity.serial_number, active, wanted, predicted)
    _deliver(found, results)


@command
def stage(
    *,
    file: GainsFile,
    where: options.BoardOptions,
    forecast: ForecastOptions,
    change: ChangeOptions,
    results: options.ResultOptions,
) -> None:
    """Check the gains of a file and write them to the board without activating them.

    The active gains are backed up first, and the new ones are read back. With --output, the result
    is also written to board_gains.json.

    Example: `edge-ident gains stage gains.json --device /dev/ttyACM0 --model model.json`
    """
    loaded = commissioning.gain_transfer.load_gains(file)
    with connected(where) as (board, _):
        active = commissioning.gain_change.settled_gains(board)
        wanted = commissioning.gain_change.wanted_gains(active, loaded)
        predicted = _checked(board, active, wanted, forecast, change)
        backup = commissioning.gain_transfer.back_up(active, board.identity, change.backups)
        commissioning.gain_transfer.stage_gains(board, wanted)
        number = board.identity.serial_number
        if loaded.serial_number not in (None, number):
            say(f"these are the gains of board {loaded.serial_number}, and this is board {number}")
        found = report.gains.GainReport(number, active, wanted, predicted, backup)
    _deliver(found, results, "the gains are staged, and not active")
    device = located(where).device
    if not _ends_with_the_command(device):
        say(f"staged and read back; activate them with: edge-ident gains commit --device {device}")


@command
def commit(
    *,
    where: options.BoardOptions,
    forecast: ForecastOptions,
    change: ChangeOptions,
    results: options.ResultOptions,
) -> None:
    """Activate the staged gains; they are kept if two motions follow as well as forecast.

    The machine does two motions with the old gains and, if the forecast of the tracking error is at
    least 5 % better, again with the new ones. Otherwise nothing is activated. With --output, the
    result is also written to board_gains.json.

    Example: `edge-ident gains commit --device /dev/ttyACM0`
    """
    said = list[str]()
    with noting(said):
        with connected(where) as (board, drive):
            commissioning.safety.make_ready(board)
            active = board.active_gains()
            staged = commissioning.gain_transfer.staged_whole(board, active)
            predicted = _checked(board, active, staged, forecast, change)
            backup = commissioning.gain_transfer.back_up(active, board.identity, change.backups)
            with shown_progress() as bars:
                known = options.given_model(forecast.model)
                done = commissioning.gain_change.commit_staged(board, drive, staged, bars, known)
                said += _in_force(done)
            number = board.identity.serial_number
            found = report.gains.GainReport(number, active, staged, predicted, backup, done)
        _deliver(found, results)
    if not (done.confirmed or done.unchanged):
        raise typer.Exit(UNTRUSTED)


@command
def rollback(*, where: options.BoardOptions, results: options.ResultOptions) -> None:
    """Return to the previous gains while the new ones are not confirmed.

    To return to older gains, use restore. With --output, the result is also written to
    board_gains.json.

    Example: `edge-ident gains rollback --device /dev/ttyACM0`
    """
    said = list[str]()
    with noting(said):
        with connected(where) as (board, _):
            commissioning.gain_change.roll_back_unconfirmed(board)
            said.append("the previous gains are in force")
            found = report.gains.GainReport(board.identity.serial_number, board.active_gains())
        _deliver(found, results)


@command
def store(
    *,
    where: options.BoardOptions,
    backups: Setting[Path] = Path("edge-ident-gains"),
    results: options.ResultOptions,
) -> None:
    """Write the active gains to the permanent memory of the board.

    They are then active after the next power-up. With --output, the result is also written to
    board_gains.json.

    Example: `edge-ident gains store --device /dev/ttyACM0`
    """
    said = list[str]()
    with noting(said):
        with connected(where) as (board, _):
            active = commissioning.gain_change.settled_gains(board)
            backup = commissioning.gain_transfer.back_up(active, board.identity, backups)
            board.store()
            said.append("the gains are stored")
            found = report.gains.GainReport(board.identity.serial_number, active, backup=backup)
        _deliver(found, results)
    say("the gains are stored")
    _ends_with_the_command(located(where).device)


@command
def restore(
    *,
    file: GainsFile,
    where: options.BoardOptions,
    forecast: ForecastOptions,
    change: ChangeOptions,
    results: options.ResultOptions,
) -> None:
    """Stage the gains of a backup and activate them; they are kept if a motion ends without fault.

    The machine moves once, with the restored gains. With --output, the result is also written to
    board_gains.json.

    Example: `edge-ident gains restore edge-ident-gains/board-1-….json --device /dev/ttyACM0`
    """
    loaded, said = commissioning.gain_transfer.load_gains(file), list[str]()
    with noting(said):
        with connected(where) as (board, drive):
            commissioning.gain_change.check_owner(board, loaded)
            commissioning.safety.make_ready(board)
            active = board.active_gains()
            wanted = commissioning.gain_change.wanted_gains(active, loaded)
            predicted = _checked(board, active, wanted, forecast, change)
            backup = commissioning.gain_transfer.back_up(active, board.identity, change.backups)
            with shown_progress() as bars:
                done = commissioning.gain_change.restore_gains(board, drive, wanted, bars)
                said += _in_force(done)
            number = board.identity.serial_number
            found = report.gains.GainReport(number, active, wanted, predicted, backup, done)
        _deliver(found, results)


def _checked(
    board: "Board", active: "Bank", wanted: "Bank", forecast: ForecastOptions, change: ChangeOptions
) -> "Forecasts":
    """Check gains before they are staged or committed; what is predicted of them."""
    unchecked = commissioning.gain_change.check_change(board, active, wanted, change.large_steps)
    predicted = forecast.predict_stable(board, [active, wanted])
    if unchecked and not predicted:
        say(
            f"feedback of axis {listed(unchecked)}: not checked, for the board states no inertia; "
            "--model or --recording have this computer check it"
        )
    return predicted


def _ends_with_the_command(device: str) -> bool:
    """Say of a virtual board, if this is one, that it keeps nothing."""
    virtual = device == "virtual"
    if virtual:
        say("this virtual board ends with the command; keep one with: edge-ident board --pty")
    return virtual


def _in_force(done: "commissioning.verification.GainChange") -> list[str]:
    """What to note where the command ends before it tells its result."""
    return ["new gains are in force, and confirmed"] if done.confirmed else []


def _deliver(found: "report.gains.GainReport", results: options.ResultOptions, *done: str) -> None:
    with noting(done):
        results.deliver(report.gains.gain_report_document(found), "board_gains.json")
        results.show(report.gains.gain_report_view(found))

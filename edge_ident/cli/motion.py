"""Commands that move a machine: run, capture, profile, home, stop, clear-fault."""

from pathlib import Path
from typing import Annotated, Any

import typer

from edge_ident.cli.common import (
    UNTRUSTED,
    BaudRate,
    Device,
    DriveFile,
    Json,
    ModelFile,
    NetworkFile,
    Output,
    Precision,
    Seed,
    built_in_or_given_network,
    deliver,
    given_model,
    guarded,
    leave_model,
    say,
    shown_progress,
)
from edge_ident.cli.sessions import connected, located, session

Cycles = Annotated[
    int | None,
    typer.Option("--cycles", min=1, envvar="EDGE_IDENT_CYCLES", help="Periods of the motion."),
]
Motion = Annotated[
    str,
    typer.Option("--motion", envvar="EDGE_IDENT_MOTION", help="sinusoid, multisine or staircase."),
]


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(run)
    app.command()(capture)
    app.command()(profile)
    app.command()(home)
    app.command()(stop)
    app.command("clear-fault")(clear_fault)


@guarded
def run(
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    motion: Motion = "sinusoid",
    cycles: Cycles = None,
    bandwidth: Annotated[
        float | None,
        typer.Option(
            "--bandwidth", min=0.1, envvar="EDGE_IDENT_BANDWIDTH", help="Closed loop, rad/s."
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Do everything but write gains.")
    ] = False,
    store: Annotated[
        bool, typer.Option("--store", help="Keep confirmed gains over a power cycle.")
    ] = False,
    network: NetworkFile = None,
    precision: Precision = "fp32",
    model: ModelFile = None,
    seed: Seed = 0,
    output: Output = None,
    json: Json = False,
) -> None:
    """Move, identify, design gains, write them with read-back, verify, confirm or roll back.

    Example: `edge-ident run --device /dev/ttyACM0 --dry-run`
    """
    from edge_ident.commissioning.run import CAPTURE_FILE, Plan, commission
    from edge_ident.report import outcome_view, run_document, show

    known = given_model(model)
    plan = Plan(_motion(motion), cycles, bandwidth, not dry_run, store, seed, known)
    with session(device, baud_rate, drive, output) as opened:
        loaded = built_in_or_given_network(network, precision)
        with shown_progress() as observer:
            outcome = commission(opened.board, opened.drive, loaded, plan, opened.folder, observer)
    document = run_document(outcome, opened.board.identity, loaded, opened.folder)
    deliver(document, "report.json", opened.folder, json)
    leave_model(outcome.identification, opened.folder / CAPTURE_FILE, known, opened.folder)
    if not json:
        show(outcome_view(outcome))
        say(f"written: {opened.folder}")
    if not outcome.trusted:
        raise typer.Exit(UNTRUSTED)


@guarded
def capture(
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    motion: Motion = "sinusoid",
    cycles: Cycles = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Move and record; identify nothing, write nothing.

    Example: `edge-ident capture --device virtual --motion multisine --output captures/a`
    """
    from edge_ident.commissioning.capture import capture_motion, check_drive
    from edge_ident.commissioning.run import CAPTURE_FILE
    from edge_ident.commissioning.safety import ready_to_move
    from edge_ident.drive.motions import named_trajectory
    from edge_ident.signals.data_checks import check_recording

    chosen = _motion(motion)
    with session(device, baud_rate, drive, output) as opened:
        board, path = opened.board, opened.folder / CAPTURE_FILE
        check_drive(board, opened.drive)
        trajectory = named_trajectory(opened.drive, chosen, cycles)
        with shown_progress() as observer, ready_to_move(board, observer.say):
            observer.stage(chosen)
            found = capture_motion(board, trajectory, observer.samples, path, observer.say)
            board.finish()
    check_recording(found.recording)
    document = {
        "schema": "edge-ident/capture/1",
        "file": str(path),
        "samples": len(found.recording.time_s),
        "pages": found.pages,
        "tail_s": found.tail_s,
        "tracking_rms_rad": found.tracking_rms_rad,
    }
    deliver(document, "capture.json", opened.folder, json)
    if not json:
        print(path)


@guarded
def profile(
    device: Device = None,
    baud_rate: BaudRate = None,
    repetitions: Annotated[
        int, typer.Option("--repetitions", min=1, help="Of every measurement.")
    ] = 100,
    output: Output = None,
    json: Json = False,
) -> None:
    """Time every stage from the last captured sample to gains committed and verified.

    Without a device, a virtual board is started in a process of its own, on a pseudo-terminal.

    Example: `edge-ident profile --repetitions 200 --json`
    """
    from edge_ident.commissioning.profiling import profile_device
    from edge_ident.report import profile_document, profile_view, show

    with shown_progress() as observer:
        profiled = profile_device(device, baud_rate, repetitions, observer)
    document = profile_document(profiled)
    deliver(document, "profile.json", output, json)
    if not json:
        show(profile_view(profiled))


@guarded
def home(
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    to: Annotated[
        list[str] | None,
        typer.Option("--to", metavar="AXIS=RAD", help="Only this axis; repeat it for another."),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option("--speed", help="Largest on the way, rad/s; default a fifth of the limit."),
    ] = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Move the axes slowly to position zero, or those named to where --to says.

    It does not look for a reference mark: an axis that is not homed counts from where it stood
    when the board was switched on.

    Example: `edge-ident home --to x=1.5 --to z=-0.5 --device /dev/ttyACM0`
    """
    from dataclasses import asdict

    from edge_ident.commissioning.homing import move_to

    named = _targets(to or [])
    with connected(device, baud_rate, drive) as (board, _), shown_progress() as observer:
        targets = named or dict.fromkeys(board.axes, 0.0)
        done = move_to(board, targets, observer, speed)
    document = {
        "schema": "edge-ident/home/1",
        "axes": {axis: asdict(way) for axis, way in done.ways.items()},
        "time_s": done.time_s,
    }
    deliver(document, "home.json", output, json)
    for axis, way in done.ways.items() if not json else []:
        print(f"{axis}: {way.from_rad:.4f} → {way.reached_rad:.4f} rad")


def _targets(texts: list[str]) -> dict[str, float]:
    targets = {}
    for text in texts:
        axis, _, number = text.partition("=")
        try:
            targets[axis] = float(number)
        except ValueError:
            raise typer.BadParameter(f"{text}: write AXIS=RAD", param_hint="--to") from None
    return targets


@guarded
def stop(
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Bring the machine to rest; unconfirmed gains are rolled back. Not an emergency stop.

    Also where another command of this user holds the port: that one is ended as by Ctrl-C.

    Example: `edge-ident stop --device /dev/ttyACM0`
    """
    from edge_ident.commissioning.stopping import stop_machine

    _, url, rate = located(device, baud_rate, drive)
    _report_state(stop_machine(url, rate, say), output, json)


@guarded
def clear_fault(
    device: Device = None,
    baud_rate: BaudRate = None,
    drive: DriveFile = None,
    output: Output = None,
    json: Json = False,
) -> None:
    """Leave a latched fault once its cause is gone and the machine is at rest.

    Example: `edge-ident clear-fault --device /dev/ttyACM0`
    """
    with connected(device, baud_rate, drive) as (board, _):
        say(f"fault: {board.status().fault.name}")
        board.clear_fault()
        _report_state(board.status(), output, json)


def _report_state(status: Any, output: Path | None, json: bool) -> None:
    state = status.state.name
    document = {"schema": "edge-ident/state/1", "state": state, "enabled": status.enabled}
    deliver(document, "state.json", output, json)
    if not json:
        print(state)


def _motion(name: str) -> Any:
    from edge_ident.drive.motions import MOTIONS

    if name not in MOTIONS:
        raise typer.BadParameter(f"choose one of {', '.join(MOTIONS)}", param_hint="--motion")
    return name

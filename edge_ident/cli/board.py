"""Commands without a machine: a recording of a model, a virtual board, or its drive alone."""

import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli import options
from edge_ident.cli.command import command
from edge_ident.cli.file_options import FileOptions
from edge_ident.cli.messages import print_document, say, shown_progress
from edge_ident.cli.options import Setting
from edge_ident.cli.settings import board_setting
from edge_ident.support.words import plain_number

# The command board: a virtual board to connect to.


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(board)
    app.command()(simulate)
    app.command()(plant)


@command
def board(
    *,
    pty: bool = False,
    link: Path | None = None,
    tcp: Annotated[int | None, typer.Option(min=0, max=65535)] = None,
    bind: str = "127.0.0.1",
    speed: Setting[str] = "1",
    faults: options.HideOptions,
    fail: list[str] | None = None,
    press_stop: bool = False,
    results: options.ResultOptions,
) -> None:
    """Run a virtual board with a flexible feed drive until Ctrl-C.

    The board keeps its gains, faults and positions from one command to the next. Modbus has no
    authentication: anyone who can connect to the port controls the board. Only this computer can
    connect unless --bind gives another address. With --output, the name of the device is also
    written to board.json. What --hide or --hide-seed hides in the drive is not printed; the same
    options with --reveal print it and start no board. A failure of --fail is printed when it
    happens. --press-stop presses and releases the wired emergency stop of the board that runs at
    --link, or at the device of EDGE_IDENT_DEVICE.

    Example: `edge-ident board --pty --speed 10`

    Example: `edge-ident board --tcp 5020 --fail encoder_lost=x@motion+2s`

    Parameters
    ----------
    pty
        Offer the board at a pseudo-terminal, like a serial port.
    link : PATH
        Path of a link to the pseudo-terminal, so that the device name stays the same.
    tcp : PORT
        Offer the board over Modbus TCP at this port.
    bind : ADDRESS
        Network address of this computer for --tcp.
    speed : FACTOR
        Speed of time in the board: a factor of real time, or max for as fast as possible. If it is
        not 1, doctor says that the board's clock is wrong.
    fail : NAME[=AXIS][@TIME]
        Make something fail, such as encoder_lost=x@3s (after the board's start) or sto@motion+1s
        (after that of the first motion); may be repeated. An unknown name lists all failures.
    press_stop
        Press and release the emergency stop of the board that runs with --link.
    """
    if press_stop:
        named = os.environ.get("EDGE_IDENT_DEVICE") or board_setting("device") or "./board"
        _press_stop(link or Path(named))
        return
    hidden, failures = faults.hidden(), _parse_failures(fail or [])
    if faults.reveal:
        faults.tell_alone("board", {"device": None}, hidden, results)
        return
    _check_way(pty, tcp, link)

    def ready(device: str) -> None:
        if link is not None:
            device = links.enter_context(_linked(link, device))
        document = {"schema": "edge-ident/board/1", "device": device}
        results.deliver(document, "board.json", device)
        say(f"ready; connect with: edge-ident run --device {device}   (Ctrl-C to end)")

    if tcp is not None:
        say("Modbus has no authentication: anyone who can connect to this port controls the board")
    with ExitStack() as links:
        commissioning.server.serve(
            pty=pty, tcp_port=tcp, bind=bind, speed=_parse_speed(speed), on_ready=ready,
            plant=hidden.plant() if hidden else None,
            identifier=commissioning.ports.VirtualNetwork(stays=True),
            failures=failures, on_failure=say,
        )  # fmt: skip


def _check_way(pty: bool, tcp: int | None, link: Path | None) -> None:
    if pty == (tcp is not None):
        raise typer.BadParameter("give either --pty or --tcp PORT")
    if link is not None and not pty:
        raise typer.BadParameter("a link leads to a pseudo-terminal: give --pty, too")


@contextmanager
def _linked(link: Path, device: str) -> Iterator[str]:
    """Point a link at a device while the body runs; that of a board which was killed gives way.

    Raises
    ------
    FileExistsError
        There is a file, or the link of a board that runs.
    """
    process = _process_file(link)
    # a new pseudo-terminal may get the number of the old one: then the old link leads to it
    if link.is_symlink() and not (link.exists() and _runs(process)):
        link.unlink()
    try:
        link.symlink_to(device)
    except FileExistsError as error:
        error.add_note(f"{link} is in use: stop the board that made it, or give another --link")
        raise
    process.write_text(f"{os.getpid()}\n")
    try:
        yield str(link.absolute())
    finally:
        link.unlink(missing_ok=True)
        process.unlink(missing_ok=True)


def _process_file(link: Path) -> Path:
    """Where a board that has a link leaves the number of its process."""
    return link.with_name(f"{link.name}.pid")


def _runs(process: Path) -> bool:
    """Whether the board that left its number still runs."""
    try:
        return commissioning.ports.is_running(int(process.read_text()))
    except (OSError, ValueError):
        return False


def _press_stop(link: Path) -> None:
    """Press the wired stop of a board that runs, and let go of it; the board latches it.

    Raises
    ------
    LinkError
        No board runs behind the link.
    """
    try:
        process = int(_process_file(link).read_text())
        for number in (signal.SIGUSR1, signal.SIGUSR2):
            os.kill(process, number)
    except (OSError, ValueError) as error:
        raise edge_ident.LinkError(
            f"no board runs at {link}", "start one with edge-ident board --pty --link ./board"
        ) from error
    say(f"the emergency stop at {link} was pressed and released; the board is in FAULT")


def _parse_failures(texts: list[str]) -> list["commissioning.server.Failure"]:
    try:
        return [commissioning.server.Failure.parse(text) for text in texts]
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--fail") from error


def _parse_speed(text: str) -> float | None:
    """Parse a factor of real time; None stands for max."""
    if text == "max":
        return None
    try:
        speed = plain_number(text)
    except ValueError:
        speed = 0.0
    if not 0.01 <= speed <= 100.0:
        raise typer.BadParameter("give a number from 0.01 to 100, or max", param_hint="--speed")
    return speed


# The command plant: the virtual drive alone, for firmware that runs elsewhere.


@command
def plant(
    *, socket: Path | None = None, faults: options.HideOptions, results: options.ResultOptions
) -> None:
    """Serve the virtual drive without a board, for firmware to control, until Ctrl-C.

    The reference firmware connects to it with its option --plant PATH. Every connection gets a new
    drive at rest. With --output, the path is also written to plant.json. With --reveal, what the
    same options hide is printed, and no drive is served.

    Example: `edge-ident plant --socket ./drive --hide backlash`

    Parameters
    ----------
    socket : PATH
        Unix socket to serve the drive at; it is created.
    """
    hidden = faults.hidden(of_machine=True)
    if faults.reveal:
        faults.tell_alone("plant", {"socket": None}, hidden, results)
        return
    if socket is None:
        raise typer.BadParameter("give --socket PATH")

    def ready(path: str) -> None:
        results.deliver({"schema": "edge-ident/plant/1", "socket": path}, "plant.json", path)
        say(f"ready; start the firmware with: --plant {path}   (Ctrl-C to end)")

    known = hidden or commissioning.hiding.Hidden((), ())
    commissioning.plant_socket.serve_plant(socket, known.plant, ready)


# The command simulate: from a model to a recording.


_NAMED_MOTIONS: Final[dict[str, options.MotionName]] = {
    "sinusoid": "sinusoid",
    "multisine": "multisine",
    "staircase": "staircase",
    "paper": "sinusoid",  # its first name here; scripts may still use it
}


@dataclass(frozen=True, kw_only=True)
class MotionOptions(FileOptions):
    """The motion that the drive follows.

    Attributes
    ----------
    motion : sinusoid|multisine|staircase|FILE
        Named motion, a motion that plan wrote (.json), or a recording: its motion is followed at
        its own sampling rate.
    """

    motion: Setting[str] = "sinusoid"
    cycles: options.SimulatedCycles = None

    def load(self) -> "options.MotionName | edge_ident.Recording | edge_ident.Trajectory":
        """Return the name of the motion, or what the file holds."""
        options.periods(self.context, _NAMED_MOTIONS.get(self.motion, self.motion), self.cycles)
        if self.motion in _NAMED_MOTIONS:
            return _NAMED_MOTIONS[self.motion]
        options.check_named(self.motion)
        path = Path(self.motion)
        return edge_ident.load_motion(path) if path.suffix == ".json" else self.read(path)


@dataclass(frozen=True)
class MeasurementOptions:
    """What lies between the drive and its recording.

    Attributes
    ----------
    noise : SHARE
        White noise of the effort, relative to the rms effort, such as 5% or 0.05.
    encoder_counts : NUMBER
        Encoder counts per turn or metre; 0 is exact; default: 8400 per turn or a million per metre.
    effort_resolution : NUMBER
        Effort of one count; 0 is exact; default: 0.004 N*m, exact in other units.
    """

    noise: Annotated[float, typer.Option(parser=options.share)] = 0.0
    encoder_counts: Annotated[float | None, typer.Option(min=0.0)] = None
    effort_resolution: Annotated[float | None, typer.Option(min=0.0)] = None
    seed: options.Seed = 0


@command
def simulate(
    *,
    output: Annotated[Path, options.RECORDING],
    model: Setting[str] = "full",
    motion: MotionOptions,
    measurement: MeasurementOptions,
    stiff: Annotated[bool, typer.Option("--stiff/--soft")] = False,
    json: bool = False,
) -> None:
    """Simulate a drive that follows a motion in closed loop, and write a recording of it.

    The recording is written to the file or folder given by --output. Its path is printed.

    Example: `edge-ident simulate --model model.json --motion multisine --noise 0.02 -o rec.csv`

    Parameters
    ----------
    model : FILE|full|reduced
        Model file, or the built-in drive: full has elastic parts, reduced is a rigid body.
    stiff
        stiff: gains designed for this drive; soft: weak start-up gains.
    """
    output = options.recording_file(output)
    followed, seed = motion.load(), measurement.seed
    drive = _model(model)
    if drive is not None and isinstance(followed, edge_ident.Recording):
        drive = options.for_axes(drive, followed.axes, model)
    with shown_progress() as bars:
        bars.stage(f"simulating {model}")
        recording = edge_ident.simulate(
            drive, followed, cycles=motion.cycles, noise=measurement.noise, stiff=stiff, seed=seed,
            encoder_counts=measurement.encoder_counts,
            effort_resolution=measurement.effort_resolution, on_progress=bars.samples,
        )  # fmt: skip
    edge_ident.save_recording(recording, output)
    left = {} if drive is None else edge_ident.outside_support(drive, recording)
    for name, findings in left.items():
        for finding in findings:
            say(f"warning: axis {name}: {finding.message}")
    if json:
        print_document(
            report.documents.simulation_document(
                recording, output, model, motion.motion, seed, left
            )
        )
    else:
        print(output)


def _model(name: str) -> "edge_ident.Model | None":
    """The built-in drive (None: with its elastic parts), or the model of a file."""
    if name == "full":
        return None
    return edge_ident.reduced_model() if name == "reduced" else edge_ident.load_model(name)

"""Options that several commands share, alone or in groups.

A group is a dataclass whose fields are options; `edge_ident.cli.command` turns a parameter of
that type into those options.

Parameters
----------
backups : FOLDER
    Folder for backups of the active gains.
bandwidth : NUMBER
    Frequency of the closed loop's poles, rad/s; default: the highest with sufficient margins.
baud_rate : NUMBER
    Baud rate of a serial port; default: 115200.
cycles : NUMBER
    Number of periods of a sinusoid or multisine; default: as in the drive description.
details
    Print all numbers and remarks below the answer; --json and the page have them, too.
device : DEVICE
    Board: a port such as /dev/ttyACM0, a pySerial URL, tcp://HOST:PORT, or virtual.
drive : FILE
    Drive description (.toml); default: the built-in drive.
json
    Print the result as one JSON document on stdout.
machine : NAME
    Name of the machine, for the heading of the page.
model : FILE
    Model file (.json) with known effects of the drive.
motion
    Motion that the axes make.
network : FILE
    Network (.onnx) with its manifest in the same folder; default: the built-in network.
no_diagnose
    Do not diagnose an axis whose base model is inadequate; the intervals are wider.
output : FOLDER|FILE
    Folder for the results; it is created if it does not exist. A command that writes a single file
    also takes the name of that file.
precision
    Precision of the built-in network; fastest: int8 only where this machine runs it clearly faster
    than fp32.
seed : NUMBER
    Random seed.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeVar, get_args

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli import settings
from edge_ident.cli.messages import print_result, say
from edge_ident.support.documents import write_json
from edge_ident.support.words import plain_number

if TYPE_CHECKING:
    from firmware_interface.plant.hiding import Hidden


_ByAxis = TypeVar("_ByAxis", "edge_ident.Model", "edge_ident.Drive")
_OF_FILES: Final = (".json", ".html", ".md", ".npz", ".csv", ".png", ".svg")
_SUFFIXES: Final = (".csv", ".npz")
_IN_FOLDER: Final = "recording.npz"
# What a run writes first and last, and no other command.
_OF_A_RUN: Final = ("gains_before.json", "report.json")


def named(path: str) -> Path:
    """A path of an option, which is empty where it was an unset variable of the shell."""
    if not str(path).strip():
        raise typer.BadParameter("the name is empty")
    return Path(path)


def result_folder(path: str) -> Path:
    """A folder for results, or the file of a command that writes one; neither need exist."""
    if named(path).is_file() and Path(path).suffix not in _OF_FILES:
        raise typer.BadParameter(f"{path} is a file; give a folder")
    return Path(path)


def setting(*flags: str, **more: Any) -> Any:
    """An option that a variable of the environment gives, too, and the settings file."""
    return typer.Option(*flags, envvar=settings.PREFIX, **more)


_T = TypeVar("_T")
Setting = Annotated[_T, setting()]
"""The same of a type that typer knows."""
Seed = Annotated[int, setting(min=0)]
BaudRate = Annotated[int | None, setting(min=50)]
Bandwidth = Annotated[float | None, setting(min=0.1)]
RECORDING: Final = setting(
    "-o",
    metavar="FOLDER|FILE",
    help=f"Folder to write {_IN_FOLDER} to, or a file that ends in .csv or .npz.",
    parser=named,
)
"""Where a recording goes."""


@dataclass(frozen=True)
class NetworkOptions:
    """The network that estimates beside least squares."""

    network: Setting[Path | None] = None
    precision: Setting[Literal["fp32", "int8", "fastest"]] = "fastest"

    def load(self) -> "edge_ident.Network":
        """Load the built-in network, or another one."""
        return edge_ident.load_network(self.precision, self.network)


@dataclass(frozen=True)
class BoardOptions:
    """Which board, and which drive hangs on it."""

    device: Setting[str | None] = None
    baud_rate: BaudRate = None
    drive: Setting[Path | None] = None


@dataclass(frozen=True)
class ResultOptions:
    """Where results go: a folder, stdout as JSON, or stdout as text."""

    output: Annotated[Path | None, setting("-o", parser=result_folder)] = None
    json: bool = False

    def file(self, name: str) -> Path | None:
        """The one file to write: as it was named, or by this name in the folder."""
        return None if self.output is None else result_file(self.output, name)

    def folder(self) -> Path | None:
        """The folder for several files.

        Raises
        ------
        BadParameter
            A file is named.
        """
        if self.output is not None:
            check_folder(self.output)
        return self.output

    def deliver(self, document: dict[str, Any], name: str, *lines: object) -> None:
        """Write a document, if it is to be kept, and print it, if JSON is wanted, else lines."""
        deliver(document, name, self.output, *lines, as_json=self.json)

    def show(self, result: Any) -> None:
        """Print a result for a person, unless JSON is wanted."""
        self.answer(lambda: result)

    def answer(self, view: Callable[[], Any]) -> None:
        """Print what a view makes, for a person; where JSON is wanted, it is not made."""
        if not self.json:
            report.render.show(view())


def result_file(output: Path, name: str) -> Path:
    """Where the file of this name goes: the path itself where it names a file of that kind."""
    named = output.suffix == Path(name).suffix and not output.is_dir()
    return output if named else output / name


def check_folder(output: Path) -> None:
    """Make sure that a path for several files names no single one.

    Raises
    ------
    BadParameter
    """
    if output.suffix in _OF_FILES and not output.is_dir():
        raise typer.BadParameter(
            f"{output} names one file, and several are written: give a folder",
            param_hint="--output",
        )


def check_no_run(folder: Path | None) -> None:
    """Make sure that a folder for results is not that of a run, whose page and model are kept.

    Raises
    ------
    DataError
    """
    if folder is not None:
        check_folder(folder)
    if folder and any((folder / name).exists() for name in _OF_A_RUN):
        raise edge_ident.DataError(
            f"{folder} is the folder of a run, whose page or model would be lost",
            "choose another folder with --output",
        )


def deliver(
    document: dict[str, Any], name: str, output: Path | None, *lines: object, as_json: bool
) -> None:
    """Write a document into a folder, if there is one; print it as JSON, or lines."""
    if output:
        write_json(document, result_file(output, name))
    print_result(document, *lines, as_json=as_json)


def given_model(path: Path | None) -> "edge_ident.Model | None":
    """Load the model that an option names."""
    return None if path is None else edge_ident.load_model(path)


def model_for(path: Path | None, axes: Iterable[str]) -> "edge_ident.Model | None":
    """Load the model that an option names, for these axes; say which it takes for which."""
    given = given_model(path)
    return None if given is None else for_axes(given, axes, path)


def drive_for(path: Path | None, axes: Iterable[str]) -> "edge_ident.Drive":
    """Load a drive description for these axes; say which axis it takes for which."""
    described = edge_ident.load_drive(path)
    return for_axes(described, axes, described.name)


def for_axes(given: _ByAxis, axes: Iterable[str], of: object) -> _ByAxis:
    """A model or drive for these axes; say which axis it takes for which."""
    fitted = given.for_axes(axes)
    for name, axis in zip(given.axes, fitted.axes, strict=True):
        if name != axis:
            say(f"axis {axis} is taken for axis {name} of {of}, the only one there")
    return fitted


def save_result_model(
    model: "edge_ident.Model",
    files: Sequence[Path],
    folder: Path,
    known: "edge_ident.Model | None" = None,
) -> Path:
    """Write the model of a result beside its document, with the recordings that it is made from."""
    path = folder / "model.json"
    edge_ident.save_model(edge_ident.sourced_model(model, files, known), path)
    return path


def recording_file(output: Path) -> Path:
    """The file to write, in the folder that was named or by its own name."""
    if output.is_dir() or not output.suffix:
        return output / _IN_FOLDER
    if output.suffix not in _SUFFIXES:
        raise typer.BadParameter(
            f"{output} is neither a folder nor a file that ends in {' or '.join(_SUFFIXES)}",
            param_hint="--output",
        )
    return output


# Options of a motion that the axes make, or a simulated drive.

MOST_CYCLES: Final = 1000
"""Periods of a motion, as in a drive description: hours of the slowest ones."""
_PERIODIC: Final = ("sinusoid", "multisine")
MotionName = Literal["sinusoid", "multisine", "staircase"]
MOTIONS: Final[tuple[str, ...]] = get_args(MotionName)
Cycles = Annotated[int | None, setting(min=1, max=MOST_CYCLES)]
SimulatedCycles = Annotated[int | None, typer.Option(min=1, max=MOST_CYCLES)]
"""Periods of a simulated motion, which no setting of the machine changes."""


def check_named(motion: str) -> None:
    """Refuse a motion that is neither a name nor the path of a file.

    Raises
    ------
    typer.BadParameter
    """
    if motion not in MOTIONS and not Path(motion).suffix and not Path(motion).exists():
        raise typer.BadParameter(
            f"there is neither a motion nor a file {motion}; write {', '.join(MOTIONS)}, or the "
            "path of a file",
            param_hint="--motion",
        )


def periods(context: typer.Context, motion: str, cycles: int | None) -> int | None:
    """Number of periods of a motion; None where it has none, or its own.

    Raises
    ------
    typer.BadParameter
        The command line gives a number for a motion that has none; as a setting it counts for
        others.
    """
    if motion in _PERIODIC:
        return cycles
    source = context.get_parameter_source("cycles")
    if cycles is not None and source is not None and source.name == "COMMANDLINE":
        raise typer.BadParameter(f"{motion} has no periods", param_hint="--cycles")
    return None


# Shares as a person writes them: 0.05, or 5%.


def share(given: str | float) -> float:
    """A share from a number such as 0.05 or a percentage such as 5%.

    Parameters
    ----------
    given : str or float
        As it stands on the command line, in the environment or in the settings file.

    Raises
    ------
    typer.BadParameter
        If it is neither, or negative.
    """
    text = str(given).strip()
    try:
        found = plain_number(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        found = math.nan
    if not 0.0 <= found < math.inf:
        raise typer.BadParameter(f"{text!r} is no share: write 5% or 0.05")
    return found


def part(given: str | float) -> float:
    """A share of at most all of something; otherwise as `share`."""
    found = share(given)
    if found > 1.0:
        raise typer.BadParameter(f"{str(given)!r} is more than 100%: write 5% or 0.05")
    return found


def true_part(given: str | float) -> float:
    """A share of something, neither nothing nor all of it; otherwise as `share`."""
    found = share(given)
    if not 0.0 < found < 1.0:
        raise typer.BadParameter(f"{str(given)!r} is not between 0% and 100%: write 5% or 0.05")
    return found


# Options that hide faults in the drive behind a virtual board, and tell afterwards which.


@dataclass(frozen=True)
class HideOptions:
    """What is wrong with the drive behind a virtual board.

    Attributes
    ----------
    hide : NAME[=SIZE]
        Hide a fault in the virtual drive, such as backlash=0.01; may be repeated. An unknown name,
        as in --hide list, lists all faults.
    axis
        Axis that has the faults; default: x, or a random one with --hide-seed.
    hide_seed : NUMBER
        Hide one or two random faults; the same number hides the same ones. With --hide: choose only
        the details at random.
    used : NUMBER
        Use a random used machine as the virtual drive: a dozen things are slightly wrong on it. The
        same number gives the same machine.
    wear : LEVEL
        Wear of the machine of --used: 0 like new, 1 used, 2 worn; default: 1.
    friction
        Make the machine of --used like new, simulated by another program with this friction model.
    reveal
        Print at the end what these options have hidden.
    """

    hide: list[str] | None = None
    axis: Literal["x", "z"] | None = None
    hide_seed: Annotated[int | None, typer.Option(min=0)] = None
    used: Annotated[int | None, typer.Option(min=0)] = None
    wear: Annotated[float | None, typer.Option(min=0.0, max=3.0)] = None
    friction: Literal["lugre", "dahl"] | None = None
    reveal: bool = False

    def hidden(self, *, of_machine: bool = False) -> "Hidden | None":
        """What is to be hidden, in the machine alone where the board is another; None: nothing."""
        if self.used is not None:
            return self._used(self.used)
        for missing, option in ((self.wear, "--wear"), (self.friction, "--friction")):
            if missing is not None:
                raise typer.BadParameter("give --used, too", param_hint=option)
        if not self.hide and self.hide_seed is None:
            for given, option in ((self.axis, "--axis"), (self.reveal, "--reveal")):
                if given:
                    raise typer.BadParameter(
                        "nothing is hidden: give --hide, --hide-seed or --used, too",
                        param_hint=option,
                    )
            return None
        if not self.hide:
            return commissioning.hiding.Hidden.drawn(
                self.hide_seed or 0, self.axis, of_machine=of_machine
            )
        try:
            return commissioning.hiding.Hidden.of(
                self.hide, self.axis or "x", self.hide_seed or 0, of_machine=of_machine
            )
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--hide") from error

    def _used(self, seed: int) -> "Hidden":
        """The machine of this number."""
        if self.hide or self.hide_seed is not None or self.axis:
            raise typer.BadParameter(
                "faults are hidden in the documented drive: give either these or --used",
                param_hint="--used",
            )
        if self.friction is None:
            return commissioning.hiding.Hidden.used(seed, 1.0 if self.wear is None else self.wear)
        if self.wear is not None:
            raise typer.BadParameter("with --friction the machine is clean", param_hint="--wear")
        return commissioning.hiding.Hidden.rubbing(seed, self.friction)

    def add_to(self, document: dict[str, Any], hidden: "Hidden | None") -> None:
        """Put the truth into a document, if it is asked for."""
        if self.reveal and hidden:
            document["hidden"] = report.machine.fault_documents(hidden.faults)

    def tell_alone(
        self,
        command: str,
        document: dict[str, Any],
        hidden: "Hidden | None",
        results: ResultOptions,
    ) -> None:
        """Print the truth of a command that would serve something, and serve nothing."""
        document = {"schema": f"edge-ident/{command}/1", **document}
        self.add_to(document, hidden)
        results.deliver(document, f"{command}.json")
        if not results.json:
            self.tell(hidden)

    def tell(self, hidden: "Hidden | None") -> None:
        """Print the truth, if it is asked for."""
        if self.reveal and hidden:
            for line in report.machine.fault_lines(hidden.faults):
                print(line, flush=True)

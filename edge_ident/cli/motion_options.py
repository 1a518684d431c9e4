"""Options of a motion that the axes make, or a simulated drive."""

from pathlib import Path
from typing import Annotated, Any, Final, Literal, get_args

import typer

MOST_CYCLES: Final = 1000
"""Periods of a motion, as in a drive description: hours of the slowest ones."""
_PERIODIC: Final = ("sinusoid", "multisine")
MotionName = Annotated[
    Literal["sinusoid", "multisine", "staircase"],
    typer.Option("--motion", envvar="EDGE_IDENT_MOTION", help="Motion that the axes make."),
]
MOTIONS: Final[tuple[str, ...]] = get_args(get_args(MotionName)[0])


def _cycles_option(variable: str | None = None) -> Any:
    return typer.Option(
        "--cycles",
        min=1,
        max=MOST_CYCLES,
        metavar="NUMBER",
        envvar=variable,
        help="Number of periods of a sinusoid or multisine; default: as in the drive description.",
    )


Cycles = Annotated[int | None, _cycles_option("EDGE_IDENT_CYCLES")]
SimulatedCycles = Annotated[int | None, _cycles_option()]
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

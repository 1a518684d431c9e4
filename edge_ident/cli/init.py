"""The command init: a drive description from what data sheets say."""

import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Final

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli.command import command
from edge_ident.cli.data_sheet_answers import (
    GivenTexts,
    OptionAnswers,
    TerminalAnswers,
    on_terminal,
)
from edge_ident.cli.messages import print_document, say
from edge_ident.cli.options import Json

_FILE: Final = Path("drive.toml")
_AXES: Final = ("x", "z")
"""Names of the axes, unless an option gives others: those of a board."""
_Texts = list[str] | None


def _sheet_option(name: str, unit: str, help_text: str) -> object:
    return typer.Option(name, metavar=f"[AXIS=]{unit}", help=help_text)


@dataclass(frozen=True, kw_only=True)
class SheetOptions:
    """What data sheets say of the axes; each field is named as its entry of the data sheet."""

    kind: Annotated[
        _Texts, _sheet_option("--kind", "KIND", "linear or rotary; default: linear.")
    ] = None
    lead: Annotated[
        _Texts,
        _sheet_option(
            "--lead", "MM", "Travel of the table per turn of the screw (lead), such as 5mm."
        ),
    ] = None
    gear_ratio: Annotated[
        _Texts,
        _sheet_option("--gear-ratio", "NUMBER", "Turns of the motor per turn of the screw."),
    ] = None
    encoder_at: Annotated[
        _Texts,
        _sheet_option(
            "--encoder-at",
            "PLACE",
            "Place of the encoder: motor, output (of the gearbox) or table.",
        ),
    ] = None
    encoder: Annotated[
        _Texts,
        _sheet_option(
            "--encoder",
            "COUNTS",
            "Encoder counts per turn (4 per line), such as 8400, '2100 lines' or '17 "
            "bit'. For a linear scale: length of one count, such as 0.5um.",
        ),
    ] = None
    torque_constant: Annotated[
        _Texts, _sheet_option("--torque-constant", "NM/A", "Torque constant of the motor.")
    ] = None
    torque: Annotated[
        _Texts,
        _sheet_option(
            "--torque",
            "NM",
            "Rated torque of the motor, or its rated current, such as 3A. It becomes the "
            "effort limit: give less if gearbox or screw withstand less.",
        ),
    ] = None
    travel: Annotated[
        _Texts, _sheet_option("--travel", "MM", "Travel from end to end, such as 300mm or 90deg.")
    ] = None
    speed: Annotated[
        _Texts,
        _sheet_option(
            "--speed", "RPM", "Top speed of the motor in rpm, or of the axis, such as 200mm/s."
        ),
    ] = None
    acceleration: Annotated[
        _Texts,
        _sheet_option(
            "--acceleration",
            "M/S2",
            "Largest acceleration of the axis, if known; a rotary axis: in rad/s2.",
        ),
    ] = None
    rotor_inertia: Annotated[
        _Texts,
        _sheet_option("--rotor-inertia", "KGCM2", "Inertia of the rotor of the motor, if known."),
    ] = None
    load: Annotated[
        _Texts,
        _sheet_option(
            "--load", "KG", "Moving mass, if known. For a rotary axis: inertia, such as 0.2kgm2."
        ),
    ] = None
    friction: Annotated[
        _Texts,
        _sheet_option(
            "--friction",
            "NM",
            "Friction torque at the motor, or friction force of the guides, such as 40N; if known.",
        ),
    ] = None

    def texts(self) -> dict[str, list[str]]:
        """What was given, by the name of the entry."""
        return {field.name: getattr(self, field.name) or [] for field in fields(self)}


_Name = Annotated[
    str | None,
    typer.Option(
        "--name", metavar="TEXT", help="Name of the drive; default: the name of the file."
    ),
]
_AxisNames = Annotated[
    list[str] | None,
    typer.Option(
        "--axis",
        metavar="NAME",
        help="Name of an axis; may be repeated. Default: the axes that AXIS= names, else x and z.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(init)


@command
def init(
    *,
    file: Annotated[
        Path, typer.Argument(metavar="[FILE]", help="Drive description (.toml) to write.")
    ] = _FILE,
    name: _Name = None,
    axis: _AxisNames = None,
    sample_rate: Annotated[
        str | None,
        typer.Option(
            "--sample-rate",
            metavar="HZ",
            help="Sampling rate of the board in Hz, or its sampling period, such as 2.5ms.",
        ),
    ] = None,
    sheet: SheetOptions,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a file that exists already.")
    ] = False,
    accept_implausible: Annotated[
        bool, typer.Option("--accept-implausible", help="Accept values that are unusual.")
    ] = False,
    json: Json = False,
) -> None:
    """Write a drive description from the data sheets of motor, encoder and axis.

    On a terminal, the command asks for every value that no option gives. It shows each value in SI
    units, and asks again if the value is unusual for a feed drive. A number may have a unit, as in
    5mm; AXIS= before it sets one axis only, as in x=300mm. The file is written at the end, when all
    values are known. Its path is printed.

    Example: `edge-ident init press.toml --lead 5mm --travel x=300mm --travel z=200mm`
    """
    if file.exists() and not overwrite:
        raise edge_ident.DataError(
            f"{file} exists already", "give another name, or replace it with --overwrite"
        )
    texts = sheet.texts()
    given = GivenTexts(_axis_names(axis or _named_in(texts)), sample_rate, texts)
    answers = (TerminalAnswers if on_terminal() else OptionAnswers)(
        given, accept=accept_implausible
    )
    made = answers.described(name or file.stem)
    commissioning.write_drive(made.drive, file, made.origins, made.assumed)
    say(f"use it with --drive {file}, or always: edge-ident config set drive {file.resolve()}")
    if json:
        print_document(report.drive_document(made, file))
    else:
        print(file)


def _named_in(texts: dict[str, list[str]]) -> list[str] | None:
    """The axes that options name before an equals sign, where all options name the same.

    An option that also has a text for all axes does not say which axes there are.
    """
    sets = [[text.partition("=")[0] for text in of] for of in texts.values() if _all_named(of)]
    alike = bool(sets) and all(set(names) == set(sets[0]) for names in sets)
    return list(dict.fromkeys(sets[0])) if alike and not set(sets[0]) <= set(_AXES) else None


def _all_named(texts: list[str]) -> bool:
    return bool(texts) and all("=" in text for text in texts)


def _axis_names(given: list[str] | None) -> tuple[str, ...]:
    names = tuple(given or _AXES)
    for name in names:
        if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) or names.count(name) > 1:
            raise typer.BadParameter(
                f"{name!r}: write each axis once, with letters, digits and _", param_hint="--axis"
            )
    return names

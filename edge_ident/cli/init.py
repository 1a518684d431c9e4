"""The command init: a drive description from what data sheets say."""

import re
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Generic, TypeVar

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli.command import command
from edge_ident.cli.messages import print_result, say, say_always
from edge_ident.errors import DataError

if TYPE_CHECKING:
    from edge_ident.commissioning.data_sheet import AxisSheet, Entry
    from edge_ident.commissioning.described_drive import DescribedDrive


_FILE: Final = Path("drive.toml")
_AXES: Final = ("x", "z")  # names of the axes, unless an option gives others: those of a board
_Texts = list[str] | None


@dataclass(frozen=True, kw_only=True)
class SheetOptions:
    """What data sheets say of the axes; each field is named as its entry of the data sheet.

    Attributes
    ----------
    kind : [AXIS=]KIND
        linear or rotary; default: linear.
    lead : [AXIS=]MM
        Travel of the table per turn of the screw (lead), such as 5mm.
    gear_ratio : [AXIS=]NUMBER
        Turns of the motor per turn of the screw.
    encoder_at : [AXIS=]PLACE
        Place of the encoder: motor, output (of the gearbox) or table.
    encoder : [AXIS=]COUNTS
        Encoder counts per turn (4 per line), such as 8400, '2100 lines' or '17 bit'. For a linear
        scale: length of one count, such as 0.5um.
    torque_constant : [AXIS=]NM/A
        Torque constant of the motor.
    torque : [AXIS=]NM
        Rated torque of the motor, or its rated current, such as 3A. It becomes the effort limit:
        give less if gearbox or screw withstand less.
    travel : [AXIS=]MM
        Travel from end to end, such as 300mm or 90deg.
    speed : [AXIS=]RPM
        Top speed of the motor in rpm, or of the axis, such as 200mm/s.
    acceleration : [AXIS=]M/S2
        Largest acceleration of the axis, if known; a rotary axis: in rad/s2.
    rotor_inertia : [AXIS=]KGCM2
        Inertia of the rotor of the motor, if known.
    load : [AXIS=]KG
        Moving mass, if known. For a rotary axis: inertia, such as 0.2kgm2.
    friction : [AXIS=]NM
        Friction torque at the motor, or friction force of the guides, such as 40N; if known.
    """

    kind: _Texts = None
    lead: _Texts = None
    gear_ratio: _Texts = None
    encoder_at: _Texts = None
    encoder: _Texts = None
    torque_constant: _Texts = None
    torque: _Texts = None
    travel: _Texts = None
    speed: _Texts = None
    acceleration: _Texts = None
    rotor_inertia: _Texts = None
    load: _Texts = None
    friction: _Texts = None

    def texts(self) -> dict[str, list[str]]:
        """What was given, by the name of the entry."""
        return {field.name: getattr(self, field.name) or [] for field in fields(self)}


def register(app: typer.Typer) -> None:
    """Add this file's command."""
    app.command()(init)


@command
def init(
    *,
    file: Annotated[Path, typer.Argument()] = _FILE,
    name: str | None = None,
    axis: list[str] | None = None,
    sample_rate: str | None = None,
    sheet: SheetOptions,
    overwrite: bool = False,
    accept_implausible: bool = False,
    json: bool = False,
) -> None:
    """Write a drive description from the data sheets of motor, encoder and axis.

    On a terminal, the command asks for every value that no option gives. It shows each value in SI
    units, and asks again if the value is unusual for a feed drive. A number may have a unit, as in
    5mm; AXIS= before it sets one axis only, as in x=300mm. The file is written at the end, when all
    values are known. Its path is printed.

    Example: `edge-ident init press.toml --lead 5mm --travel x=300mm --travel z=200mm`

    Parameters
    ----------
    file : [FILE]
        Drive description (.toml) to write.
    name : TEXT
        Name of the drive; default: the name of the file.
    axis : NAME
        Name of an axis; may be repeated. Default: the axes that AXIS= names, else x and z.
    sample_rate : HZ
        Sampling rate of the board in Hz, or its sampling period, such as 2.5ms.
    overwrite
        Replace a file that exists already.
    accept_implausible
        Accept values that are unusual.
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
    commissioning.description.write_drive(made.drive, file, made.origins, made.assumed)
    say(f"use it with --drive {file}, or always: edge-ident config set drive {file.resolve()}")
    print_result(report.machine.drive_document(made, file), file, as_json=json)


def _named_in(texts: dict[str, list[str]]) -> list[str] | None:
    """The axes that options name before an equals sign, where all options name the same.

    An option that also has a text for all axes does not say which axes there are.
    """
    sets = [
        [text.partition("=")[0] for text in of]
        for of in texts.values()
        if of and all("=" in text for text in of)
    ]
    alike = bool(sets) and all(set(names) == set(sets[0]) for names in sets)
    return list(dict.fromkeys(sets[0])) if alike and not set(sets[0]) <= set(_AXES) else None


def _axis_names(given: list[str] | None) -> tuple[str, ...]:
    names = tuple(given or _AXES)
    for name in names:
        if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) or names.count(name) > 1:
            raise typer.BadParameter(
                f"{name!r}: write each axis once, with letters, digits and _", param_hint="--axis"
            )
    return names


# Where answers about data sheets come from: options alone, or a person on a terminal as well.

T = TypeVar("T")
_SAMPLE_RATE: Final = "sample_rate"


def on_terminal() -> bool:
    """Whether a person can be asked; questions go to stderr."""
    return sys.stdin.isatty() and sys.stderr.isatty()


@dataclass(frozen=True)
class _Matter(Generic[T]):
    """One thing to find out.

    Attributes
    ----------
    what : str
        What an error is about.
    question : str
        What a person is asked.
    given : str or None
        The text of an option.
    default : str or None
        Taken where nothing is said; None where something must be.
    read : callable
        Raises DataError.
    doubts : callable
        What to ask about a value.
    shown : callable
        An answer, and what it is in SI units.
    """

    what: str
    question: str
    given: str | None
    default: str | None
    read: Callable[[str], T]
    doubts: Callable[[T], list[str]]
    shown: Callable[[T], str]


@dataclass(frozen=True)
class GivenTexts:
    """The options.

    Attributes
    ----------
    axes : tuple of str
    sample_rate : str or None
    sheet : mapping of entry name to texts
        A text may begin with the name of the axis that it is about, and an equals sign.
    """

    axes: tuple[str, ...]
    sample_rate: str | None
    sheet: Mapping[str, Sequence[str]]

    def of(self, axis: str, entry: str) -> str | None:
        """What is given for an axis: by its name, else for all axes; the last one counts."""
        named, general = None, None
        for text in self.sheet[entry]:
            before, sign, after = text.partition("=")
            if not sign:
                general = text
            elif before == axis:
                named = after
            elif before not in self.axes:
                raise typer.BadParameter(
                    f"there is no axis {before}, but {', '.join(self.axes)}; --axis names the axes",
                    param_hint=option_of(entry),
                )
        return general if named is None else named

    def names(self, axis: str) -> bool:
        """Whether something is given for this axis alone."""
        return any(text.startswith(f"{axis}=") for texts in self.sheet.values() for text in texts)

    def missing(self) -> list[str]:
        """Options without which no description can be made."""
        lacking = [] if self.sample_rate else [option_of(_SAMPLE_RATE)]
        for axis in self.axes:
            sheet = commissioning.data_sheet.AxisSheet(kind=self.of(axis, "kind") or "linear")
            for entry in commissioning.data_sheet.SHEET_ENTRIES:
                asked = entry.default is None and entry.question_for(sheet) is not None
                if asked and self.of(axis, entry.name) is None:
                    lacking.append(option_of(entry.name))
        return list(dict.fromkeys(lacking))


def option_of(entry: str) -> str:
    """The option of an entry."""
    return "--" + entry.replace("_", "-")


class Answers(ABC):
    """Fills in the data sheets of all axes, entry by entry."""

    def __init__(self, given: GivenTexts, *, accept: bool) -> None:
        self._given = given
        self._accept = accept

    def described(self, name: str) -> "DescribedDrive":
        """The drive that the answers describe.

        Raises
        ------
        DataError
            An answer cannot be used.
        """
        period_s = self._settled(
            _Matter(
                "sample rate", "Sample rate of the board, in Hz", self._given.sample_rate, None,
                commissioning.described_drive.sampling_period_s,
                commissioning.data_sheet.period_doubts,
                lambda value: f"{1.0 / value:.6g} Hz = {value:.6g} s",
            )
        )  # fmt: skip
        sheets: dict[str, AxisSheet] = {}
        for axis in self._given.axes:
            sheets[axis] = self._alike(axis, sheets) or self._filled(axis)
        made = commissioning.described_drive.describe_drive(name, period_s, sheets)
        for line in made.assumed:
            say(f"assumed: {line}")
        return made

    def _filled(self, axis: str) -> "AxisSheet":
        sheet = commissioning.data_sheet.AxisSheet()
        for entry in commissioning.data_sheet.SHEET_ENTRIES:
            question = entry.question_for(sheet)
            if question is not None:
                sheet = self._settled(self._matter(axis, sheet, entry, question))
            elif self._given.of(axis, entry.name) is not None:
                say(f"axis {axis} is {sheet.kind}: {option_of(entry.name)} does not count for it")
        return sheet

    def _matter(
        self, axis: str, sheet: "AxisSheet", entry: "Entry", question: str
    ) -> "_Matter[AxisSheet]":
        return _Matter(
            f"axis {axis}, {entry.name.replace('_', ' ')}",
            question,
            self._given.of(axis, entry.name),
            entry.default,
            lambda text: commissioning.data_sheet.fill_sheet(sheet, entry, text),
            lambda value: commissioning.data_sheet.sheet_doubts(value, entry),
            lambda value: commissioning.data_sheet.sheet_in_si(value, entry),
        )

    @abstractmethod
    def _settled(self, matter: _Matter[T]) -> T:
        """Find out one thing."""

    def _alike(self, axis: str, sheets: "Mapping[str, AxisSheet]") -> "AxisSheet | None":
        """The sheet of an axis that this one is known to be like."""
        return None


class OptionAnswers(Answers):
    """Options alone: what they lack ends the command, and so does what is implausible."""

    def __init__(self, given: GivenTexts, *, accept: bool) -> None:
        super().__init__(given, accept=accept)
        self._doubts: list[str] = []
        if missing := given.missing():
            raise typer.BadParameter(
                f"without a terminal to ask on, these are needed: {', '.join(missing)}",
                param_hint=missing[0],
            )

    def _settled(self, matter: _Matter[T]) -> T:
        text = matter.default if matter.given is None else matter.given
        try:
            value = matter.read(text or "")
        except DataError as error:
            raise DataError(f"{matter.what}: {error.cause}", error.next_step) from error
        if text:
            say(f"{matter.what}: {matter.shown(value)}")
        self._doubts += [f"{matter.what}: {doubt}" for doubt in matter.doubts(value)]
        return value

    def described(self, name: str) -> "DescribedDrive":
        """As `Answers.described`; implausible answers are a DataError, unless accepted."""
        made = super().described(name)
        if self._doubts and not self._accept:
            raise DataError(
                f"implausible: {'; '.join(self._doubts)}",
                "correct it, or accept it with --accept-implausible",
            )
        return made


class TerminalAnswers(Answers):
    """Options, and questions about what they lack; a bad or doubtful answer is asked again."""

    def __init__(self, given: GivenTexts, *, accept: bool) -> None:
        super().__init__(given, accept=accept)
        # every command loads this file, and one asks
        from edge_ident.support.console import VisibleConsole

        self._console = VisibleConsole(stderr=True)

    def _settled(self, matter: _Matter[T]) -> T:
        given = matter.given
        while True:
            text = self._answer(matter) if given is None else given
            try:
                value = matter.read(text)
            except DataError as error:
                say_always(f"{matter.what}: {error.cause}; {error.next_step}")
            else:
                say(f"{matter.what}: {matter.shown(value)}")
                if all(self._certain(doubt) for doubt in matter.doubts(value)):
                    return value
            given = None

    def _answer(self, matter: _Matter[T]) -> str:
        hint = {None: "", "": " (Enter: not known)"}.get(matter.default, f" ({matter.default})")
        text = self._line(f"{matter.question}{hint}: ")
        return text or matter.default or ""

    def _alike(self, axis: str, sheets: "Mapping[str, AxisSheet]") -> "AxisSheet | None":
        if sheets and not self._given.names(axis):
            last, sheet = list(sheets.items())[-1]
            if self._yes(f"Is axis {axis} like axis {last}?"):
                return sheet
        say_always(f"Axis {axis}:")
        return None

    def _certain(self, doubt: str) -> bool:
        if self._accept:
            return True
        say_always(f"  {doubt}")
        return self._yes("  Keep this answer?")

    def _yes(self, question: str) -> bool:
        return self._line(f"{question} y or n (n): ").lower() in ("y", "yes")

    def _line(self, prompt: str) -> str:
        from rich.text import Text

        try:
            return self._console.input(Text(prompt)).strip()
        except EOFError:  # Ctrl-D
            raise KeyboardInterrupt from None

"""Where answers about data sheets come from: options alone, or a person on a terminal as well."""

import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Generic, TypeVar

import typer

from edge_ident import commissioning
from edge_ident.cli.messages import say, say_always
from edge_ident.errors import DataError

if TYPE_CHECKING:
    from edge_ident.commissioning import AxisSheet, DescribedDrive, Entry

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
            sheet = commissioning.AxisSheet(kind=self.of(axis, "kind") or "linear")
            for entry in commissioning.SHEET_ENTRIES:
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
                commissioning.sampling_period_s, commissioning.period_doubts,
                lambda value: f"{1.0 / value:.6g} Hz = {value:.6g} s",
            )
        )  # fmt: skip
        sheets: dict[str, AxisSheet] = {}
        for axis in self._given.axes:
            sheets[axis] = self._alike(axis, sheets) or self._filled(axis)
        made = commissioning.describe_drive(name, period_s, sheets)
        for line in made.assumed:
            say(f"assumed: {line}")
        return made

    def _filled(self, axis: str) -> "AxisSheet":
        sheet = commissioning.AxisSheet()
        for entry in commissioning.SHEET_ENTRIES:
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
            lambda text: commissioning.fill_sheet(sheet, entry, text),
            lambda value: commissioning.sheet_doubts(value, entry),
            lambda value: commissioning.sheet_in_si(value, entry),
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

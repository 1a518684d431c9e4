"""What typer does not do by itself: help in whole sentences, and numbers as they are written."""

import copy
import inspect
import re
from functools import partial
from typing import Any

from typer.core import TyperGroup


class CommandGroup(TyperGroup):
    """A group that lists its commands with the whole first sentence of their help."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands; a line that is too long continues on the next."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for name, command in self.commands.items():
            if not command.hidden:
                said = " ".join((command.help or "").split("\n\n")[0].split())
                title = getattr(command, "rich_help_panel", None)
                title = title if isinstance(title, str) else "Commands"
                groups.setdefault(title, []).append((name, said))
        for title, rows in groups.items():
            with formatter.section(title):
                formatter.write_dl(rows)


def with_example(text: str) -> str:
    """A help text without marks, whose example is a line of its own."""
    text = re.sub(r"^Example: `(.+)`", "\b\nExample:\n  \\1", inspect.cleandoc(text), flags=re.M)
    return text.replace("`", "")


def take_plain_numbers(command: Any) -> None:
    """Make every option of a command, and of those below it, refuse underscores in numbers."""
    for parameter in command.params:
        kind = parameter.type
        if kind.name.startswith(("float", "int")):
            parameter.type = copy.copy(kind)  # options without a range share theirs
            parameter.type.convert = partial(_converted, kind)
    for below in getattr(command, "commands", {}).values():
        take_plain_numbers(below)


def _converted(kind: Any, value: Any, parameter: Any, context: Any) -> Any:
    if "_" in str(value):
        kind.fail(f"{value!r} is not a valid {kind.name}.", parameter, context)
    return kind.convert(value, parameter, context)

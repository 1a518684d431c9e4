"""How help is laid out: whole sentences for every command, and examples that can be copied."""

import inspect
import re
from typing import Any

from typer.core import TyperGroup


class CommandGroup(TyperGroup):
    """A group that lists its commands with the whole first sentence of their help."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands; a line that is too long continues on the next."""
        rows = [
            (name, " ".join((command.help or "").split("\n\n")[0].split()))
            for name, command in self.commands.items()
            if not command.hidden
        ]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


def with_example(text: str) -> str:
    """A help text without marks, whose example is a line of its own."""
    text = re.sub(r"^Example: `(.+)`", "\b\nExample:\n  \\1", inspect.cleandoc(text), flags=re.M)
    return text.replace("`", "")

"""Results that a terminal and a notebook show as tables."""

from io import StringIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

_WIDTH = 100
"""Characters of a line of text; tables are as wide as they need."""
_HTML = '<pre style="white-space:pre;line-height:normal">{code}</pre>'


class Readable:
    """What has `__rich__` also gets text and HTML from it.

    rich is loaded when something is shown, and not before.
    """

    def __rich__(self) -> "RenderableType":
        """The result as rich shows it."""
        raise NotImplementedError

    def __str__(self) -> str:
        lines = self._printed().export_text().splitlines()
        return "\n".join(line.rstrip() for line in lines).rstrip()

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return self._printed().export_html(code_format=_HTML, inline_styles=True)

    def _printed(self) -> "Console":
        from edge_ident.support.console import VisibleConsole

        console = VisibleConsole(StringIO(), width=_WIDTH, record=True)
        console.print(self)
        return console

"""The console that results are drawn on: names are escaped before they are laid out."""

import sys
from collections.abc import Iterable
from typing import IO, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from edge_ident.support.streams import raw
from edge_ident.support.visible_text import visible


class VisibleConsole(Console):
    """A console on which names from files are text, and nothing but what it draws itself acts.

    A word between colons is no emoji.

    Parameters
    ----------
    file : file, optional
        Default: standard output, with `stderr` that for messages.
    stderr : bool
    **more
        As rich has them.
    """

    def __init__(self, file: IO[str] | None = None, *, stderr: bool = False, **more: Any) -> None:
        where = file or raw(sys.stderr if stderr else sys.stdout)
        super().__init__(file=where, emoji=False, highlight=False, **more)

    def render_str(self, text: str, **more: Any) -> Text:
        """Make text, which may have marks of style, of a string."""
        return super().render_str(visible(text), **more)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render anything; a text that would act on the terminal loses its styles."""
        if isinstance(renderable, Text) and (seen := visible(renderable.plain)) != renderable.plain:
            renderable = Text(seen, justify=renderable.justify, end=renderable.end)
        return super().render(renderable, options)

"""Where results go: the terminal, a JSON file, a picture."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rich.console import RenderableType
from rich.text import Text

from edge_ident.support.console import VisibleConsole
from edge_ident.support.documents import atomic_write

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_RESOLUTION_DPI: Final = 120


class _Console(VisibleConsole):
    """A console that leaves it to the command what a closed pipe means."""

    def on_broken_pipe(self) -> None:
        """Raise the error that is being handled, in the place of SystemExit."""
        raise


def show(result: RenderableType) -> None:
    """Print a result, or the view of one, on stdout; only for a terminal are lines broken."""
    console = _Console()
    if console.is_terminal:
        console.print(result, crop=False, overflow="fold")
    else:
        console.print(result, soft_wrap=True)


def save_figure(figure: "Figure", picture: Path) -> Path:
    """Write a figure, whole or not at all.

    Parameters
    ----------
    figure : Figure
    picture : Path
        A name that ends in .png, .svg or .pdf.

    Returns
    -------
    Path
        The picture.
    """
    with atomic_write(picture) as partial:
        figure.savefig(partial, dpi=_RESOLUTION_DPI)
    return picture


# Lines of an answer, by rich.


def labelled(label: str, said: str, style: str = "bold") -> Text:
    """A line of an answer: what it is about, and what is said of it."""
    return Text.assemble((label, style), f": {said}")


def next_lines(steps: Iterable[str]) -> Iterator[Text]:
    """What to do next, a line for each step."""
    yield from (labelled("next", step) for step in steps)

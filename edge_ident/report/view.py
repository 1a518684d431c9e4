"""The view of a result: what is to be shown of it. Terminal, notebook and data frame show that."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from edge_ident.support.rows import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Group, RenderableType


@dataclass(frozen=True)
class ResultView:
    """What is to be shown of a result, made when it is asked for.

    Attributes
    ----------
    columns : callable
        Gives the table that a data frame takes.
    parts : callable
        Gives what is printed, one below the other.
    drawn : callable
        Gives the figure.
    """

    columns: Callable[[], Table]
    parts: Callable[[], "Iterable[RenderableType]"]
    drawn: "Callable[[], Figure] | None" = None

    def table(self) -> Table:
        """For a data frame."""
        return self.columns()

    def shown(self) -> "Group":
        """For a terminal and a notebook."""
        from rich.console import Group

        return Group(*self.parts())

    def figure(self) -> "Figure":
        """Pictures."""
        if self.drawn is None:
            raise LookupError("there is no picture of this result")
        return self.drawn()

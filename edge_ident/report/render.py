"""The renderers of a view: by rich for a terminal, by matplotlib for a picture."""

import re
from collections.abc import Iterable, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from edge_ident.errors import DataError
from edge_ident.report.chart import Chart, Layer, Scale, axis_label
from edge_ident.report.view import Grid, Line, Part, Parts, Tone
from edge_ident.support.console import FittingTable, VisibleConsole, plain_table
from edge_ident.support.documents import atomic_write

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_RESOLUTION_DPI: Final = 120


class _Console(VisibleConsole):
    """A console that leaves it to the command what a closed pipe means."""

    def on_broken_pipe(self) -> None:
        """Raise the error that is being handled, in the place of SystemExit."""
        raise


def show(result: RenderableType | Parts) -> None:
    """Print a result, or what is shown of one, on stdout; only for a terminal are lines broken."""
    console = _Console()
    if isinstance(result, tuple):
        result = rendered(result)
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


# Lines and tables of a view, by rich.

_STYLES: Final[dict[Tone, str]] = {
    "": "",
    "strong": "bold",
    "good": "bold green",
    "doubt": "yellow",
    "bad": "bold red",
}
_NUMBER: Final = re.compile(r"(?:by up to |[-−+×/±] ?)?\d[^,]*")
"""What a cell is that stands at the right."""


def rendered(parts: Iterable[Part]) -> Group:
    """Lines and tables, one below the other."""
    return Group(*(_line(part) if isinstance(part, Line) else _table(part) for part in parts))


def _line(line: Line) -> Text:
    style = _STYLES[line.tone]
    if not line.label:
        return Text(line.said, style)
    return Text.assemble((line.label, style), f"{line.between}{line.said}")


def _table(grid: Grid) -> FittingTable:
    table = plain_table() if grid.plain else FittingTable()
    table.title, table.title_justify = escape(grid.caption) or None, "left"
    table.caption, table.caption_justify = escape(grid.note) or None, "left"
    for place, heading in enumerate(grid.headings):
        right = place > 0 and _numbers([str(row[place]) for row in grid.rows])
        table.add_column(escape(heading), justify="right" if right else "left")
    for row in grid.rows:
        table.add_row(*(_line(cell) if isinstance(cell, Line) else escape(cell) for cell in row))
    return table


def _numbers(cells: Sequence[str]) -> bool:
    """Whether most cells of a column that say something are numbers."""
    said = [cell for cell in cells if cell not in ("", "–")]
    return 2 * sum(bool(_NUMBER.fullmatch(cell)) for cell in said) > len(said)


# Charts as a matplotlib figure, for whoever wants them as a picture or changes them by hand.


_COLOURS: Final = {
    "measured": "0.7",
    "edge": "0.5",
    "base": "tab:orange",
    "extended": "tab:blue",
    "backward": "tab:red",
    "noise": "0.9",
}
_WIDTH_IN: Final = 6.0
_PIXELS_PER_IN: Final = 80


def drawn(charts: Sequence[Sequence[Chart]]) -> "Figure":
    """Draw rows of charts, each in the height that it has on a page.

    Raises
    ------
    DataError
        matplotlib is not installed.
    """
    heights = [max(chart.height for chart in row) / _PIXELS_PER_IN for row in charts]
    columns = max(map(len, charts))
    figure = _empty(_WIDTH_IN * min(columns, 2), sum(heights) + 0.5)
    panels = figure.subplots(len(charts), columns, squeeze=False, height_ratios=heights)
    for row, of_row in zip(panels, charts, strict=True):
        for panel, chart in zip(row, of_row, strict=False):
            _draw(panel, chart)
        for panel in row[len(of_row) :]:
            panel.set_axis_off()
    return figure


def _draw(panel: Any, chart: Chart) -> None:
    panel.set_title(chart.title, fontsize="medium")
    panel.set_xlabel(axis_label(*chart.across))
    panel.set_ylabel(axis_label(*chart.along))
    for name, scale in (("x", chart.x), ("y", chart.y)):
        _scale(panel, name, scale)
    for layer in chart.layers:
        _layer(panel, layer, {"color": _COLOURS.get(layer.style.split()[0]), "label": layer.label})
    if chart.legend:
        panel.legend(fontsize="small")


def _scale(panel: Any, name: str, scale: Scale) -> None:
    if scale.kind == "log":
        getattr(panel, f"set_{name}scale")("log")
    if scale.kind == "root":
        getattr(panel, f"set_{name}scale")("function", functions=(np.sqrt, np.square))
    getattr(panel, f"set_{name}lim")(scale.low, scale.high)
    if scale.names:
        getattr(panel, f"set_{name}ticks")(range(len(scale.names)), scale.names)


def _layer(panel: Any, layer: Layer, look: dict[str, Any]) -> None:
    if layer.kind == "band":
        panel.axhspan(layer.y[1], layer.y[0], zorder=0, **look)
    elif layer.kind == "bound":
        panel.axvline(layer.x[0], linestyle=":", **look)
    elif layer.kind == "area":
        panel.fill(layer.x, layer.y, **look)
    else:
        kinds = {"dots": "k,", "marks": "o-", "line": "-"}
        width = 4 if layer.style == "measured" else 1
        panel.plot(layer.x, layer.y, kinds[layer.kind], linewidth=width, markersize=4, **look)


def _empty(width_in: float, height_in: float) -> "Figure":
    """A figure that belongs to no window; a notebook shows it as it is."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise DataError(
            "drawing needs matplotlib", "install it with: pip install 'edge-ident[report]'"
        ) from error

    class ShownFigure(Figure):
        def _repr_png_(self) -> bytes:
            content = BytesIO()
            self.savefig(content, format="png")
            return content.getvalue()

    return ShownFigure(figsize=(width_in, height_in), layout="constrained")

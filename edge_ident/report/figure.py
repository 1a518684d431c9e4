"""Charts as a matplotlib figure, for whoever wants them as a picture or changes them by hand."""

from collections.abc import Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from edge_ident.errors import DataError
from edge_ident.report.chart import Chart, Layer, Scale, axis_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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

"""A chart as inline SVG that follows the page: its width, its colours, and any magnification.

Curves lie in a plot of fixed numbers that is stretched to the width of the page. Text, ticks and
marks stand beside it in percent, so they keep their size on a phone. Colours and line styles are
classes of the page's style sheet.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

from edge_ident.report.page.paths import HEIGHT, WIDTH, dots_path, envelope, line_path
from edge_ident.report.page.scale import Scale

Array = NDArray[np.float64]

_X_TICKS: Final = 5
_PIXELS_PER_TICK: Final = 36


@dataclass(frozen=True)
class Layer:
    """One thing that a chart shows.

    Attributes
    ----------
    kind : {"line", "dots", "marks", "band", "area", "bound"}
        `marks` is a line with a mark at each point; `band` is shaded between y[0] and y[1], `area`
        inside a closed line; `bound` is a vertical line at x[0].
    style : str
        Class of the style sheet.
    x, y : (N,) arrays
        In the units of the scales; a NaN in y breaks a line.
    label : str
        In the legend; empty for none.
    """

    kind: Literal["line", "dots", "marks", "band", "area", "bound"]
    style: str
    x: Array
    y: Array
    label: str = ""


@dataclass(frozen=True)
class Chart:
    """A picture with its legend and its text alternative.

    Attributes
    ----------
    key : str
        Unique in the page.
    title : str
        What is seen, in a few words.
    description : str
        What it shows, with numbers, for those who do not see it.
    across, along : (str, str)
        Name and unit of the horizontal and of the vertical quantity.
    x, y : Scale
    layers : tuple of Layer
        The first lies at the back.
    height : int
        Pixels.
    caption : str
        How to read it.
    """

    key: str
    title: str
    description: str
    across: tuple[str, str]
    along: tuple[str, str]
    x: Scale
    y: Scale
    layers: tuple[Layer, ...]
    height: int = 230
    caption: str = ""

    @property
    def legend(self) -> list[Layer]:
        """Layers that have a label."""
        return [layer for layer in self.layers if layer.label]

    def svg(self) -> Markup:
        """The picture; its style is that of the page."""
        parts = [self._grid(), self._plot(), *map(self._marks, self.layers), self._labels()]
        return Markup(
            '<svg class="chart" role="img" height="{height}" data-x="{low!r} {high!r}" '
            'aria-labelledby="{key}-t {key}-d"><title id="{key}-t">{title}</title>'
            '<desc id="{key}-d">{description}</desc>{inside}</svg>'
        ).format(
            height=self.height,
            low=self.x.low,
            high=self.x.high,
            key=self.key,
            title=self.title,
            description=self.description,
            inside=Markup("").join(parts),
        )

    def _grid(self) -> Markup:
        rows = [
            Markup(
                '<line x1="0" x2="100%" y1="{0}" y2="{0}"/><text x="0" y="{0}">{1}</text>'
            ).format(_percent(1.0 - place), text)
            for place, text in self.y.ticks(max(2, self.height // _PIXELS_PER_TICK))
        ]
        columns = [
            Markup(
                '<line x1="{0}" x2="{0}" y1="0" y2="100%"/><text x="{0}" y="100%">{1}</text>'
            ).format(_percent(place), text)
            for place, text in self.x.ticks(_X_TICKS)
        ]
        return Markup('<g class="y-ticks">{}</g><g class="x-ticks">{}</g>').format(
            Markup("").join(rows), Markup("").join(columns)
        )

    def _plot(self) -> Markup:
        return Markup(
            '<svg class="plot" width="100%" height="100%" viewBox="0 0 {} {}" '
            'preserveAspectRatio="none">{}</svg>'
        ).format(WIDTH, HEIGHT, Markup("").join(map(self._curve, self.layers)))

    def _curve(self, layer: Layer) -> Markup:
        y = self.y.fraction(layer.y)
        if layer.kind == "band":
            top, bottom = HEIGHT * (1.0 - np.clip(y, 0.0, 1.0))
            return Markup('<rect class="{}" y="{:.0f}" width="{}" height="{:.0f}"/>').format(
                layer.style, min(top, bottom), WIDTH, abs(bottom - top)
            )
        x = self.x.fraction(layer.x)
        if layer.kind == "bound":
            path = f"M{WIDTH * x[0]:.0f} 0v{HEIGHT}"
        elif layer.kind == "dots":
            path = dots_path(x, y)
        else:
            path = line_path(*envelope(x, y))
        return Markup('<path class="{} {}" d="{}"/>').format(layer.kind, layer.style, path)

    def _marks(self, layer: Layer) -> Markup:
        if layer.kind != "marks":
            return Markup("")
        places = zip(self.x.fraction(layer.x), self.y.fraction(layer.y), strict=True)
        sign = "▲" if layer.style == "forward" else "●"
        return Markup('<g class="mark {}">{}</g>').format(
            layer.style,
            Markup("").join(
                Markup('<text x="{}" y="{}">{}</text>').format(_percent(x), _percent(1.0 - y), sign)
                for x, y in places
                if 0.0 <= y <= 1.0
            ),
        )

    def _labels(self) -> Markup:
        return Markup(
            '<text class="x-label" x="100%" y="100%">{}</text><text class="y-label" x="0" y="0">{}'
            "</text>"
        ).format(_named(*self.across, self.x), _named(*self.along, self.y))


def _named(name: str, unit: str, scale: Scale) -> Markup:
    unit = scale.unit(unit)
    return escape(f"{name} ({unit})" if unit else name)


def _percent(place: float) -> str:
    return f"{100.0 * place:.4g}%"

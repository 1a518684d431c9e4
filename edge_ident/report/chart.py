"""A chart as inline SVG that follows the page: its width, its colours, and any magnification.

Curves lie in a plot of fixed numbers that is stretched to the width of the page. Text, ticks and
marks stand beside it in percent, so they keep their size on a phone. Colours and line styles are
classes of the page's style sheet.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.metrics import quantile

Array = NDArray[np.float64]


# Signals as paths of SVG: lines of few enough points, clouds of dots, means over bins.

WIDTH: Final = 20_000
HEIGHT: Final = 4_000
"""Whole numbers across a plot: fine enough to enlarge it, short to write."""
_BUCKETS: Final = 2500  # parts of a line; each gives its lowest and its highest sample
_DOTS: Final = 450
_BINS: Final = 40
PER_BIN: Final = 15
"""Samples over which noise is averaged."""


def envelope(x: Array, y: Array, buckets: int = _BUCKETS) -> tuple[Array, Array]:
    """Lowest and highest sample of each of so many buckets, in their order of time.

    What sticks out stays visible, which thinning would lose. A bucket without a finite value gives
    two NaN, which break the line. Short signals are returned as they are.
    """
    each = -(-len(y) // buckets)
    if each <= 2:
        return x, y
    missing = -len(y) % each
    padded = np.concatenate([y, np.full(missing, np.nan)]).reshape(-1, each)
    empty = np.all(np.isnan(padded), axis=1)
    low = np.argmin(np.where(np.isnan(padded), np.inf, padded), axis=1)
    high = np.argmax(np.where(np.isnan(padded), -np.inf, padded), axis=1)
    both = np.sort(np.stack([low, high], axis=1), axis=1)
    index = np.minimum((both + each * np.arange(len(padded))[:, None]).ravel(), len(y) - 1)
    return x[index], np.where(np.repeat(empty, 2), np.nan, y[index])


def line_path(x: Array, y: Array) -> str:
    """A path through points between 0 and 1; a NaN breaks it. The second axis points upwards."""
    across, down = _whole(x, y)
    written: list[str] = []
    at: tuple[int, int] | None = None
    for column, row, seen in zip(across, down, np.isfinite(y), strict=True):
        if not seen:
            at = None
            continue
        step = (column - at[0], row - at[1]) if at else (column, row)
        if step != (0, 0) or not at:
            written.append(f"{'l' if at else 'M'}{step[0]} {step[1]}")
        at = (column, row)
    return "".join(written).replace(" -", "-")


def dots_path(x: Array, y: Array, dots: int = _DOTS) -> str:
    """Points between 0 and 1 as strokes without length, thinned out evenly."""
    thin = slice(None, None, max(1, -(-len(x) // dots)))
    across, down = _whole(x[thin], y[thin])
    return "".join(f"M{column} {row}h0" for column, row in zip(across, down, strict=True))


def means(x: Array, y: Array, per_bin: int = PER_BIN) -> tuple[Array, Array]:
    """Means over bins of equal width, of so many samples on average; scarce ones are left out."""
    if not len(x):
        return x, y
    bins = int(np.clip(len(x) // per_bin, 1, _BINS))
    edges = np.linspace(np.min(x), np.max(x), bins + 1)
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    full = 3 * count >= per_bin
    found = [np.bincount(index, weights=of, minlength=bins)[full] / count[full] for of in (x, y)]
    return found[0], found[1]


def _whole(x: Array, y: Array) -> tuple[list[int], list[int]]:
    shown = np.clip(np.nan_to_num(y), -1.0, 2.0)
    across = np.rint(WIDTH * x).astype(int).tolist()
    return across, np.rint(HEIGHT * (1.0 - shown)).astype(int).tolist()


# Scales of a chart: where a value stands between both ends, and the ticks in between.


_STEPS: Final = (1.0, 2.0, 2.5, 5.0, 10.0)
_SUPERSCRIPTS: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN: Final = (1e-2, 1e5)  # largest values between these are written without a power of ten


@dataclass(frozen=True)
class Scale:
    """From `low` to `high`; `root` stretches what is near zero, as half of a logarithm would.

    Whole numbers from zero on may have `names` in the place of ticks.
    """

    low: float
    high: float
    kind: Literal["linear", "root", "log"] = "linear"
    names: tuple[str, ...] = ()

    def fraction(self, values: Array) -> Array:
        """Places between both ends, from 0 to 1; beyond them outside."""
        low, high, at = (
            self._on_paper(np.asarray(v, float)) for v in (self.low, self.high, values)
        )
        return np.asarray((at - low) / (high - low))

    def _on_paper(self, values: Array) -> Array:
        if self.kind == "root":
            return np.sqrt(np.maximum(values, 0.0))
        if self.kind == "log":
            return np.log10(np.maximum(values, 1e-300))
        return values

    @property
    def exponent(self) -> int:
        """Power of ten, a multiple of three, that the labels leave to the title of the scale."""
        largest = max(abs(self.low), abs(self.high))
        if self.kind == "log" or _PLAIN[0] <= largest < _PLAIN[1] or largest == 0.0:
            return 0
        return 3 * math.floor(math.log10(largest) / 3)

    def unit(self, unit: str) -> str:
        """The unit with that power of ten."""
        if not self.exponent:
            return unit
        return f"10{str(self.exponent).translate(_SUPERSCRIPTS)} {unit}"

    def ticks(self, count: int) -> list[tuple[float, str]]:
        """Places and labels of round values, about `count` of them."""
        if self.names:
            labels = {float(place): name for place, name in enumerate(self.names)}
        elif self.kind == "log":
            first, last = math.ceil(math.log10(self.low)), math.floor(math.log10(self.high))
            stride = max(1, math.ceil((last - first + 1) / count))
            tens = range(first, last + 1, stride)
            labels = {10.0**ten: f"10{str(ten).translate(_SUPERSCRIPTS)}" for ten in tens}
        else:
            labels = self._linear_ticks(count)
        return [(float(self.fraction(np.array(value))), text) for value, text in labels.items()]

    def _linear_ticks(self, count: int) -> dict[float, str]:
        unit = 10.0**self.exponent
        low, high = self.low / unit, self.high / unit
        rough = (high - low) / count
        ten = 10.0 ** math.floor(math.log10(rough))
        step = next(ten * factor for factor in _STEPS if ten * factor >= rough * (1.0 - 1e-9))
        decimals = next(d for d in range(15) if abs(step - round(step, d)) < 1e-9 * step)
        numbers = range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
        return {n * step * unit: f"{n * step:.{decimals}f}".replace("-", "−") for n in numbers}


def around(values: Array, margin: float = 0.06) -> Scale:
    """A scale that shows all finite values, with a margin."""
    finite = values[np.isfinite(values)]
    low, high = (float(np.min(finite)), float(np.max(finite))) if len(finite) else (0.0, 1.0)
    room = margin * (high - low) or 0.5 * abs(high) or 1.0
    return Scale(low - room, high + room)


def across(values: Array, kind: Literal["linear", "root", "log"] = "linear") -> Scale:
    """A scale from the lowest to the highest value, without a margin."""
    low, high = (float(np.min(values)), float(np.max(values))) if len(values) else (0.0, 1.0)
    return Scale(low, high if high > low else low + 1.0, kind)


def reach(values: Array) -> float:
    """Half the height of a chart that shows all but the farthest values."""
    finite = np.abs(values[np.isfinite(values)])
    return 1.3 * quantile(np.append(finite, 0.0), 0.995) or 1.0


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

    @property
    def ticks(self) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
        """Places and labels, from the left and from above."""
        up = self.y.ticks(max(2, self.height // _PIXELS_PER_TICK))
        return (
            [(_percent(place), text) for place, text in self.x.ticks(_X_TICKS)],
            [(_percent(1.0 - place), text) for place, text in up],
        )

    @property
    def labels(self) -> tuple[str, str]:
        """What the scales show, with their units."""
        (across, wide), (along, high) = self.across, self.along
        return axis_label(across, self.x.unit(wide)), axis_label(along, self.y.unit(high))

    def path(self, layer: Layer) -> str:
        """A layer that is no band as a path in the plot."""
        x, y = self.x.fraction(layer.x), self.y.fraction(layer.y)
        if layer.kind == "bound":
            return f"M{WIDTH * x[0]:.0f} 0v{HEIGHT}"
        return dots_path(x, y) if layer.kind == "dots" else line_path(*envelope(x, y))

    def band(self, layer: Layer) -> tuple[str, str]:
        """Where a band begins in the plot, from above, and its height."""
        ends = HEIGHT * (1.0 - np.clip(self.y.fraction(layer.y), 0.0, 1.0))
        return f"{np.min(ends):.0f}", f"{np.ptp(ends):.0f}"

    def marks(self, layer: Layer) -> list[tuple[str, str]]:
        """Places of the points of a layer that can be seen."""
        places = zip(self.x.fraction(layer.x), self.y.fraction(layer.y), strict=True)
        return [(_percent(x), _percent(1.0 - y)) for x, y in places if 0.0 <= y <= 1.0]


def axis_label(name: str, unit: str) -> str:
    """What a scale shows, with its unit."""
    return f"{name} ({unit})" if unit else name


def _percent(place: float) -> str:
    return f"{100.0 * place:.4g}%"


# Rows of charts, side by side for several axes.


def of_axes(columns: Mapping[str, Sequence[Chart]]) -> list[list[Chart]]:
    """Charts of axes, a column for each, as rows; their titles say which axis each is of."""
    named = (
        [replace(chart, title=f"axis {name}: {chart.title}".removesuffix(": ")) for chart in charts]
        for name, charts in columns.items()
    )
    return [list(row) for row in zip(*named, strict=True)]

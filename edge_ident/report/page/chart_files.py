"""A chart as an SVG file of its own, for documents that are no web pages."""

from pathlib import Path
from typing import Final

from markupsafe import Markup

from edge_ident.report.page.chart import Chart
from edge_ident.report.page.rendering import source
from edge_ident.support.documents import atomic_write
from edge_ident.support.words import visible

_WIDTH: Final = 900
_ABOVE, _BELOW, _LEFT, _RIGHT = 64, 44, 56, 16
_ALONE: Final = "svg.chart { width: 100%; margin: 0; }\n"
_LETTER: Final = 7
"""Mean width of a letter of the legend."""


def save_chart(chart: Chart, file: Path) -> None:
    """Write the chart with its title and legend; the style is that of the page."""
    width, height = _WIDTH - _LEFT - _RIGHT, chart.height + _ABOVE + _BELOW
    text = Markup(
        '<svg xmlns="http://www.w3.org/2000/svg" width="{all}" height="{height}">'
        "<style>{style}</style>"
        '<rect width="100%" height="100%" fill="var(--paper)"/>'
        '<g font-family="sans-serif" fill="var(--ink)">'
        '<text x="12" y="20" font-weight="bold" font-size="15">{title}</text>{legend}'
        '<svg x="{left}" y="{above}" width="{width}" overflow="visible">{chart}</svg></g></svg>'
    ).format(
        all=_WIDTH,
        height=height,
        style=Markup(source("style.css") + _ALONE),
        title=chart.title,
        legend=_legend(chart),
        left=_LEFT,
        above=_ABOVE,
        width=width,
        chart=chart.svg(),
    )
    with atomic_write(file) as partial:
        partial.write_text(visible(f"{text}\n"), encoding="utf-8")


def _legend(chart: Chart) -> Markup:
    parts, x = [], 12
    for layer in chart.legend:
        parts.append(
            Markup(
                '<svg class="plot" x="{0}" y="24" width="26" height="16"><path '
                'class="{1} {2}" d="M0 8h24"/></svg><text x="{3}" y="37" font-size="12">{4}</text>'
            ).format(x, layer.kind, layer.style, x + 32, layer.label)
        )
        x += 32 + _LETTER * len(layer.label) + 20
    return Markup("").join(parts)

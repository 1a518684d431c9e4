"""A diagnosis as one HTML page, and as Markdown with its pictures as SVG files."""

import re
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from markupsafe import Markup, escape

from edge_ident.diagnosis.result import Diagnosis
from edge_ident.report.chart import Chart
from edge_ident.report.diagnosis import axis_parts
from edge_ident.report.diagnosis_documents import diagnosis_document
from edge_ident.report.numbers import sentence
from edge_ident.report.page.axis_details import axis_details
from edge_ident.report.page.card import Card
from edge_ident.report.page.diagnosis_card import TOGETHER, diagnosis_card
from edge_ident.report.page.rendering import Provenance, source, write_html
from edge_ident.report.view import Grid, Line
from edge_ident.support.documents import NOT_TEXT, atomic_write
from edge_ident.support.words import listed, on_a_line, visible

# A diagnosis as one HTML page.


def write_page(
    diagnosis: Diagnosis, provenance: Provenance, folder: Path, model_file: Path | None = None
) -> Path:
    """Write the page.

    Parameters
    ----------
    diagnosis : Diagnosis
    provenance : Provenance
        With the recordings that it was made from.
    folder : Path
    model_file : Path or None
        Path of the extended model's file, if there is one.

    Returns
    -------
    Path
        The page.
    """
    names = listed(file for file, _ in provenance.files)
    says = "says" if len(provenance.files) == 1 else "say"
    content = {
        "title": f"What {names} {says} about the machine",
        "findings": _findings(diagnosis),
        "cards": [
            _named(diagnosis_card(f"c{n}", name, diagnosis), provenance)
            for n, name in enumerate(diagnosis.axes)
        ],
        "details": [
            axis_details(f"a{n}", name, diagnosis) for n, name in enumerate(diagnosis.axes)
        ],
        "provenance": provenance,
        "model_file": model_file,
    }
    document = diagnosis_document(diagnosis, model_file)
    return write_html("diagnosis.html.jinja", content, document, folder)


def _named(card: Card, provenance: Provenance) -> Card:
    """The card with the names of the recordings in its commands."""
    files = [*provenance.files, *([provenance.validation] if provenance.validation else [])]
    names = str(escape(shlex.join(name for name, _ in files)))
    action = [Markup(str(step).replace(TOGETHER, names)) for step in card.action]
    return replace(card, action=action)


def _findings(diagnosis: Diagnosis) -> list[tuple[str, list[str], str]]:
    """Message, axes and code of each defect of the data."""
    axes: dict[tuple[str, str], list[str]] = {}
    for finding in diagnosis.data_quality:
        axes.setdefault((finding.message, finding.code), []).append(finding.axis)
    return [(sentence(message), names, code) for (message, code), names in axes.items()]


# A diagnosis as Markdown, for other documents, with its pictures as SVG files.

MARKDOWN_FILE: Final = "report.md"
# What Markdown reads as a mark wherever it stands.
_SIGNS: Final = re.compile(r"[\\`*\[\]~]|(?<![^\W_])_|_(?![^\W_])")
_ENTITIES: Final = {"&": "&amp;", "<": "&lt;", ">": "&gt;", "|": "&#124;"}


def write_markdown(diagnosis: Diagnosis, sources: Sequence[str], folder: Path) -> Path:
    """Write the page and draw its pictures.

    Parameters
    ----------
    diagnosis : Diagnosis
    sources : sequence of str
        Names of the recordings.
    folder : Path
        Receives the page and its pictures.

    Returns
    -------
    Path
        The page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    page = folder / MARKDOWN_FILE
    text = "\n".join(_page(diagnosis, sources, folder)) + "\n"
    page.write_text(text, encoding="utf-8", errors=NOT_TEXT)
    return page


def _page(diagnosis: Diagnosis, sources: Sequence[str], folder: Path) -> Iterator[str]:
    yield f"# What the model gets wrong about {_plain(listed(sources))}"
    for finding in diagnosis.data_quality:
        yield f"- {_plain(f'{finding.code}, axis {finding.axis}: {finding.message}')}"
    for name in diagnosis.axes:
        details = axis_details("a", name, diagnosis)
        tables = (details.follows, details.conditions, details.not_testable)
        yield f"\n## Axis {_plain(name)}"
        for part in (*axis_parts(name, diagnosis), *filter(None, tables)):
            yield from _line(part) if isinstance(part, Line) else _table(part)
        charts = [
            diagnosis_card("a-first", name, diagnosis).chart,
            *details.cause_charts,
            *details.time_charts,
            *(chart for pair in details.maps for chart in pair),
            details.spectrum,
        ]
        stem = re.sub(r"\W", "_", name)
        for number, chart in enumerate(charts):
            yield from _picture(chart, folder / f"{stem}_{number}.svg")


def _line(line: Line) -> Iterator[str]:
    """An item of a list, as deep as the line is indented."""
    said = str(line)
    indent = " " * (len(said) - len(said.lstrip()))
    yield f"{indent}- {_plain(said.strip())}"


def _table(grid: Grid) -> Iterator[str]:
    yield f"\n{_plain(grid.caption)}\n" if grid.caption else ""
    for row in (grid.headings, ["---"] * len(grid.headings), *grid.rows):
        cells = (Markup("<br>").join(map(_plain, str(cell).split("\n"))) for cell in row)
        yield f"| {' | '.join(cells)} |"
    yield ""


def _picture(chart: Chart, file: Path) -> Iterator[str]:
    save_chart(chart, file)
    yield f"\n![{_plain(chart.title)}]({file.name})\n"
    yield _plain(f"{chart.description} {chart.caption}".strip())


def _plain(text: str) -> Markup:
    """Text that stays what it is, on one line: N*m, and whatever stands in a name.

    HTML would be taken as it is. An underscore inside a word is no mark.
    """
    signs = _SIGNS.sub(r"\\\g<0>", on_a_line(text))
    return Markup("".join(_ENTITIES.get(sign, sign) for sign in signs))


# A chart as an SVG file of its own, for documents that are no web pages.

_WIDTH: Final = 900
_ABOVE, _BELOW, _LEFT, _RIGHT = 64, 44, 56, 16
_ALONE: Final = "svg.chart { width: 100%; margin: 0; }\n"
_LETTER: Final = 7  # mean width of a letter of the legend


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

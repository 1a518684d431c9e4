"""What a page shows on its first screen, and how it becomes one file."""

import base64
import hashlib
import json
import os
import shlex
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from edge_ident.report.chart import Chart
from edge_ident.report.numbers import digits
from edge_ident.report.view import Grid
from edge_ident.support.documents import NOT_TEXT, atomic_write, file_sha256
from edge_ident.support.version import VERSION
from edge_ident.support.words import listed, visible

# Every number of the first screen names its place in the JSON document (RFC 6901), so a script can
# check the page.

_MILLI_BELOW: Final = 0.1
_FLAG: Final = ": --motion "


def pointer(*keys: str | int) -> str:
    """The place of a value in a JSON document."""
    parts = (str(key).replace("~", "~0").replace("/", "~1") for key in keys)
    return "".join(f"/{part}" for part in parts)


def number(value: float, text: str, *keys: str | int) -> Markup:
    """A number as text, with its value and its place in the document."""
    return Markup('<data value="{}" data-of="{}">{}</data>').format(
        repr(float(value)), pointer(*keys), text
    )


def percent(share: float, *keys: str | int) -> Markup:
    """A share in percent, to two digits."""
    return number(share, f"{digits(100.0 * share, 2)}\u00a0%", *keys)


def angle(value: float, *keys: str | int) -> Markup:
    """A length of arc in rad, or in mrad where it is small."""
    if abs(value) < _MILLI_BELOW:
        return number(value, f"{digits(1e3 * value, 3)}\u00a0mrad", *keys)
    return number(value, f"{digits(value, 3)}\u00a0rad", *keys)


def recorded(experiment: str) -> Markup:
    """A motion to record, in words for those with a board and those without."""
    motion, flag, name = experiment.partition(_FLAG)
    if not flag:
        return escape(experiment)
    return Markup(
        "{} (with a board: <code class='long'>edge-ident capture --motion {}</code>)"
    ).format(motion, name)


def all_of(parts: Iterable[str | Markup]) -> Markup:
    """Items as a, b and c, escaped where they are plain text."""
    return Markup(listed(str(escape(part)) for part in parts))


def counted(count: int) -> str:
    """A small number as a word."""
    words = ("no", "one", "two", "three", "four", "five", "six")
    return words[count] if count < len(words) else "several"


# What the first screen says of one axis.

PICTURE_HEIGHT: Final = 310
"""Pixels of the first screen's picture, beside the text."""

Status = Literal["good", "found", "open"]
"""Nothing to do, something found, something that is not understood."""


@dataclass(frozen=True)
class Card:
    """The first screen's part of one axis.

    Attributes
    ----------
    axis : str
    status : Status
    label : str
        The status in a word or two.
    verdict : Markup
        One or two sentences of everyday words.
    terms : str
        The same in the field's terms.
    sure, part, action : list of Markup
        How sure that is and what it means, where to look, what to do next.
    chart : Chart
    written : list of Markup
        What a run changed on the board.
    table : Grid or None
    """

    axis: str
    status: Status
    label: str
    verdict: Markup
    terms: str
    sure: list[Markup]
    part: list[Markup]
    action: list[Markup]
    chart: Chart
    written: list[Markup] = field(default_factory=list)
    table: Grid | None = None


@dataclass(frozen=True)
class IntervalRow:
    """One line.

    Attributes
    ----------
    unit, value : str
        What stands before the picture, and behind it.
    picture : Markup
    stands_out : bool
    """

    unit: str
    value: str
    picture: Markup
    stands_out: bool


@dataclass(frozen=True)
class IntervalPicture:
    """Values with their intervals, a line each, on one scale.

    Attributes
    ----------
    key, title : str
        Unique in the page; what is compared.
    rows : list of IntervalRow
    ends : (str, str)
        What the left and the right end of the pictures stand for.
    spread : str
        How the units scatter, or how to read it.
    """

    key: str
    title: str
    rows: list[IntervalRow]
    ends: tuple[str, str]
    spread: str


# From what a page says to one file: templates, style, script, and what the browser may do.


PAGE_FILE: Final = "report.html"
_PACKAGE: Final = "edge_ident.report.page"


def write_html(template: str, content: Mapping[str, Any], document: Any, folder: Path) -> Path:
    """Render a template and write the page, whole or not at all.

    Parameters
    ----------
    template : str
        File name in `templates`.
    content : mapping of name to value
        What the template shows.
    document : JSON object
        Embedded, so that scripts find the numbers in the page itself.
    folder : Path

    Returns
    -------
    Path
        The page.
    """
    style, script = source("style.css"), source("zoom.js")
    text = (
        _environment()
        .get_template(template)
        .render(
            content,
            style=Markup(style),
            script=Markup(script),
            policy=_policy(style, script),
            document=_embedded(document),
        )
    )
    page = folder / PAGE_FILE
    with atomic_write(page) as partial:
        partial.write_text(visible(text) + "\n", encoding="utf-8", errors=NOT_TEXT)
    return page


def _policy(style: str, script: str) -> str:
    """Nothing may be fetched, and no script and no style may act but the page's own."""
    return (
        f"default-src 'none'; style-src {_hash(style)}; script-src {_hash(script)}; "
        "base-uri 'none'; form-action 'none'"
    )


def _hash(source: str) -> str:
    digest = base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()
    return f"'sha256-{digest}'"


def _embedded(document: Any) -> Markup:
    """JSON that no text in it can end."""
    text = json.dumps(document, ensure_ascii=False, allow_nan=False)
    escapes = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026"}
    return Markup("".join(escapes.get(sign, sign) for sign in text))


@cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader(_PACKAGE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def picture(name: str, *of: Any) -> Markup:
    """A picture by its macro in `pictures.jinja`."""
    module = _environment().get_template("pictures.jinja").module
    return Markup(getattr(module, name)(*of))


def source(name: str) -> str:
    """A style sheet or script that is embedded as it is, between line breaks."""
    template, _, _ = PackageLoader(_PACKAGE).get_source(_environment(), name)
    return f"\n{template.strip()}\n"


# Where a page comes from: recordings with hashes, version, command line.


@dataclass(frozen=True)
class Provenance:
    """What somebody needs to repeat a result.

    Attributes
    ----------
    files : tuple of (name, sha256)
        The recordings.
    command : str
        As it was typed, but for what was hidden in a virtual drive.
    version : str
        Of edge-ident.
    validation : (name, sha256) or None
        The recording that models were judged on.
    machine : str
        As its owner calls it; empty where that is not known.
    date : str
        Of the page; that of SOURCE_DATE_EPOCH where a page is to be the same again.
    """

    files: tuple[tuple[str, str], ...]
    command: str
    version: str
    validation: tuple[str, str] | None = None
    machine: str = ""
    date: str = ""

    @classmethod
    def of(
        cls, files: Iterable[Path], validation: Path | None = None, machine: str = ""
    ) -> "Provenance":
        """Provenance of what this process makes of some recordings."""
        typed = shlex.join([Path(sys.argv[0]).name, *_discreet(sys.argv[1:])])
        judged = _hashed(validation) if validation else None
        return cls(tuple(map(_hashed, files)), typed, VERSION, judged, machine, today())

    @property
    def heading(self) -> str:
        """Machine, date and recordings, in a line."""
        names = listed(name for name, _ in self.files)
        recordings = f"recording{'s' if len(self.files) > 1 else ''} {names}" if names else ""
        machine = f"machine {self.machine}" if self.machine else ""
        return " · ".join(part for part in (machine, self.date, recordings) if part)


def today() -> str:
    """The date, as 2026-01-31."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if epoch.isdigit():
        return datetime.fromtimestamp(int(epoch), UTC).date().isoformat()
    return datetime.now().astimezone().date().isoformat()


def _discreet(words: Sequence[str]) -> list[str]:
    """Words of a command line without what they hide in a virtual drive."""
    told, secret = [], False
    for word in words:
        option, given, _ = word.partition("=")
        hides = option in ("--hide", "--hide-seed", "--used", "--wear", "--friction")
        told.append("..." if secret else f"{option}=..." if hides and given else word)
        secret = hides and not given
    return told


def _hashed(file: Path) -> tuple[str, str]:
    return file.name, file_sha256(file)

"""From what a page says to one file: templates, style, script, and what the browser may do."""

import base64
import hashlib
import json
import os
import shlex
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from edge_ident.support.documents import NOT_TEXT, atomic_write, file_sha256
from edge_ident.support.version import VERSION
from edge_ident.support.words import listed, visible

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

"""From what a page says to one file: templates, style, script, and what the browser may do."""

import base64
import hashlib
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from edge_ident.support.documents import NOT_TEXT, atomic_write
from edge_ident.support.words import visible

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

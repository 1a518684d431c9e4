"""Makes a site of the pages: `python -m sphinx -W --keep-going -c docs . site`.

The pages are written for a reader of the repository. What only the site needs is added here: its
navigation, which is the list in docs/README.md, and the docstrings behind docs/api.md.
"""

import re
from pathlib import Path
from typing import Any, Final

import edge_ident

project = "edge-ident"
release = edge_ident.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]

root_doc = "docs/README"
include_patterns = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "docs/**.md"]
exclude_patterns = [".*", "site", "dist", "runs", "tests", "edge_ident", "export"]
# a fence of another language says so
highlight_language = "text"
smartquotes = False  # they turn --option into a dash
myst_heading_anchors = 4
# the language of a page's fences is none of Pygments': "…" in JSON, say
suppress_warnings = ["misc.highlighting_failure"]

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings have types, with shapes and units
napoleon_google_docstring = False
autodoc_default_options = {"members": True}

html_theme = "furo"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_title = f"edge-ident {release}"
html_show_copyright = False
html_show_sphinx = False
html_copy_source = False

_SECTION: Final = re.compile(r"^## (.+?)\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
_ENTRY: Final = re.compile(r"^- \[[^\]]*\]\(([\w./]+)\.md\)", re.MULTILINE)
_EXAMPLE: Final = re.compile(r"\]\((\w+/README)\.md\)")
_KINDS: Final = {
    "Functions": "function", "Classes": "class", "Errors": "exception", "Constants": "data"
}  # fmt: skip
_PROJECT: Final = ("../README", "../CONTRIBUTING", "../CHANGELOG")


def _toctree(caption: str, pages: tuple[str, ...]) -> str:
    return "\n".join(
        ("", "```{toctree}", ":hidden:", ":maxdepth: 1", f":caption: {caption}", "", *pages, "```")
    )


def navigation(index: str) -> str:
    """The sections of the index and the pages that each lists, as the site's navigation."""
    sections = {title: tuple(_ENTRY.findall(text)) for title, text in _SECTION.findall(index)}
    sections["Project"] = _PROJECT
    return "\n".join(_toctree(title, pages) for title, pages in sections.items() if pages)


def docstrings() -> str:
    """Every public name with its docstring, sorted by its kind."""
    names = sorted(name for name in edge_ident.__all__ if not name.startswith("_"))
    lines = ["", "## Every name"]
    for title, kind in _KINDS.items():
        of_kind = [name for name in names if _kind(getattr(edge_ident, name)) == kind]
        rows = [f".. auto{kind}:: edge_ident.{name}" for name in of_kind]
        lines += ["", f"### {title}", "```{eval-rst}", *rows, "```"]
    return "\n".join(lines)


def _kind(named: object) -> str:
    if isinstance(named, type):
        return "exception" if issubclass(named, Exception) else "class"
    return "function" if callable(named) else "data"


def _add_to_page(app: Any, page: str, source: list[str]) -> None:
    if page == root_doc:
        source[0] += navigation(source[0])
    if page == "docs/examples/README":
        source[0] += _toctree("Examples", tuple(_EXAMPLE.findall(source[0])))
    if page == "docs/api":
        source[0] += docstrings()


def _start_at_the_index(app: Any, error: Exception | None) -> None:
    if error is None and app.builder.name == "html":
        start = '<meta http-equiv="refresh" content="0; url=docs/README.html">\n'
        Path(app.outdir, "index.html").write_text(start, encoding="utf-8")


def setup(app: Any) -> None:
    """Register what the site adds."""
    app.connect("source-read", _add_to_page)
    app.connect("build-finished", _start_at_the_index)

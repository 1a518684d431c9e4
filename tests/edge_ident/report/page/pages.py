"""What a page holds, read back by html.parser."""

import json
import re
from dataclasses import dataclass, field
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any

VOID = {"meta", "br", "link", "input", "img", "hr"}


@dataclass
class Element:
    """An element with its attributes, its children and the text directly inside."""

    tag: str
    attributes: dict[str, str | None] = field(default_factory=dict)
    parts: list["Element | str"] = field(default_factory=list)

    def all(self, tag: str) -> list["Element"]:
        """Elements of this tag below this one, in order."""
        below = [part for part in self.parts if isinstance(part, Element)]
        return [
            found
            for part in below
            for found in ([part, *part.all(tag)] if part.tag == tag else part.all(tag))
        ]

    def text(self, *without: str) -> str:
        """All text below, except inside elements of these tags or classes."""
        return "".join(
            part if isinstance(part, str) else part.text(*without)
            for part in self.parts
            if isinstance(part, str) or not part.kinds & set(without)
        )

    @property
    def kinds(self) -> set[str]:
        """The tag, and each class with a dot before it."""
        return {self.tag, *(f".{name}" for name in (self.attributes.get("class") or "").split())}

    def rows(self) -> list[list[str]]:
        """Cells of all rows of the tables below."""
        return [
            [part.text() for part in row.parts if isinstance(part, Element)]
            for row in self.all("tr")
        ]

    def by_id(self, name: str) -> "Element":
        """The one element of this id."""
        every = [self, *(e for tag in ("div", "section", "script", "h2") for e in self.all(tag))]
        (found,) = [element for element in every if element.attributes.get("id") == name]
        return found


class Reader(HTMLParser):
    """Builds the tree, and refuses what is not closed in its place."""

    def __init__(self) -> None:
        super().__init__()
        self.root = Element("")
        self.open = [self.root]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        element = Element(tag, dict(attrs))
        self.open[-1].parts.append(element)
        if tag not in VOID:
            self.open.append(element)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.open[-1].parts.append(Element(tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        closed = self.open.pop()
        assert closed.tag == tag, f"<{closed.tag}> is closed by </{tag}>"

    def handle_data(self, data: str) -> None:
        self.open[-1].parts.append(data)


def read(page: Path) -> Element:
    """The tree of a page."""
    reader = Reader()
    reader.feed(page.read_text(encoding="utf-8"))
    assert reader.open == [reader.root]
    return reader.root


def document(tree: Element) -> Any:
    """The JSON document inside the page."""
    return json.loads(tree.by_id("document").text())


def at(document: Any, pointer: str) -> Any:
    """The value at a place of a document (RFC 6901)."""
    for key in pointer.split("/")[1:]:
        key = key.replace("~1", "/").replace("~0", "~")
        document = document[int(key) if isinstance(document, list) else key]
    return document


def check_structure(page: Path) -> Element:
    """What holds for every page: one file, nothing from outside, readable without seeing it."""
    text, tree = page.read_text(encoding="utf-8"), read(page)
    (html,) = tree.all("html")
    assert html.attributes["lang"] == "en"
    assert len(tree.all("h1")) == 1
    levels = [int(level) for level in re.findall(r"<h([1-6])", text)]
    assert all(after - before <= 1 for before, after in pairwise(levels))
    assert set(re.findall(r"https?://[^\s\"'`)]*", text)) <= {"http://www.w3.org/2000/svg"}
    assert not re.search(r"\b(src|href|action|srcset)=", text)
    outermost = [e for e in tree.all("svg") if e.attributes.get("class") != "plot"]
    assert outermost
    assert all(svg.all("title") and svg.all("title")[0].text().strip() for svg in outermost)
    charts = [svg for svg in outermost if svg.attributes.get("class") == "chart"]
    assert all(re.search(r"\d", svg.all("desc")[0].text()) for svg in charts)
    ids = re.findall(r' id="([^"]+)"', text)
    assert len(ids) == len(set(ids))
    for named in re.findall(r'aria-labelledby="([^"]+)"', text):
        assert set(named.split()) <= set(ids)
    return tree


def check_numbers(tree: Element) -> list[Element]:
    """Every number of the first screen is one of the document's, rounded."""
    first, known = tree.by_id("first-screen"), document(tree)
    numbers = first.all("data")
    for element in numbers:
        value = at(known, element.attributes["data-of"] or "")
        assert float(element.attributes["value"] or "nan") == value
        shown = float(re.sub(r"[^\d.e−-]", "", element.text()).replace("−", "-"))
        scale = {"%": 100.0, "mrad": 1e3}.get(element.text().split("\N{NO-BREAK SPACE}")[-1], 1.0)
        assert abs(shown - scale * value) <= 0.06 * abs(scale * value)
    # what remains are names of files and axes, and the level of the intervals
    rest = first.text("data", "figure", "code", ".name", ".note", "h1")
    assert not re.findall(r"\d", rest.replace("95\N{NO-BREAK SPACE}%", ""))
    return numbers

"""The page: sections of one shape, each of which can be replaced alone."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from textwrap import fill
from typing import Final

from matplotlib.figure import Figure
from PIL import Image

DPI: Final = 90
COLOURS: Final = 256
LINE: Final = 100
INTRODUCTION: Final = """\
# The paper's tables and figures on our data

`python tools/paper.py` writes this page; every number comes from the run that wrote it. The paper's
equations, tables and pictures are not available, so what is said of them is what its text says
([method](method.md)). Where a figure differs from the paper's, the page says why.
"""


@dataclass(frozen=True)
class Sources:
    """What the sections are made from, and where their pictures go.

    Attributes
    ----------
    pictures : Path
        Folder beside the page, of the page's name.
    network : Path
        ONNX file with its manifest beside it.
    losses : pair of Path
        Loss curves of the paper's and of the improved configuration.
    """

    pictures: Path
    network: Path
    losses: tuple[Path, Path]

    def save(self, figure: Figure, name: str, shows: str) -> str:
        """Write a picture; returns the line of the page that shows it."""
        drawn = BytesIO()
        figure.savefig(drawn, dpi=DPI)
        # a palette makes the file a third as large
        picture = Image.open(drawn).convert("RGB")
        picture = picture.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        picture.save(self.pictures / f"{name}.png", optimize=True)
        return f"![{shows}]({self.pictures.name}/{name}.png)"


@dataclass(frozen=True)
class Section:
    """One of the paper's tables or figures, and ours. Texts are Markdown.

    Attributes
    ----------
    title : str
    published : str
        What the paper shows.
    found : str
        What is found here: sentences, tables, pictures.
    differs : str
        In what the two differ, and why.
    """

    title: str
    published: str
    found: str
    differs: str

    def __str__(self) -> str:
        text = (
            f"## {self.title}\n\n**The paper.** {self.published}\n\n**Here.** {self.found}\n\n"
            f"**What differs, and why.** {self.differs}"
        )
        return "\n\n".join(_wrapped(paragraph) for paragraph in text.split("\n\n")) + "\n"


def _wrapped(paragraph: str) -> str:
    if paragraph.startswith(("|", "!")):  # tables and pictures
        return paragraph
    return fill(paragraph, LINE, break_long_words=False, break_on_hyphens=False)


def percent(value: float, digits: int) -> str:
    """A share in percent."""
    return f"{100.0 * value:.{digits}f} %"


def table(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table; all columns but the first are numbers."""
    rule = [" --- ", *[" ---: "] * (len(heading) - 1)]
    lines = [f"| {' | '.join(cells)} |" for cells in (heading, *rows)]
    return "\n".join([lines[0], f"|{'|'.join(rule)}|", *lines[1:]])


def update(page: Path, made: Mapping[str, Section], order: Sequence[str]) -> None:
    """Replace the sections that were made, and keep the others as they are."""
    text = page.read_text() if page.exists() else ""
    _, *parts = re.split(r"^<!-- (\w+) -->\n", text, flags=re.MULTILINE)
    kept = {name: part.strip() + "\n" for name, part in zip(parts[::2], parts[1::2], strict=True)}
    bodies = {**kept, **{name: str(section) for name, section in made.items()}}
    written = [f"<!-- {name} -->\n{bodies[name]}" for name in order if name in bodies]
    page.write_text("\n".join([INTRODUCTION, *written]))

"""The next step as a whole command: with the names of the files, and without what was done already.

Whoever finds something writes what to do with FILE for the recordings, FIRST SECOND for several of
them, and `PAGE` for the page of their diagnosis. Who has run the command knows the rest.
"""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Final

PAGE: Final = "edge-ident diagnose FILE --output DIR"
"""Stands for the page of a diagnosis of the recordings: the command that writes it, or its path."""
_MOTION: Final = re.compile(r"(, such as|:) --motion (\w+)")


@dataclass(frozen=True)
class Done:
    """What a command did.

    Attributes
    ----------
    files : tuple of str
        The recordings, as they were named.
    reading : tuple of str
        Options by which they were read.
    page : str
        Path of the page of their diagnosis; empty where none was written.
    device : str
        Of the board that recorded them; empty where they are files.
    motion : str
        Name of the motion that was recorded, where it is known.
    model : str
        Path of the model whose effects are known; empty where none was given.
    """

    files: tuple[str, ...] = ()
    reading: tuple[str, ...] = ()
    page: str = ""
    device: str = ""
    motion: str = ""
    model: str = ""

    @property
    def recordings(self) -> str:
        """The files and how they are read, as a shell takes them."""
        return shlex.join([*self.files, *self.reading])

    @property
    def known(self) -> str:
        """The same with the model that is known of them, for whoever computes with it."""
        model = ["--model", self.model] if self.model else []
        return shlex.join([*self.files, *self.reading, *model])


NOTHING_DONE: Final = Done()


def whole_step(step: str, done: Done) -> str:
    """A step that can be done as it stands.

    Parameters
    ----------
    step : str
    done : Done

    Examples
    --------
    >>> whole_step("see where: edge-ident diagnose FILE --output DIR", Done(("a b.csv",)))
    "see where: edge-ident diagnose 'a b.csv' --output 'a b-diagnosis'"
    >>> whole_step("see where: edge-ident diagnose FILE --output DIR", Done(page="d/report.html"))
    'see where: d/report.html'
    """
    if done.page:
        step = step.replace(PAGE, done.page)
    if done.files:
        folder = shlex.quote(f"{Path(done.files[0]).stem}-diagnosis")
        for name in ("FIRST SECOND", "FILE"):
            step = step.replace(f"import {name}", f"import {done.recordings}")
            step = step.replace(f" {name}", f" {done.known}")
        step = re.sub(r"\bDIR\b", lambda _: folder, step)
    return _MOTION.sub(lambda found: _motion(found[1], found[2], done), step)


def _motion(before: str, name: str, done: Done) -> str:
    """How to make a motion; nothing but more of it where it is the one that was recorded."""
    if name == done.motion:
        return ", faster or with longer strokes than this one" if before == ", such as" else ""
    if done.device:
        device = shlex.quote(done.device)
        return f": edge-ident capture --device {device} --motion {name}"
    return f" (with a board: edge-ident capture --motion {name})"

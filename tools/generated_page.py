"""Writes a page of docs/ that is made from the code, or says that it is out of date."""

import sys
from collections.abc import Sequence
from pathlib import Path


def write_or_check(arguments: Sequence[str], page: Path, text: str, module: str) -> int:
    """Write a page; with --check, write nothing.

    Parameters
    ----------
    arguments : sequence of str
        Nothing, or `--check`.
    page : Path
    text : str
        What the page has to hold.
    module : str
        The caller's, for `python -m`.

    Returns
    -------
    int
        Exit code: 0; 1 if --check finds another text; 2 for other arguments.
    """
    if list(arguments) not in ([], ["--check"]):
        print(f"usage: python -m {module} [--check]", file=sys.stderr)
        return 2
    stale = not page.is_file() or page.read_text("utf-8") != text
    if arguments and stale:
        print(f"docs/{page.name} is out of date: python -m {module}", file=sys.stderr)
        return 1
    if stale:
        page.write_text(text, encoding="utf-8")
    return 0

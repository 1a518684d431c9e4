"""Lines of an answer, by rich."""

from collections.abc import Iterable, Iterator

from rich.text import Text


def labelled(label: str, said: str, style: str = "bold") -> Text:
    """A line of an answer: what it is about, and what is said of it."""
    return Text.assemble((label, style), f": {said}")


def next_lines(steps: Iterable[str]) -> Iterator[Text]:
    """What to do next, a line for each step."""
    yield from (labelled("next", step) for step in steps)

"""Findings for a person, by rich."""

from collections.abc import Iterable, Iterator

from rich.markup import escape
from rich.text import Text

from edge_ident.estimation.trust import Finding


def finding_lines(findings: Iterable[Finding]) -> Iterator[Text]:
    """Each finding with its next step; red where it blocks."""
    for finding in findings:
        colour = "red" if finding.blocks else "yellow"
        yield Text.from_markup(f"  [{colour}]{finding.code}[/]: {escape(finding.message)}")
        yield Text(f"    next: {finding.next_step}")

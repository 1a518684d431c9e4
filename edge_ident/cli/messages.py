"""Data goes to stdout, messages to stderr."""

import sys
from typing import Any

from edge_ident import report


def say(message: str) -> None:
    """Print a message for the person on stderr."""
    print(message, file=sys.stderr, flush=True)


def print_document(document: dict[str, Any]) -> None:
    """Print the one JSON document on stdout."""
    print(report.to_json(document), flush=True)


def print_error(error: Exception, cause: str, next_step: str, *, as_json: bool) -> None:
    """Print an error in two lines, and as a document where JSON is wanted."""
    say(f"error: {cause}")
    say(f"next:  {next_step}")
    if as_json:
        print_document(
            {
                "schema": "edge-ident/error/1",
                "error": type(error).__name__,
                "cause": cause,
                "next_step": next_step,
            }
        )

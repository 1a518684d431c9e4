"""TOML as it is read here, from files that a person may have got from anybody."""

from typing import Any

from edge_ident.support.limits import (
    MOST_CHARACTERS,
    MOST_DESCRIPTION_BYTES,
    check_document,
    check_size,
)


def from_toml(text: str) -> dict[str, Any]:
    """What a text says.

    Raises
    ------
    ValueError
        It is no TOML, or more than `edge_ident.support.limits` allow.
    """
    import tomllib  # most users have no settings

    check_size("characters", len(text), MOST_DESCRIPTION_BYTES)
    longest = max(map(len, text.splitlines()), default=0)
    check_size("characters in a line", longest, MOST_CHARACTERS)  # the parser's time is its square
    try:
        document: dict[str, Any] = check_document(tomllib.loads(text))
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
    return document

"""Shares as a person writes them: 0.05, or 5%."""

import math

import typer

from edge_ident import commissioning


def share(given: str | float) -> float:
    """A share from a number such as 0.05 or a percentage such as 5%.

    Parameters
    ----------
    given : str or float
        As it stands on the command line, in the environment or in the settings file.

    Raises
    ------
    typer.BadParameter
        If it is neither, or negative.
    """
    text = str(given).strip()
    try:
        found = commissioning.plain_number(text.removesuffix("%")) / (
            100.0 if text.endswith("%") else 1.0
        )
    except ValueError:
        found = math.nan
    if not 0.0 <= found < math.inf:
        raise typer.BadParameter(f"{text!r} is no share: write 5% or 0.05")
    return found


def part(given: str | float) -> float:
    """A share of at most all of something; otherwise as `share`."""
    found = share(given)
    if found > 1.0:
        raise typer.BadParameter(f"{str(given)!r} is more than 100%: write 5% or 0.05")
    return found


def true_part(given: str | float) -> float:
    """A share of something, neither nothing nor all of it; otherwise as `share`."""
    found = share(given)
    if not 0.0 < found < 1.0:
        raise typer.BadParameter(f"{str(given)!r} is not between 0% and 100%: write 5% or 0.05")
    return found
